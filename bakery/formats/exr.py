"""OpenEXR files: multi-part, half float, ZIP.

ZIP is what every reader opens and what notices damage. OpenEXR writes them, into memory: its own
writer does not report a full disk, Python does. They are read here, for OpenEXR's binding prints
damage to stdout and stderr where it should raise, and opens the pixels of all parts at once.
"""

import io
import struct
import zlib
from collections.abc import Iterator, Mapping

import numpy as np
import OpenEXR

from bakery.errors import BundleError
from bakery.formats.exr_header import (
    CHANNELS,
    LARGEST_HEADER,
    ZIP_LINES,
    PartHeader,
    parse_header,
)
from bakery.formats.files import read_bytes, write_bytes
from bakery.parallel import side_by_side

LINEAR, DATA = "lin_rec709_scene", "data"  # colorInteropID
REC709 = (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290)  # x, y of red, green, blue, white
THREADS = 2  # lines are packed one by one: the bytes do not depend on it
LARGEST = 2**31  # bytes of a file


def write_exr(path, parts: dict, color: str | Mapping[str, str] = LINEAR) -> int:
    """Write pictures as the parts of one file.

    Args:
        parts: name -> [H, W], [H, W, 3] or [H, W, 4]; written as half float.
        color: colorInteropID of all parts, or of each by its name; LINEAR also writes the chromaticities of Rec.709.

    Returns:
        The number of bytes.
    """
    made = []
    for name, picture in parts.items():
        picture = np.ascontiguousarray(picture, np.float16)
        names = CHANNELS[1 if picture.ndim == 2 else picture.shape[2]]
        header = {
            "compression": OpenEXR.ZIP_COMPRESSION,
            "type": OpenEXR.scanlineimage,
            "colorInteropID": color if isinstance(color, str) else color[name],
        }
        if header["colorInteropID"] == LINEAR:
            header["chromaticities"] = REC709
        made.append(OpenEXR.Part(header, {names: OpenEXR.Channel(picture)}, name))
    buffer = io.BytesIO()
    try:
        OpenEXR.File(made, num_threads=THREADS).write(buffer)
    except RuntimeError as error:  # it writes to memory, so nothing else can fail
        raise MemoryError(f"{path}: cannot be packed ({error})") from None
    data = buffer.getbuffer()
    write_bytes(path, data)
    return len(data)


def read_header(path) -> list[PartHeader]:
    """The parts of a file, without opening pixels.

    Raises:
        BundleError: damaged, or larger than any texture of a bundle.
    """
    return parse_header(path, read_bytes(path, LARGEST, first=LARGEST_HEADER))[0]


def read_exr(path) -> dict[str, np.ndarray]:
    """Read all parts of a file: name -> [H, W] or [H, W, C] float16.

    Raises:
        BundleError: damaged or too large.
    """
    return dict(read_parts(path, read_bytes(path, LARGEST)))


def read_parts(path, data: bytes) -> Iterator[tuple[str, np.ndarray]]:
    """Yield name and picture of one part after the other, [H, W] or [H, W, C] float16.

    Args:
        path: how messages call the file.
        data: the file.

    Raises:
        BundleError: damaged or too large.
    """
    headers, at, multi = parse_header(path, data)
    places = []
    for number, part in enumerate(headers):
        if at + 8 * part.chunks > len(data):
            raise _damaged(path, part)
        places.append(
            (number if multi else None, part, np.frombuffer(data, "<u8", part.chunks, at))
        )
        at += 8 * part.chunks

    def picture(place):
        number, part, offsets = place
        try:
            return _picture(data, number, part, offsets.tolist())
        except (struct.error, zlib.error, ValueError, OverflowError):
            raise _damaged(path, part) from None

    for part, found in zip(headers, side_by_side(picture, places)):
        yield part.name, found


def _picture(data, number, part, offsets):
    """The pixels of a part [H, W] or [H, W, C] float16; `number` is its own in a multi-part file."""
    count = len(part.channels)
    out = np.empty((part.height, part.width, count), np.float16)
    for index, at in enumerate(offsets):
        top = index * ZIP_LINES
        lines = min(ZIP_LINES, part.height - top)
        if number is not None:
            if struct.unpack_from("<i", data, at) != (number,):
                raise ValueError("a chunk of another part")
            at += 4
        line, size = struct.unpack_from("<2i", data, at)
        at += 8
        if line != part.first_line + top or not 0 <= size <= len(data) - at:
            raise ValueError("a chunk of other lines")
        raw = _unpacked(data[at : at + size], 2 * lines * part.width * count)
        planes = raw.view("<f2").reshape(lines, count, part.width)  # channels by the alphabet
        out[top : top + lines] = planes[:, ::-1].transpose(0, 2, 1)
    return out[..., 0] if count == 1 else out


def _unpacked(packed, size):
    """The bytes of a chunk: inflated, then each the sum of what came before, even ones first."""
    if len(packed) == size:  # what does not shrink is stored as it is
        return np.frombuffer(packed, np.uint8)
    stream = zlib.decompressobj()
    raw = stream.decompress(packed, size + 1)
    if len(raw) != size or not stream.eof:
        raise ValueError("a chunk of another size")
    summed = np.cumsum(np.frombuffer(raw, np.uint8), dtype=np.uint8)
    summed[1::2] ^= 0x80  # differences are stored with 128 added
    out = np.empty(size, np.uint8)
    half = (size + 1) // 2
    out[0::2], out[1::2] = summed[:half], summed[half:]
    return out


def _damaged(path, part):
    return BundleError(
        f"{path}: a damaged OpenEXR file (lines of part '{part.name}'); make the bundle again"
    )
