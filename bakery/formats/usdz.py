"""USD's package: a zip file without compression, each file's bytes at a multiple of 64.

Source: openusd.org, "Usdz File Format Specification".
"""

import io
import struct
import zipfile
from collections.abc import Mapping

ALIGNED = 64  # bytes
PADDING = 0x1986  # kind of the extra field of zeros; OpenUSD's own writer has the same
EPOCH = (1980, 1, 1, 0, 0, 0)  # the same bytes whenever they are written
HEADER = 30  # bytes of a file's header, without its name and extra fields


def package(files: Mapping[str, bytes]) -> bytes:
    """A .usdz file; the first of `files` is the layer that it opens with."""
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_STORED) as archive:
        for name, data in files.items():
            entry = zipfile.ZipInfo(name, EPOCH)
            start = out.tell() + HEADER + len(name.encode()) + 4  # the extra field has 4 itself
            gap = -start % ALIGNED
            entry.extra = struct.pack("<HH", PADDING, gap) + bytes(gap)
            archive.writestr(entry, data)
    return out.getvalue()
