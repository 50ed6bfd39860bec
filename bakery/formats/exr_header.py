"""What the headers of an OpenEXR file say, and how much of it is believed.

OpenEXR's binding gives no pixel types unless it opens the pixels of all parts, so the few attributes
that matter are read here, by the layout that openexr.com publishes.
"""

import struct
from dataclasses import dataclass

from bakery.errors import BundleError

MAGIC = b"\x76\x2f\x31\x01"
LONG_NAMES, MULTI_PART = (
    0x400,
    0x1000,
)  # the flags of a file that is read; tiles and deep data are not
CHANNELS = {1: "Y", 3: "RGB", 4: "RGBA"}  # what browsers' readers accept
HALF, ZIP = 1, 3
ZIP_LINES = 16  # to a chunk
LARGEST_SIDE = 16384  # texels
LARGEST_SAMPLES = 512 * 10**6  # texels times channels, of all parts together; 1 GB of half floats
MOST_PARTS = 512
LARGEST_HEADER = 2**20  # bytes, of all parts together


@dataclass(frozen=True)
class PartHeader:
    """What the header says of one part: half float, scan lines, ZIP."""

    name: str
    width: int  # texels
    height: int
    first_line: int  # y of the top line
    channels: str  # "Y", "RGB" or "RGBA"
    color: str  # colorInteropID, or ""
    chromaticities: tuple[float, ...]  # x, y of red, green, blue, white; () if there are none

    @property
    def chunks(self) -> int:
        """The number of chunks of lines that are packed together."""
        return -(-self.height // ZIP_LINES)


class _Damaged(Exception):
    """The message says what is wrong."""


def parse_header(path, data: bytes) -> tuple[list[PartHeader], int, bool]:
    """The headers at the start of a file.

    Args:
        path: how messages call the file.
        data: the file, or at least `LARGEST_HEADER` bytes of it.

    Returns:
        the parts; where the offset tables begin; whether the file is a multi-part one.

    Raises:
        BundleError: damaged, of another kind than bakery writes, or larger than any bundle's.
    """
    if data[:4] != MAGIC:
        raise BundleError(f"{path}: not an OpenEXR file; make the bundle again")
    try:
        (version,) = struct.unpack_from("<I", data, 4)
        multi = bool(version & MULTI_PART)
        if version & 0xFF != 2 or version & ~0xFF & ~(LONG_NAMES | MULTI_PART):
            raise _Damaged("not a file of scan lines")
        parts, at = [], 8
        while not parts or (multi and data[at]):
            read, at = attributes(data, at)
            parts.append(_part(read, multi))
            if len(parts) > MOST_PARTS:
                raise _Damaged(f"more than {MOST_PARTS} parts")
        _check_size(parts)
        return parts, at + multi, multi
    except (_Damaged, struct.error, IndexError, ValueError) as error:
        reason = str(error) if isinstance(error, _Damaged) else "its header is damaged"
        raise BundleError(f"{path}: {reason}; make the bundle again") from None


def attributes(data, at):
    """The attributes of the header at a place, name -> (type, bytes), and where it ends."""
    found = {}
    while data[at]:
        name, at = _text(data, at)
        kind, at = _text(data, at)
        (size,) = struct.unpack_from("<i", data, at)
        at += 4
        if not 0 <= size <= len(data) - at:
            raise _Damaged("its header is damaged")
        found[name] = (kind, data[at : at + size])
        at += size
        if at > LARGEST_HEADER:
            raise _Damaged(f"headers of more than {LARGEST_HEADER} bytes")
    return found, at + 1


def _text(data, at):
    end = data.index(b"\0", at, at + 256)
    return data[at:end].decode("utf-8"), end + 1


def _part(attributes, multi):
    def value(name, kind, layout):
        found = attributes.get(name)
        if found is None or found[0] != kind or len(found[1]) != struct.calcsize(layout):
            raise _Damaged(f"its header lacks {name}")
        return struct.unpack(layout, found[1])

    def text(name):
        return attributes.get(name, ("", b""))[1].decode("utf-8")

    name = text("name")
    if text("type") != "scanlineimage" and (multi or text("type")):
        raise _Damaged(f"part '{name}' is of type '{text('type')}'; scan lines are needed")
    if value("compression", "compression", "<B") != (ZIP,):
        raise _Damaged(f"part '{name}' is not packed by ZIP")
    left, top, right, bottom = value("dataWindow", "box2i", "<4i")
    colors = attributes.get("chromaticities")
    return PartHeader(
        name=name,
        width=right - left + 1,
        height=bottom - top + 1,
        first_line=top,
        channels=_channels(name, attributes.get("channels", ("", b"\0"))[1]),
        color=text("colorInteropID"),
        chromaticities=value("chromaticities", "chromaticities", "<8f") if colors else (),
    )


def _channels(part, table):
    """The channels' names as one word; only half floats, one for each texel."""
    names, at = [], 0
    while table[at]:
        name, at = _text(table, at)
        kind, _, across, down = struct.unpack_from("<iIii", table, at)
        at += 16
        if kind != HALF or (across, down) != (1, 1):
            raise _Damaged(f"part '{part}': channel {name[:20]} is not half float at every texel")
        names.append(name)
    word = "".join(reversed(names))  # they stand in the order of the alphabet
    if word not in CHANNELS.values():
        raise _Damaged(
            f"part '{part}' has {len(names)} channels ({', '.join(names)[:40]}); "
            f"{', '.join(CHANNELS.values())} are read"
        )
    return word


def _check_size(parts):
    samples = 0
    for part in parts:
        if not (0 < part.width <= LARGEST_SIDE and 0 < part.height <= LARGEST_SIDE):
            raise _Damaged(
                f"part '{part.name}' claims {part.width}x{part.height} texels; "
                f"at most {LARGEST_SIDE} a side are read"
            )
        samples += part.width * part.height * len(part.channels)
    if samples > LARGEST_SAMPLES:
        raise _Damaged(
            f"{samples / 1e6:.0f} million samples; at most {LARGEST_SAMPLES / 1e6:.0f} million are read"
        )
    if len({part.name for part in parts}) < len(parts):
        raise _Damaged("two parts of one name")
