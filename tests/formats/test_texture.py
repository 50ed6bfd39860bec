"""Textures for renderers: tiles, mipmaps, marks, the same bytes every time."""

import numpy as np
import OpenImageIO as oiio
import pytest

from bakery.formats.texture import ACESCG, REC709_COLORS, write_texture
from bakery.plugins import plug_in
from bakery.types import EXPRESSIONS


def levels(path):
    """The specs and pixels of all mipmaps."""
    found = oiio.ImageInput.open(str(path))
    out = []
    while found.seek_subimage(0, len(out)):
        out.append(
            (found.spec(), found.read_image(0, len(out), 0, found.spec().nchannels, oiio.FLOAT))
        )
    return out


@pytest.mark.parametrize("channels", [3, 1])
def test_a_texture_comes_back_with_tiles_and_mipmaps(tmp_path, channels):
    picture = np.random.default_rng(1).random((128, 128, 3), np.float32)
    picture = picture if channels == 3 else picture[..., 0]
    write_texture(tmp_path / "a.exr", picture, 512)
    found = levels(tmp_path / "a.exr")
    assert [spec.width for spec, _ in found] == [128, 64, 32, 16, 8, 4, 2, 1]
    spec, pixels = found[0]
    assert (spec.tile_width, spec.tile_height, str(spec.format)) == (64, 64, "half")
    assert spec.channelnames == (("R", "G", "B") if channels == 3 else ("Y",))
    assert spec["colorInteropID"] == ("lin_rec709_scene" if channels == 3 else "data")
    np.testing.assert_allclose(pixels.reshape(picture.shape), picture, atol=5e-4)  # half float
    np.testing.assert_allclose(found[-1][1].mean(), picture.mean(), atol=0.02)
    write_texture(tmp_path / "b.exr", picture, 512)
    assert (tmp_path / "a.exr").read_bytes() == (tmp_path / "b.exr").read_bytes()
    write_texture(tmp_path / "c.exr", picture, 64)
    assert levels(tmp_path / "c.exr")[0][0].width == 64


def to_xyz(chromaticities):
    """[3, 3] of a space's primaries to XYZ, written anew (SMPTE RP 177)."""
    points = np.array(chromaticities, float).reshape(4, 2)
    full = np.array([(x / y, 1, (1 - x - y) / y) for x, y in points])
    return full[:3].T * np.linalg.solve(full[:3].T, full[3]), full[3]


def test_acescg_is_the_same_colour_by_its_primaries(tmp_path):
    bradford = np.array(
        [[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]]
    )
    (one, white), (other, aces) = (
        to_xyz(space.chromaticities) for space in (REC709_COLORS, ACESCG)
    )
    adapted = np.linalg.inv(bradford) @ np.diag(bradford @ aces / (bradford @ white)) @ bradford
    np.testing.assert_allclose(ACESCG.matrix, np.linalg.solve(other, adapted @ one), atol=2e-4)
    np.testing.assert_allclose(ACESCG.matrix.sum(1), 1, atol=1e-5)  # grey stays grey
    picture = np.tile(np.float32([0.4, 0.2, 0.1]), (64, 64, 1))
    write_texture(tmp_path / "a.exr", picture, 64, ACESCG)
    spec, pixels = levels(tmp_path / "a.exr")[0]
    assert spec["colorInteropID"] == "lin_ap1_scene"
    np.testing.assert_allclose(spec["chromaticities"], ACESCG.chromaticities, atol=1e-6)
    np.testing.assert_allclose(pixels[0, 0], ACESCG.matrix @ picture[0, 0], atol=2e-4)
    write_texture(tmp_path / "b.exr", picture[..., 0], 64, ACESCG)
    assert levels(tmp_path / "b.exr")[0][0]["colorInteropID"] == "data"


def test_a_file_for_each_key_expression_and_each_mask(avatar, tmp_path):
    plug_in("exporters", "textures").export(avatar, tmp_path / "t", 64)
    names = {path.relative_to(tmp_path / "t").with_suffix("").as_posix() for path in (tmp_path / "t").rglob("*.exr")}  # fmt: skip
    wanted = {"neutral", *avatar.textures.key_names, *(f"masks/{name}" for name in EXPRESSIONS)}
    assert names == wanted | ({"albedo"} if len(avatar.textures.albedo) else set())
