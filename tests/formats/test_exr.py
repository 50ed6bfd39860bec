"""OpenEXR files: pixels come back, damage and size are noticed from the header on."""

import io
import struct
import tracemalloc

import numpy as np
import OpenEXR
import pytest

from bakery.errors import BakeryError, BundleError
from bakery.formats import exr, exr_header


def pictures(count, size=(20, 30), channels=3, seed=0):
    rng = np.random.default_rng(seed)
    return {f"p{k}": rng.random((*size, channels)).astype(np.float16) for k in range(count)}


@pytest.fixture
def path(tmp_path):
    exr.write_exr(tmp_path / "a.exr", pictures(5))
    return tmp_path / "a.exr"


def foreign(path, channels, header=None, name="a"):
    """A file of one part by OpenEXR alone."""
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage} | (
        header or {}
    )
    buffer = io.BytesIO()
    made = {key: OpenEXR.Channel(value) for key, value in channels.items()}
    OpenEXR.File([OpenEXR.Part(header, made, name)]).write(buffer)
    path.write_bytes(buffer.getvalue())
    return path


def test_parts_come_back(tmp_path):
    y, x = np.mgrid[:9, :12]
    parts = {"grey": x / 16, "color": np.stack([x, y, x + y], -1) / 32, "four": np.ones((9, 12, 4))}
    exr.write_exr(tmp_path / "a.exr", parts, exr.DATA)
    back = exr.read_exr(tmp_path / "a.exr")
    assert list(back) == list(parts)
    for name, picture in parts.items():
        assert back[name].dtype == np.float16
        assert (back[name] == picture.astype(np.float16)).all(), name


@pytest.mark.parametrize("size", [(1, 1), (15, 3), (16, 1), (17, 31), (64, 200)])
@pytest.mark.parametrize("channels", [1, 3, 4])
@pytest.mark.parametrize("count", [1, 3])
def test_openexr_reads_the_same(tmp_path, size, channels, count):
    """Our reader against OpenEXR's own, of noise, which is stored as it is, and of flat pictures."""
    parts = pictures(count, size, channels)
    parts["p0"][:, ::2] = 0.25
    parts = {name: one[..., 0] if channels == 1 else one for name, one in parts.items()}
    path = tmp_path / "a.exr"
    exr.write_exr(path, parts)
    ours = exr.read_exr(path)
    theirs = OpenEXR.File(str(path)).parts
    assert [part.name() for part in theirs] == list(ours) == list(parts)
    for part in theirs:
        (channel,) = part.channels.values()
        assert np.array_equal(channel.pixels, ours[part.name()])
        assert np.array_equal(parts[part.name()], ours[part.name()])


def test_a_window_that_does_not_begin_at_zero(tmp_path):
    """Data windows of others: the pixels are those of the window."""
    picture = pictures(1, (40, 7))["p0"]
    corner = np.array([-3, -20], np.int32)
    window = (corner, corner + np.array([6, 39], np.int32))
    path = foreign(tmp_path / "a.exr", {"RGB": picture}, {"dataWindow": window})
    assert np.array_equal(exr.read_exr(path)["a"], picture)


def test_header_says_what_readers_need(path):
    headers = exr.read_header(path)
    assert [part.name for part in headers] == ["p0", "p1", "p2", "p3", "p4"]
    assert {(part.width, part.height) for part in headers} == {(30, 20)}
    assert all(part.channels == "RGB" for part in headers)
    assert all(part.color == "lin_rec709_scene" for part in headers)
    assert all(part.chromaticities == pytest.approx(exr.REC709) for part in headers)


def test_color_is_stated_as_openexr_wants_it(path, tmp_path):
    """The interop ID and the chromaticities agree, by OpenEXR's own check; data has none."""
    exr.write_exr(tmp_path / "data.exr", pictures(2), exr.DATA)
    for file, wanted in ((path, exr.REC709), (tmp_path / "data.exr", None)):
        first = None
        for part in OpenEXR.File(str(file)).parts:
            first = first or part.header
            assert int(OpenEXR.checkColorMetadata(part.header, first)) == 0
            if wanted:
                assert part.header["chromaticities"] == pytest.approx(wanted)
            else:
                assert "chromaticities" not in part.header


def test_bytes_are_reproducible(path, tmp_path):
    before = path.read_bytes()
    parts = exr.read_exr(path)
    exr.write_exr(tmp_path / "b.exr", parts)
    assert (tmp_path / "b.exr").read_bytes() == before


def test_damage_is_refused(tmp_path, capfd):
    """A flipped bit in packed lines is an error in one line, or changes nothing; none is printed."""
    path = tmp_path / "a.exr"
    parts = {name: np.round(one * 16) / 16 for name, one in pictures(5, (40, 30)).items()}
    exr.write_exr(path, parts)
    data = path.read_bytes()
    headers, tables, _ = exr_header.parse_header(path, data)
    lines = tables + 8 * sum(part.chunks for part in headers)
    rng = np.random.default_rng(1)
    for _ in range(400):
        broken = bytearray(data)
        at = int(rng.integers(8, len(data)))
        broken[at] ^= 1 << rng.integers(8)
        path.write_bytes(broken)
        try:
            found = exr.read_exr(path)
        except BundleError as error:
            assert "\n" not in str(error)
        else:
            assert at < lines or all(np.array_equal(found[name], parts[name]) for name in parts)
    for cut in (3, 100, len(data) // 2, len(data) - 5):
        path.write_bytes(data[:cut])
        with pytest.raises(BakeryError):
            exr.read_exr(path)
    said = capfd.readouterr()
    assert said.out == said.err == ""


def test_packed_lines_that_lie_are_refused(tmp_path):
    """Lines that inflate to too little, too much, or have something behind them."""
    import zlib

    path = tmp_path / "a.exr"
    exr.write_exr(path, {"a": np.full((16, 16, 3), 0.5), "b": np.full((16, 16, 3), 0.5)})
    data = path.read_bytes()
    (offset,) = struct.unpack_from("<Q", data, exr_header.parse_header(path, data)[1])
    (size,) = struct.unpack_from("<i", data, offset + 8)
    raw = zlib.decompress(data[offset + 12 : offset + 12 + size])
    for lie in (raw[:-2], raw + b"\0\0", raw * 1000):
        packed = zlib.compress(lie)
        broken = bytearray(data) + struct.pack("<3i", 0, 0, len(packed)) + packed
        struct.pack_into("<Q", broken, exr_header.parse_header(path, data)[1], len(data))
        path.write_bytes(broken)
        with pytest.raises(BundleError, match="lines of part 'a'"):
            exr.read_exr(path)


@pytest.mark.parametrize("value", [0, 2**31, 2**62, 2**64 - 1])
def test_chunks_that_lie_elsewhere_are_refused(path, value):
    data = bytearray(path.read_bytes())
    struct.pack_into("<Q", data, exr_header.parse_header(path, bytes(data))[1], value)
    path.write_bytes(data)
    with pytest.raises(BundleError, match="lines of part 'p0'"):
        exr.read_exr(path)


def test_huge_claims_are_refused_by_the_header(path):
    data = path.read_bytes()
    window = struct.pack("<iiii", 0, 0, 29, 19)
    assert window in data
    for right, bottom in ((10**6, 10**6), (2**31 - 1, 19), (-1, 19), (-(2**31), 19)):
        path.write_bytes(data.replace(window, struct.pack("<iiii", 0, 0, right, bottom)))
        with pytest.raises(BundleError):
            exr.read_header(path)


def test_channels_count_before_pixels_are_read(tmp_path, monkeypatch):
    """201 channels of 8 KB became 3.3 MB; so would many parts."""
    plane = np.zeros((64, 64), np.float16)
    many = foreign(tmp_path / "many.exr", {f"c{k:03d}": plane for k in range(201)})
    for read in (exr.read_header, exr.read_exr):
        with pytest.raises(BundleError, match="has 201 channels"):
            read(many)
    parts = [
        OpenEXR.Part({"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage},
                     {"Y": OpenEXR.Channel(np.zeros((1, 1), np.float16))}, f"p{k}")
        for k in range(exr_header.MOST_PARTS + 1)
    ]  # fmt: skip
    OpenEXR.File(parts).write(str(tmp_path / "parts.exr"))
    with pytest.raises(BundleError, match="more than 512 parts"):
        exr.read_header(tmp_path / "parts.exr")
    monkeypatch.setattr(exr_header, "LARGEST_SAMPLES", 5 * 20 * 30 * 3 - 1)
    exr.write_exr(tmp_path / "a.exr", pictures(5))
    with pytest.raises(BundleError, match="million samples"):
        exr.read_header(tmp_path / "a.exr")


@pytest.mark.parametrize("kind", [np.float32, np.uint32])
def test_only_half_floats_are_read(tmp_path, kind):
    """The reader promises float16; a float32 file took twice the memory."""
    path = foreign(tmp_path / "a.exr", {"RGB": np.ones((8, 8, 3), kind)})
    for read in (exr.read_header, exr.read_exr):
        with pytest.raises(BundleError, match="channel B is not half float"):
            read(path)


@pytest.mark.parametrize(
    ("header", "message"),
    [
        ({"compression": OpenEXR.PIZ_COMPRESSION}, "not packed by ZIP"),
        ({"compression": OpenEXR.NO_COMPRESSION}, "not packed by ZIP"),
        ({"type": OpenEXR.tiledimage, "tiles": OpenEXR.TileDescription()}, "scan lines"),
    ],
)
def test_other_kinds_of_files_are_refused(tmp_path, header, message):
    path = foreign(tmp_path / "a.exr", {"RGB": np.ones((8, 8, 3), np.float16)}, header)
    with pytest.raises(BundleError, match=message):
        exr.read_header(path)


def test_other_files_are_refused(tmp_path):
    (tmp_path / "a.exr").write_bytes(b"hello")
    with pytest.raises(BundleError, match="not an OpenEXR"):
        exr.read_header(tmp_path / "a.exr")


def test_parts_are_opened_one_after_the_other(tmp_path):
    """40 parts of 1 MB that nobody keeps never take the memory of all."""
    picture = np.zeros((512, 1024), np.float16)
    exr.write_exr(tmp_path / "a.exr", {f"p{k}": picture for k in range(40)})
    data = (tmp_path / "a.exr").read_bytes()
    tracemalloc.start()
    count = sum(1 for _ in exr.read_parts(tmp_path / "a.exr", data))
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert count == 40 and peak < 25 * 2**20  # two times eight threads' parts, at most
