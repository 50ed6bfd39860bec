"""What the app Live Link Face sends by UDP: a face a packet.

    uint8    version, 6
    string   device; each string is an int32 length and so many bytes of UTF-8
    string   subject, the name that is set in the app
    int32    frames since midnight, float32 a part of the next one
    int32    frames a second, as a fraction: numerator, int32 denominator
    uint8    61, the number of values
    float32  SENT, angles in radians

All are big-endian. A packet that ends behind the subject says that no face is seen. As readers that
others wrote have it (JimWest/PyLiveLinkFace, MIT); Epic publishes no description.
"""

import struct
from dataclasses import dataclass

import numpy as np

from bakery.check import check_array
from bakery.errors import InputError
from bakery.formats.livelink import EYES, HEAD, ORDER

# As the app's CSV, but left before right: the order of Unreal's EARFaceBlendShape.
SWAPPED = {"JawRight": "JawLeft", "JawLeft": "JawRight",
           "MouthRight": "MouthLeft", "MouthLeft": "MouthRight"}  # fmt: skip
SENT = (*(SWAPPED.get(name, name) for name in ORDER), *HEAD, *EYES)
PLACES = [SENT.index(name) for name in (*ORDER, *HEAD, *EYES)]
VERSION = 6
COUNT = len(SENT)
LONGEST = 1024  # bytes of a name
LARGEST = 65535  # bytes of a packet
LARGEST_ANGLE = 2 * np.pi


@dataclass(frozen=True, eq=False)
class Packet:
    """One face."""

    subject: str
    seconds: float  # since midnight
    values: np.ndarray  # [61] float32: ORDER, HEAD, EYES

    def __post_init__(self):
        check_array("Packet.values", self.values, (COUNT,))


def parse_packet(data: bytes) -> Packet | None:
    """The face of a packet, or None if the app says that it sees none.

    Raises:
        InputError: no such packet.
    """
    try:
        if data[0] != VERSION:
            raise InputError(f"a packet of version {data[0]}; {VERSION} is read")
        _, at = _text(data, 1)
        subject, at = _text(data, at)
        if at == len(data):
            return None
        frame, part, rate, per, count = struct.unpack_from(">ifiiB", data, at)
        if count != COUNT:
            raise InputError(f"a packet of {count} values; {COUNT} are read")
        values = np.array(struct.unpack_from(f">{COUNT}f", data, at + 17), np.float32)[PLACES]
    except (struct.error, IndexError, UnicodeDecodeError):
        raise InputError("a packet that is not of Live Link Face, or is cut") from None
    angles = np.abs(values[len(ORDER) :])
    seconds = (frame + part) * per / rate if rate else np.nan
    if not np.isfinite([*values, seconds]).all() or angles.max() > LARGEST_ANGLE:
        raise InputError("a packet with numbers that are none, or angles beyond a turn")
    return Packet(subject, float(seconds), values)


def _text(data: bytes, at: int) -> tuple[str, int]:
    """A string, and where what follows it begins."""
    (length,) = struct.unpack_from(">i", data, at)
    end = at + 4 + length
    if not 0 <= length <= LONGEST or end > len(data):
        raise IndexError("a string beyond the packet")
    return data[at + 4 : end].decode(), end
