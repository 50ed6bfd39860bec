"""CBOR as C2PA manifests hold it: read from strangers' files, so bounded in depth and in entries.

Source: RFC 8949, "Concise Binary Object Representation".
"""

import struct
from typing import Any

DEEPEST = 16  # values within values
MOST = 100_000  # values in one text


class CborError(ValueError):
    """Not CBOR, or more of it than any manifest has."""


def loads(data: bytes) -> Any:
    """The first value in some bytes; of a tagged value, the value.

    Floats, byte strings and texts are what Python has; what follows the value is left alone.

    Raises:
        CborError: cut short, of indefinite length, or beyond DEEPEST and MOST.
    """
    try:
        return _Reader(data).value(0)
    except (struct.error, IndexError, UnicodeDecodeError, TypeError) as error:
        raise CborError(f"damaged CBOR ({error})") from None


class _Reader:
    def __init__(self, data):
        self.data, self.at, self.left = data, 0, MOST

    def value(self, depth):
        self.left -= 1
        if depth > DEEPEST or self.left < 0:
            raise CborError("more CBOR than any manifest has")
        kind, low = divmod(self.data[self.at], 32)
        self.at += 1
        if kind == 7:
            return self._simple(low)
        number = self._number(low)
        if kind == 0:
            return number
        if kind == 1:
            return -1 - number
        if kind == 2:
            return self._bytes(number)
        if kind == 3:
            return self._bytes(number).decode()
        if kind == 4:
            return [self.value(depth + 1) for _ in range(self._fits(number))]
        if kind == 5:
            return {self.value(depth + 1): self.value(depth + 1) for _ in range(self._fits(number))}
        return self.value(depth + 1)  # behind a tag

    def _simple(self, low):
        if low >= 24:
            kinds = {24: "B", 25: ">e", 26: ">f", 27: ">d"}
            if low not in kinds:
                raise CborError("a value of indefinite length")
            (number,) = struct.unpack(kinds[low], self._bytes(1 << (low - 24)))
            return number
        return {20: False, 21: True}.get(low)

    def _number(self, low):
        if low < 24:
            return low
        if low > 27:
            raise CborError("a value of indefinite length")
        return int.from_bytes(self._bytes(1 << (low - 24)), "big")

    def _fits(self, count):
        """A count of entries, each of which takes a byte at least."""
        if count > len(self.data) - self.at:
            raise CborError("cut short")
        return count

    def _bytes(self, count):
        piece = self.data[self.at : self.at + count]
        if len(piece) != count:
            raise CborError("cut short")
        self.at += count
        return piece
