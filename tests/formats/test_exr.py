"""OpenEXR files: pixels come back, damage and size are noticed from the header on."""

import struct

import numpy as np
import pytest

from bakery.errors import BakeryError, BundleError
from bakery.formats import exr


@pytest.fixture
def path(tmp_path):
    rng = np.random.default_rng(0)
    parts = {f"p{k}": rng.random((20, 30, 3)).astype(np.float16) for k in range(5)}
    exr.write_exr(tmp_path / "a.exr", parts)
    return tmp_path / "a.exr"


def test_parts_come_back(tmp_path):
    y, x = np.mgrid[:9, :12]
    parts = {"grey": x / 16, "color": np.stack([x, y, x + y], -1) / 32, "four": np.ones((9, 12, 4))}
    exr.write_exr(tmp_path / "a.exr", parts, exr.DATA)
    back = exr.read_exr(tmp_path / "a.exr")
    assert list(back) == list(parts)
    for name, picture in parts.items():
        assert back[name].dtype == np.float16
        assert (back[name] == picture.astype(np.float16)).all(), name


def test_header_says_what_readers_need(path):
    headers = exr.read_header(path)
    assert [part.name for part in headers] == ["p0", "p1", "p2", "p3", "p4"]
    assert {(part.width, part.height) for part in headers} == {(30, 20)}
    assert all(sorted(part.channels) == ["B", "G", "R"] for part in headers)
    assert all(part.compression == "ZIP_COMPRESSION" for part in headers)
    assert all(part.color == "lin_rec709_scene" for part in headers)


def test_bytes_are_reproducible(path, tmp_path):
    before = path.read_bytes()
    parts = exr.read_exr(path)
    exr.write_exr(tmp_path / "b.exr", parts)
    assert (tmp_path / "b.exr").read_bytes() == before


def test_damage_is_refused(path):
    data = path.read_bytes()
    rng = np.random.default_rng(1)
    noticed = 0
    for _ in range(60):
        broken = bytearray(data)
        broken[rng.integers(8, len(data))] ^= 1 << rng.integers(8)
        path.write_bytes(broken)
        try:
            exr.read_exr(path)
        except BundleError as error:
            noticed += "\n" not in str(error)
    assert noticed > 40  # a flipped bit in a name or number is no damage to the packed lines
    for cut in (3, 100, len(data) // 2, len(data) - 5):
        path.write_bytes(data[:cut])
        with pytest.raises(BakeryError):
            exr.read_exr(path)


def test_huge_claims_are_refused_by_the_header(path):
    data = path.read_bytes()
    window = struct.pack("<iiii", 0, 0, 29, 19)
    assert window in data
    path.write_bytes(data.replace(window, struct.pack("<iiii", 0, 0, 10**6, 10**6)))
    with pytest.raises(BundleError):
        exr.read_header(path)


def test_other_files_are_refused(tmp_path):
    (tmp_path / "a.exr").write_bytes(b"hello")
    with pytest.raises(BundleError, match="not an OpenEXR"):
        exr.read_header(tmp_path / "a.exr")
