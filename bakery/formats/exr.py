"""OpenEXR files: multi-part, half float, ZIP.

ZIP is what every reader opens and what notices damage. Files are made in memory: OpenEXR's own
writer does not report a full disk, Python does.
"""

import contextlib
import io
from dataclasses import dataclass

import numpy as np
import OpenEXR

from bakery.errors import BundleError
from bakery.formats.files import read_bytes, write_bytes

LINEAR, DATA = "lin_rec709_scene", "data"  # colorInteropID
CHANNELS = {1: "Y", 3: "RGB", 4: "RGBA"}  # what browsers' readers accept
THREADS = 2  # lines are packed one by one: the bytes do not depend on it
LARGEST_SIDE = 16384  # texels
LARGEST_TEXELS = 512 * 10**6  # of all parts together


@dataclass(frozen=True)
class PartHeader:
    """What the header says of one part."""

    name: str
    width: int
    height: int
    channels: tuple[str, ...]
    compression: str
    color: str  # colorInteropID, or ""


def write_exr(path, parts, color=LINEAR):
    """Write pictures as the parts of one file.

    Args:
        parts: name -> [H, W], [H, W, 3] or [H, W, 4]; written as half float.
        color: colorInteropID of all parts.

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
            "colorInteropID": color,
        }
        made.append(OpenEXR.Part(header, {names: OpenEXR.Channel(picture)}, name))
    buffer = io.BytesIO()
    OpenEXR.File(made, num_threads=THREADS).write(buffer)
    data = buffer.getbuffer()
    write_bytes(path, data)
    return len(data)


def read_header(path):
    """The parts of a file, without opening pixels.

    Raises:
        BundleError: damaged, or larger than any texture of a bundle.
    """
    with open(path, "rb") as file:
        return _header(path, file)


def read_exr(path):
    """Read all parts of a file: name -> [H, W] or [H, W, C] float16.

    Raises:
        BundleError: damaged or too large.
    """
    return parse_exr(path, read_bytes(path))


def parse_exr(path, data):
    """`read_exr` of bytes; `path` is how messages call them."""
    _header(path, io.BytesIO(data))
    complaints = io.StringIO()
    try:
        # Damaged lines do not raise: the binding prints a warning and leaves their pixels as they are.
        with contextlib.redirect_stdout(complaints):
            parts = OpenEXR.File(io.BytesIO(data), num_threads=THREADS).parts
        pictures = {part.name() or "": _pixels(part.channels) for part in parts}
    except Exception as error:  # the binding raises RuntimeError and its own kinds
        raise _damaged(path, error) from None
    if complaints.getvalue():
        raise _damaged(path, complaints.getvalue())
    return pictures


def _header(path, stream):
    if stream.read(4) != b"\x76\x2f\x31\x01":
        raise BundleError(f"{path}: not an OpenEXR file; make the bundle again")
    stream.seek(0)
    try:
        parts = OpenEXR.File(stream, header_only=True, num_threads=1).parts
        found = [_part_header(part) for part in parts]
    except Exception as error:
        raise _damaged(path, error) from None
    texels = 0
    for part in found:
        if not (0 < part.width <= LARGEST_SIDE and 0 < part.height <= LARGEST_SIDE):
            raise BundleError(
                f"{path}: part '{part.name}' claims {part.width}x{part.height} texels; "
                f"at most {LARGEST_SIDE} a side are read"
            )
        texels += part.width * part.height
    if texels > LARGEST_TEXELS:
        raise BundleError(
            f"{path}: {texels / 1e6:.0f} million texels; at most {LARGEST_TEXELS / 1e6:.0f} million are read"
        )
    return found


def _part_header(part):
    header = part.header
    low, high = (np.asarray(corner, np.int64) for corner in header["dataWindow"])
    width, height = high - low + 1
    channels = header.get("channels", [])
    return PartHeader(
        name=str(header.get("name", "")),
        width=int(width),
        height=int(height),
        channels=tuple(str(channel.name) for channel in channels),
        compression=str(header["compression"]).split(".")[-1],
        color=str(header.get("colorInteropID", "")),
    )


def _pixels(channels):
    for names in ("RGB", "RGBA", "Y"):
        if names in channels:
            return channels[names].pixels
    raise ValueError(f"channels {', '.join(channels)}")


def _damaged(path, error):
    reason = " ".join(str(error).split())[-80:]
    return BundleError(f"{path}: a damaged OpenEXR file ({reason}); make the bundle again")
