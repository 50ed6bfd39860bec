"""What stands where in the EXR files: few channels, names that people know, and all of it comes back."""

import json

import numpy as np
import pytest

from bakery.errors import BundleError
from bakery.export import bundle as bundles
from bakery.export import layout
from bakery.export.manifest import _textures_table
from bakery.export.schema import seal
from bakery.export.validate import problems
from bakery.formats import exr
from bakery.types import EXPRESSIONS, Textures

NUKE = 1023  # channels that one script can have


def made_up(mouths, seed=0):
    """Textures of the default bundle's numbers, and tiny; masks [52, 8, 8]."""
    rng = np.random.default_rng(seed)

    def pictures(*shape):
        return rng.random(shape).astype(np.float16)

    weights = rng.random((mouths, 52)).round(2).astype(np.float32)
    textures = Textures(
        neutral=pictures(16, 16, 3),
        keys=pictures(6, 16, 16, 3),
        key_names=("smile", "surprise", "anger", "sadness", "kiss", "grimace"),
        key_weights=rng.random((6, 52)).round(2).astype(np.float32),
        source=rng.integers(0, 5, (16, 16)).astype(np.uint8),
        facing=pictures(16, 16),
        hair=pictures(16, 16, 4),
        gaze=pictures(20, 3, 6, 3),
        gaze_directions=rng.uniform(-30, 30, (20, 2)).round(2),
        mouths=pictures(mouths, 5, 7, 3),
        mouth_landmarks=rng.random((mouths, 40, 2)).round(4),
        mouth_weights=weights,
    )
    return textures, pictures(52, 8, 8).astype(np.float32)


def written(folder, textures, masks):
    """The EXR files in a folder, and a manifest as far as readers of textures look into it."""
    folder.mkdir()
    bundles.write_textures(folder, textures, masks)
    return {**_textures_table(textures, masks), "files": bundles.list_files(folder)}


@pytest.mark.parametrize("count", [1, 3, 9, 10, 11, 59, 60, 61, 120, 299, 300])
def test_textures_come_back(tmp_path, count):
    textures, masks = made_up(count)
    manifest = written(tmp_path / "a", textures, masks)
    back, back_masks = bundles.read_textures(tmp_path / "a", manifest)
    for name in ("neutral", "keys", "source", "facing", "hair", "gaze", "mouths", "mouth_weights"):
        assert np.array_equal(getattr(back, name), getattr(textures, name)), name
    assert np.array_equal(back_masks, masks) and back_masks.dtype == np.float32
    assert back.mouths.dtype == np.float16 and back.mouths.flags.c_contiguous


def test_a_default_bundle_fits_into_one_script(tmp_path):
    """300 mouths, 20 gazes, 6 keys, 52 masks: all files at once, in a program that counts channels."""
    written(tmp_path / "a", *made_up(300))
    parts = [part for path in (tmp_path / "a").glob("*.exr") for part in exr.read_header(path)]
    count = sum(len(part.channels) for part in parts)
    assert count == 21 + 4 + 60 + 15 + 2 + 52 <= 1000 < NUKE
    assert max(max(part.width, part.height) for part in parts) <= 70  # 10 x 6 mouths of 7 x 5


def test_a_mask_is_a_part_with_the_name_of_its_shape(tmp_path):
    textures, masks = made_up(3)
    written(tmp_path / "a", textures, masks)
    headers = exr.read_header(tmp_path / "a" / "masks.exr")
    assert [part.name for part in headers] == list(EXPRESSIONS)
    assert {(part.channels, part.color, part.chromaticities) for part in headers} == {
        ("Y", "data", ())
    }
    jaw = exr.read_exr(tmp_path / "a" / "masks.exr")["jawOpen"]
    assert np.array_equal(jaw, masks[EXPRESSIONS.index("jawOpen")].astype(np.float16))


def test_a_mouth_stands_where_the_schema_says(tmp_path):
    """Mouth 137 of 300: the third part, cell 17, the second row, the eighth column."""
    textures, masks = made_up(300)
    manifest = written(tmp_path / "a", textures, masks)
    assert manifest["mouths"]["columns"] == 10 and manifest["mouths"]["rows"] == 6
    assert manifest["mouths"]["parts"][2] == "mouths120_179"
    sheet = exr.read_exr(tmp_path / "a" / "mouth.exr")["mouths120_179"]
    assert np.array_equal(sheet[5:10, 49:56], textures.mouths[137])


def test_the_grid_holds_all_mouths():
    for count in range(1, 301):
        columns, rows = layout.mouth_grid(count)
        parts = layout.mouth_parts(count)
        assert columns <= 10 and rows <= 6
        assert columns * rows * (len(parts) - 1) < count <= columns * rows * len(parts)
        assert len(set(parts)) == len(parts)


def test_mouths_that_do_not_fit_their_parts_are_refused(tmp_path):
    manifest = written(tmp_path / "a", *made_up(11))
    for wrong in ({"columns": 3}, {"rows": 7}, {"columns": 64, "rows": 64}, {"parts": ["a"]}):
        changed = manifest | {"mouths": manifest["mouths"] | wrong}
        with pytest.raises(BundleError, match="do not fit"):
            bundles.read_textures(tmp_path / "a", changed)
    more = manifest["mouths"]["landmarks"] * 1000
    changed = manifest | {"mouths": manifest["mouths"] | {"landmarks": more}}
    with pytest.raises(BundleError, match="11000 mouths in 1 parts of 20"):
        bundles.read_textures(tmp_path / "a", changed)


def rewrite(folder, name, parts, color):
    """Other parts in a file of a bundle, with the right size and hash."""
    exr.write_exr(folder / name, parts, color)
    manifest = json.loads((folder / "avatar.json").read_text())
    listed = bundles.list_files(folder)
    (folder / "avatar.json").write_bytes(seal(manifest | {"files": listed}))


CASES = {
    "a mask of another name": (
        "masks.exr", lambda parts: {("jaw" if n == "jawOpen" else n): p for n, p in parts.items()},
        exr.DATA, "lacks part 'jawOpen'",
    ),
    "masks as colours": (
        "masks.exr", lambda parts: {n: np.repeat(p[..., None], 3, 2) for n, p in parts.items()},
        exr.DATA, "has channels RGB",
    ),
    "masks marked as colour": ("masks.exr", dict, exr.LINEAR, "is not marked as data"),
    "data with chromaticities": ("coverage.exr", dict, exr.LINEAR, "needs none, for it is data"),
    "colour without chromaticities": ("face.exr", dict, exr.DATA, "needs those of Rec.709"),
    "one mouth too few": ("mouth.exr", lambda parts: {"a": parts.popitem()[1]}, exr.LINEAR,
        "lacks part 'mouths"),
    "mouths that do not divide": ("mouth.exr", lambda parts: {n: p[:, :-1] for n, p in parts.items()},
        exr.LINEAR, "does not divide into"),
    "an albedo of another name": ("albedo.exr", lambda parts: {"skin": parts["albedo"]}, exr.LINEAR,
        "part 'skin'"),
    "an albedo marked as data": ("albedo.exr", dict, exr.DATA, "is not marked as lin_rec709"),
    "a part more": ("hair.exr", lambda parts: parts | {"wig": parts["hair"]}, exr.LINEAR,
        "unknown part 'wig'"),
}  # fmt: skip


@pytest.mark.parametrize("case", CASES)
def test_validate_knows_the_layout(copy, case):
    name, change, color, message = CASES[case]
    rewrite(copy, name, change(exr.read_exr(copy / name)), color)
    found = problems(copy)
    assert any(message in line for line in found), found
    assert all(line.startswith(f"{name}: ") for line in found), found
