"""USD's package, byte by byte."""

import struct
import zipfile

import pytest

from bakery.formats.usdz import ALIGNED, package


@pytest.mark.parametrize("length", [0, 1, 63, 64, 1000])
def test_bytes_begin_at_multiples_of_64_and_are_not_packed(tmp_path, length):
    files = {"a.usdc": bytes(length), "textures/b.png": b"\x89PNG" * 20, "c.jpg": b"c"}
    path = tmp_path / "a.usdz"
    path.write_bytes(package(files))
    with zipfile.ZipFile(path) as archive:
        assert archive.testzip() is None
        assert archive.namelist() == list(files)  # the first is what opens
        for entry in archive.infolist():
            head = path.read_bytes()[entry.header_offset :][:30]
            name, extra = struct.unpack_from("<HH", head, 26)
            assert (entry.header_offset + 30 + name + extra) % ALIGNED == 0
            assert entry.compress_type == zipfile.ZIP_STORED
            assert archive.read(entry) == files[entry.filename]
    assert package(files) == path.read_bytes()
