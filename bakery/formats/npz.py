"""Named arrays as .npz, written the same each time and read with nothing taken on trust.

numpy's own reader takes the memory that a header asks for before it looks whether the file holds as
much, and lets out whatever zip, zlib and its parser raise.
"""

import ast
import contextlib
import io
import math
import sys
import zipfile
from collections.abc import Mapping

import numpy as np

MOST = 1000  # arrays
LARGEST = 512 * 2**20  # bytes of all arrays together, unpacked; no head model has as many
KINDS = "biufUS"  # numpy's letters of the types that are read: truth, numbers, text
PACKED = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
START = b"\x93NUMPY\x01\x00"  # version 1.0; numpy takes another one for headers above 64 KiB only
ENDING = ".npy"


class NpzError(ValueError):
    """What is wrong with an .npz, in a few words without a name; callers say which file it is."""


def pack_arrays(arrays: Mapping[str, np.ndarray]) -> memoryview:
    """Named arrays as npz bytes; the same arrays give the same bytes (numpy would stamp the time)."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_STORED) as archive:
        for name, array in arrays.items():
            with archive.open(zipfile.ZipInfo(name + ENDING), "w", force_zip64=True) as stream:
                np.lib.format.write_array(stream, np.asarray(array), allow_pickle=False)
    return buffer.getbuffer()


def unpack_arrays(data: bytes | memoryview, largest: int = LARGEST) -> dict[str, np.ndarray]:
    """Named arrays from npz bytes.

    Args:
        data: the file.
        largest: bytes that all arrays may have together, unpacked.

    Raises:
        NpzError: damaged, encrypted, packed in another way, with an array twice or one that is
            neither numbers nor text, or larger than it says or may be.
    """
    with _opened(data, largest) as (archive, members):
        return {name: _read(archive, member) for name, member in members.items()}


def check_arrays(data: bytes | memoryview, largest: int = LARGEST) -> None:
    """Raise what `unpack_arrays` would of the directory and the headers; no array is unpacked."""
    with _opened(data, largest):
        pass


@contextlib.contextmanager
def _opened(data, largest):
    """The archive and its members by name, all checked; what is raised in the block has one reason."""
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            yield archive, _checked(archive, largest)
    except (NpzError, MemoryError):
        raise
    except Exception as error:  # zipfile, zlib and the parsers raise almost anything
        raise NpzError("damaged, or no .npz file") from error


def _checked(archive, largest):
    members = archive.infolist()
    if len(members) > MOST:
        raise NpzError(f"holds {len(members)} arrays, at most {MOST} are read")
    size = sum(member.file_size for member in members)
    if size > largest:
        raise NpzError(
            f"unpacks to {size / 2**20:.0f} MiB, at most {largest / 2**20:.0f} MiB are read"
        )
    checked = {}
    for member in members:
        name = member.filename.removesuffix(ENDING)
        if name in checked:
            raise NpzError(f"holds {name[:60]!r} twice")
        _check_member(archive, member, name[:60])
        checked[name] = member
    return checked


def _check_member(archive, member, name):
    if not member.filename.endswith(ENDING):
        raise NpzError(f"holds {name!r}, which is no array")
    if member.flag_bits & 0x41:
        raise NpzError(f"{name!r} is encrypted")
    if member.compress_type not in PACKED:
        raise NpzError(f"{name!r} is packed by method {member.compress_type}; deflate is read")
    with archive.open(member) as stream:
        if stream.read(len(START)) != START:
            raise NpzError(f"{name!r} is no array of numpy")
        header = stream.read(int.from_bytes(stream.read(2), "little"))
        start = stream.tell()
    table = ast.literal_eval(header.decode("latin-1"))
    shape, kind = table["shape"], np.dtype(str(table["descr"]))
    if kind.kind not in KINDS:
        raise NpzError(f"{name!r} holds objects, not numbers or text")
    promised = math.prod(shape) * kind.itemsize
    if min(shape, default=0) < 0 or promised != member.file_size - start:
        raise NpzError(
            f"the header of {name!r} promises {promised} bytes, {member.file_size - start} follow"
        )


def _read(archive, member):
    with archive.open(member) as stream:
        array = np.lib.format.read_array(stream, allow_pickle=False)
    if array.dtype.kind == "U" and array.size:  # Python itself fails on numbers that are no letters
        letters = np.ascontiguousarray(array).view(np.uint8).view(array.dtype.byteorder + "u4")
        if letters.max() > sys.maxunicode:
            raise NpzError(f"{member.filename.removesuffix(ENDING)[:60]!r} holds damaged text")
    return array
