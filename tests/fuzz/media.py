"""Changes of clips and pictures that know the format: MP4, WebM, PNG, JPEG, TIFF; see `containers`."""

import io
import struct
import zlib
from functools import cache

import mutate

# --- MP4, WebM ---

INSIDE = (b"moov", b"trak", b"mdia", b"minf", b"stbl", b"edts", b"wave", b"udta")


@cache
def boxes(data, start=0, end=None):
    """Places of all boxes of an MP4: [(start, end)]."""
    found, end = [], len(data) if end is None else end
    while start + 8 <= end:
        size, kind = struct.unpack(">I4s", data[start : start + 8])
        size = struct.unpack(">Q", data[start + 8 : start + 16])[0] if size == 1 else size
        found.append((start, start + size))
        if kind in INSIDE:
            found += boxes(data, start + 8, start + size)
        start += size
    return found


def mp4(rng, data, others):
    """An MP4 with a box's size, type or numbers changed, or a box left out or there twice."""
    start, end = rng.choice(boxes(data))
    what = rng.random()
    if what < 0.2:
        return mutate.put(data, start, mutate.number(rng, 4, end - start))
    if what < 0.3:
        other = rng.choice(boxes(data))[0]
        return mutate.put(data, start + 4, data[other + 4 : other + 8])
    if what < 0.4:
        return data[:start] + data[end:]
    if what < 0.45:
        return data[:end] + data[start:end] + data[end:]
    if what < 0.5:
        return mutate.put(data, start + 4, rng.choice((b"free", b"skip", b"moof", b"\0\0\0\0")))
    at = start + 8 + 4 * rng.randrange(max((end - start - 8) // 4, 1))
    return mutate.put(data, at, mutate.number(rng, rng.choice((1, 4, 4, 4, 8))))


@cache
def elements(data):
    """Places of all elements of a WebM: [(where its content starts, its size)]."""
    from bakery.formats import webm

    return [(at, size) for _, at, size in webm.elements(io.BytesIO(data))]


def ebml(rng, data, others):
    """A WebM with an element's size, name or content changed, or an element left out."""
    at, size = rng.choice(elements(data))
    what = rng.random()
    if what < 0.3:  # sizes are written in eight bytes
        return mutate.put(data, at - 8, b"\x01" + mutate.number(rng, 7, size))
    if what < 0.4:
        return mutate.put(
            data, at - 8, rng.choice((b"\xff", b"\x01" + b"\xff" * 7, b"\0" * 8, b"\x80"))
        )
    if what < 0.5:
        return mutate.put(
            data, max(at - rng.choice((9, 10, 12)), 0), rng.randbytes(rng.choice((1, 4)))
        )
    if what < 0.6:
        return data[:at] + data[at + size :]
    if what < 0.7:
        return data[:at] + data[at : at + size] * 2 + data[at + size :]
    inside = at + rng.randrange(max(min(size, 12), 1))
    return mutate.put(data, inside, mutate.number(rng, rng.choice((1, 1, 2, 4, 8))))


def video(rng, data, others):
    return (ebml if data.startswith(b"\x1aE\xdf\xa3") else mp4)(rng, data, others)


# --- pictures ---


@cache
def chunks(data):
    """Places of a PNG's chunks or a JPEG's segments: [(start, end)]."""
    found = []
    if data.startswith(b"\x89PNG"):
        at = 8
        while at + 8 <= len(data):
            end = at + 12 + struct.unpack(">I", data[at : at + 4])[0]
            found.append((at, end))
            at = end
    elif data.startswith(b"\xff\xd8"):
        at = 2
        while data[at] == 0xFF and data[at + 1] != 0xD9:
            end = at + 2 + struct.unpack(">H", data[at + 2 : at + 4])[0]
            found.append((at, end))
            if data[at + 1] == 0xDA:
                end = next(n for n in range(end, len(data)) if data[n] == 0xFF and data[n + 1])
            at = end
    return found


def picture(rng, data, others):
    """A PNG, JPEG or other picture with a piece of its header changed."""
    pieces = chunks(data)
    if not pieces:  # TIFF, GIF, WebP ...: the header is in the first bytes, or the last
        at = rng.choice(
            (rng.randrange(64), rng.randrange(len(data)), -rng.randrange(4, 200) % len(data))
        )
        return mutate.put(data, at, mutate.number(rng, rng.choice((1, 2, 4)), 96))
    start, end = rng.choice(pieces)
    what = rng.random()
    if what < 0.1:
        return data[:start] + data[end:]
    if what < 0.2:
        return data[:end] + data[start:end] * rng.choice((1, 2, 99)) + data[end:]
    png = data.startswith(b"\x89PNG")
    if what < 0.3:
        return mutate.put(data, start + (0 if png else 2), mutate.number(rng, 4 if png else 2))
    head = start + (8 if png else 4)
    at = head + rng.randrange(max(min(end - head, 200), 1))
    out = mutate.put(data, at, mutate.number(rng, rng.choice((1, 1, 2, 4)), 96))
    if png and end - 4 > start + 4:  # as if it were meant: with the right sum
        out = mutate.put(out, end - 4, zlib.crc32(out[start + 4 : end - 4]).to_bytes(4, "big"))
    return out
