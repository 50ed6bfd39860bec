"""Marks: found again in every kind of file, by other readers too, and nothing else is changed."""

import io
import json
import struct
import zipfile
from xml.etree import ElementTree

import numpy as np
import OpenEXR
import OpenImageIO as oiio
import pytest
from PIL import Image

from bakery.errors import InputError
from bakery.formats import glb, mark, video
from bakery.formats.exr import read_exr, write_exr
from bakery.formats.image import encode_image
from bakery.formats.ingredient import read_ingredient
from bakery.formats.usdz import package
from bakery.types import Ingredient

MARK = mark.Mark(mark.IPTC + "compositeSynthetic", "bakery 1 <&>", "ab" * 32)
EVERY = MARK.properties()


def pixels(channels=3):
    return np.random.default_rng(0).integers(0, 256, (21, 34, channels), np.uint8)


@pytest.mark.parametrize(
    "kind, channels", [(".png", 3), (".png", 4), (".jpg", 3), (".webp", 3), (".webp", 4)]
)
@pytest.mark.parametrize("quality", [80, 101])  # 101: WebP without loss
def test_pictures_carry_it_in_xmp(kind, channels, quality, tmp_path):
    plain = encode_image(pixels(channels), kind, quality if kind == ".webp" else 90)
    data = mark.stamped(kind, plain, MARK)
    (tmp_path / f"a{kind}").write_bytes(data)
    assert mark.found(tmp_path / f"a{kind}") == MARK
    before, after = (Image.open(io.BytesIO(one)) for one in (plain, data))
    assert np.array_equal(np.asarray(before), np.asarray(after)) and before.mode == after.mode
    xmp = ElementTree.fromstring(after.info["xmp"])  # as Pillow finds it, by a reader of XML
    about = {one.tag.split("}")[1]: one.text for one in xmp.iter()}
    assert about["DigitalSourceType"] == MARK.source_type and about["CreatorTool"] == MARK.tool


@pytest.mark.parametrize("parts", [1, 3])
def test_openexr_carries_it_as_attributes(parts, tmp_path):
    path = tmp_path / "a.exr"
    pictures = {f"part{n}": np.float16(np.random.rand(40, 30, 3)) for n in range(parts)}
    write_exr(path, pictures)
    mark.stamp(path, MARK)
    assert mark.found(path) == MARK
    back = read_exr(path)
    for part in OpenEXR.File(str(path)).parts:  # by OpenEXR's own reader
        np.testing.assert_array_equal(part.channels["RGB"].pixels, pictures[part.name()])
        np.testing.assert_array_equal(back[part.name()], pictures[part.name()])
    assert OpenEXR.File(str(path)).parts[0].header["digitalSourceType"] == MARK.source_type


def test_tiles_with_mipmaps_carry_it(tmp_path):
    """As `export --format textures` writes them."""
    path, spec = tmp_path / "a.exr", oiio.ImageSpec(128, 128, 3, "half")
    spec.tile_width = spec.tile_height = 32
    picture = np.float32(np.random.default_rng(0).random((128, 128, 3)))
    source = oiio.ImageBuf(oiio.ImageSpec(128, 128, 3, "half"))
    source.set_pixels(oiio.ROI(), picture)
    assert oiio.ImageBufAlgo.make_texture(oiio.MakeTxTexture, source, str(path), spec)
    before = [oiio.ImageBuf(str(path), 0, level).get_pixels() for level in (0, 2)]
    mark.stamp(path, MARK)
    assert mark.found(path) == MARK
    for level, wanted in zip((0, 2), before):
        np.testing.assert_array_equal(oiio.ImageBuf(str(path), 0, level).get_pixels(), wanted)


@pytest.mark.parametrize("kind", [".glb", ".vrm"])
def test_gltf_carries_it_as_json_ld(kind, tmp_path):
    plain = glb.joined({"asset": {"version": "2.0"}}, b"1234")
    (tmp_path / f"a{kind}").write_bytes(mark.stamped(kind, plain, MARK))
    assert mark.found(tmp_path / f"a{kind}") == MARK
    document, binary = glb.apart((tmp_path / f"a{kind}").read_bytes())
    packet = document["asset"]["extensions"]["KHR_xmp_json_ld"]["packet"]
    said = document["extensions"]["KHR_xmp_json_ld"]["packets"][packet]
    assert EVERY.items() <= said.items() and set(mark.NAMESPACES) == set(said["@context"])
    assert document["extensionsUsed"] == ["KHR_xmp_json_ld"] and binary == b"1234"


def test_pages_carry_it_as_json_ld(tmp_path):
    head = mark.page_head(MARK)
    (tmp_path / "a.html").write_text(f"<!doctype html>\n<html><head>{head}</head></html>")
    assert mark.found(tmp_path / "a.html") == MARK and "<&>" not in head


@pytest.mark.parametrize("kind", [".mp4", ".webm"])
def test_films_carry_it_and_the_marks_of_their_clips(kind, tmp_path):
    path, part = tmp_path / f"a{kind}", tmp_path / "part"
    own = Ingredient("cd" * 32, claimed=(mark.IPTC + "trainedAlgorithmicMedia",))
    part.write_bytes(video.encode([pixels()[:20]] * 2, kind, 25.0))
    video.join(path, [part], kind, 25.0, (34, 20), video.Note("<&>", MARK.source_type, (own,)))
    said = mark.found(path)
    assert said.source_type == MARK.source_type and said.tool.startswith("bakery ")
    assert said.photo == "" and f"urn:sha256:{own.sha256}".encode() in path.read_bytes()
    assert read_ingredient(path).source_type == MARK.source_type, "its own, not that of the clip"
    note = video.Note("<&>", MARK.source_type, (own,))
    tree = ElementTree.fromstring(note.xmp())
    (entry,) = (one for one in tree.iter() if one.tag.endswith("}Ingredients"))
    assert [one.text for one in entry.iter() if one.text] == [
        f"urn:sha256:{own.sha256}",
        own.claimed[0],
    ]


def test_usdz_carries_it_in_its_pictures(tmp_path):
    plain = package({"head.usdc": b"layer", "a.png": encode_image(pixels(), ".png")})
    (tmp_path / "a.usdz").write_bytes(mark.stamped(".usdz", plain, MARK))
    assert mark.found(tmp_path / "a.usdz") == MARK
    with zipfile.ZipFile(tmp_path / "a.usdz") as archive:
        assert (
            archive.namelist() == ["head.usdc", "a.png"] and archive.read("head.usdc") == b"layer"
        )
        for entry in archive.infolist():  # as the format asks
            assert entry.compress_type == zipfile.ZIP_STORED
            start = entry.header_offset + 30 + len(entry.filename) + len(entry.extra)
            assert start % 64 == 0
        picture = Image.open(io.BytesIO(archive.read("a.png")))
    np.testing.assert_array_equal(np.asarray(picture), pixels())


def test_what_has_none_says_so(tmp_path):
    for name, data in {
        "a.png": encode_image(pixels(), ".png"), "a.json": b"{}", "a.txt": b"words", "b.json": b'{"provenance": {}}',
        "a.html": b"<!doctype html><p>", "a.glb": glb.joined({"asset": {}}, b""),
    }.items():  # fmt: skip
        (tmp_path / name).write_bytes(data)
        assert mark.found(tmp_path / name) is None, name


@pytest.mark.parametrize(
    "data",
    [
        b"glTF" + bytes(4), b"{", b"[", b"\x76\x2f\x31\x01" + bytes(9), b"glTF" + struct.pack("<4I", 2, 9, 2**31, 1),
        b'{"provenance": {"digitalSourceType": 1}}', b"<!doctype html><script type=\"application/ld+json\">[1</script>",
        json.dumps({"provenance": [], "asset": 1}).encode(), b'{"provenance": {"digitalSourceType": "x"}, "asset": []}',
    ],
)  # fmt: skip
def test_damaged_files_end_in_one_line(data, tmp_path):
    (tmp_path / "a").write_bytes(data)
    try:
        assert mark.found(tmp_path / "a") is None
    except InputError as error:
        assert "\n" not in str(error) and "make it again" in str(error)
