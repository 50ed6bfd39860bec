"""WebM files (Matroska's EBML): find the blocks of a sound track, write VP8 or VP9 and
sound into one file."""

import io
import struct
from dataclasses import dataclass

import numpy as np

from bakery.errors import InputError

UNKNOWN = -1  # size of an element that lasts until another of its level begins
SEGMENT, CLUSTER, TRACKS, INFO = 0x18538067, 0x1F43B675, 0x1654AE6B, 0x1549A966
ENTRY, TIME, SIMPLE, GROUP, BLOCK = 0xAE, 0xE7, 0xA3, 0xA0, 0xA1
INSIDE = {SEGMENT, CLUSTER, TRACKS, INFO, ENTRY, GROUP, 0xE1}
SOUND = ("A_OPUS", "A_VORBIS")  # what WebM may hold
LARGEST = 16 * 2**20  # bytes of a track's description
LONGEST = 64  # bytes of a number or a codec's name
STEP = 5.0  # seconds of a cluster, at most


@dataclass(frozen=True)
class Blocks:
    """One track: what describes it, and where its frames stand."""

    codec: str
    entry: bytes  # the rest of its description, as it stands in the file
    seconds: np.ndarray  # [n] when each frame begins
    places: list  # n times (path, offset, bytes)
    sync: np.ndarray  # [n] bool


def is_webm(path):
    """Whether a file starts like WebM or Matroska."""
    with open(path, "rb") as file:
        return file.read(4) == b"\x1aE\xdf\xa3"


def _number(file, keep_mark):
    """An EBML variable-length integer."""
    first = file.read(1)
    if not first:
        raise EOFError
    length = 9 - first[0].bit_length()
    if length > 8:
        raise ValueError("a number is damaged")
    data = first + file.read(length - 1)
    if len(data) != length:
        raise EOFError
    value = int.from_bytes(data, "big")
    if keep_mark:
        return value
    value &= (1 << 7 * length) - 1
    return UNKNOWN if value == (1 << 7 * length) - 1 else value


def elements(file):
    """(id, offset, size) of all elements of a file; of containers the head, then what is in them."""
    end = file.seek(0, 2)
    file.seek(0)
    while True:
        try:
            kind, size = _number(file, True), _number(file, False)
        except EOFError:
            return
        at = file.tell()
        yield kind, at, size
        if kind in INSIDE:
            file.seek(at)
        elif size == UNKNOWN:
            raise ValueError("an element has no end")
        elif at + size > end:
            return
        else:
            file.seek(at + size)


def read_sound(path):
    """The first sound track of a WebM or Matroska file; None without one.

    Raises:
        InputError: damaged, or its sound is of another kind than Opus and Vorbis.
    """
    scale, cluster, entries, current = 1_000_000, 0, [], {}
    blocks = []
    try:
        with open(path, "rb") as file:
            for kind, at, size in elements(file):
                if kind == ENTRY:
                    current = {"at": at, "size": size}
                    entries.append(current)
                elif kind in (0xD7, 0x83, 0x86, 0x2AD7B1, TIME):
                    if not 0 <= size <= LONGEST:
                        raise ValueError("a number is damaged")
                    data = file.read(size)
                    value = int.from_bytes(data, "big")
                    if kind == 0x2AD7B1:
                        scale = value
                    elif kind == TIME:
                        cluster = value
                    else:
                        current[kind] = data if kind == 0x86 else value
                elif kind in (SIMPLE, BLOCK):
                    track = _number(file, False)
                    offset, flags = struct.unpack(">hB", file.read(3))
                    if flags & 6:
                        raise ValueError("laced blocks")
                    start = file.tell()
                    if start > at + size:
                        raise ValueError("a block is too short")
                    blocks.append((track, cluster + offset, start, at + size - start))
            end = file.seek(0, 2)
            sound = next((entry for entry in entries if entry.get(0x83) == 2), None)
            if sound is None:
                return None
            codec = sound[0x86].decode("latin-1")
            if codec not in SOUND:
                raise InputError(f"{path}: its sound is {codec[:20]!r}; WebM holds Opus or Vorbis")
            if not 0 <= sound["size"] <= min(LARGEST, end - sound["at"]):
                raise ValueError("its sound is not described")
            file.seek(sound["at"])
            entry, number = _stripped(file.read(sound["size"])), sound[0xD7]
    except (ValueError, KeyError, struct.error, EOFError) as error:
        raise InputError(f"{path}: a damaged WebM ({error}); copy or download it again") from None
    mine = [block for block in blocks if block[0] == number and block[2] + block[3] <= end]
    seconds = np.array([block[1] * scale / 1e9 for block in mine])
    places = [(path, block[2], block[3]) for block in mine]
    return Blocks(codec, entry, seconds, places, np.ones(len(mine), bool))


def _stripped(entry):
    """A track's description without its numbers, which are given anew."""
    file, kept = io.BytesIO(entry), b""
    while True:
        start = file.tell()
        try:
            kind, size = _number(file, True), _number(file, False)
        except EOFError:
            return kept
        end = file.tell() + size
        if size < 0 or end > len(entry):
            raise ValueError("its sound is not described")
        if kind not in (0xD7, 0x73C5, 0x83, 0x86):
            kept += entry[start:end]
        file.seek(end)


# FourCC of IVF -> codec of WebM, and bits of a frame's first byte that key frames have at 0.
CODECS = {b"VP80": ("V_VP8", 0x01), b"VP90": ("V_VP9", 0x0C)}


def read_ivf(path):
    """The frames of a VP8 or VP9 file: Blocks at times counted in frames.

    Raises:
        ValueError: not such a file.
    """
    places, sync = [], []
    with open(path, "rb") as file:
        head = file.read(32)
        if head[:4] != b"DKIF" or head[8:12] not in CODECS:
            raise ValueError(f"{path}: not VP8 or VP9 in IVF")
        codec, between = CODECS[head[8:12]]
        while len(start := file.read(12)) == 12:
            size = struct.unpack("<I", start[:4])[0]
            at = file.tell()
            sync.append(file.read(1)[0] & between == 0)
            places.append((path, at, size))
            file.seek(at + size)
    return Blocks(codec, b"", np.arange(len(places), dtype=float), places, np.array(sync, bool))


def element(kind, *parts):
    """An EBML element of bytes."""
    body = b"".join(parts)
    return kind.to_bytes((kind.bit_length() + 7) // 8, "big") + _size(len(body)) + body


def _size(value):
    return (value | 1 << 56).to_bytes(8, "big")


def _integer(kind, value):
    return element(kind, int(value).to_bytes(max((int(value).bit_length() + 7) // 8, 1), "big"))


def _text(kind, value):
    return element(kind, value.encode())


def write_webm(file, video, sound, size, seconds, tags):
    """Write a video and, if given, a sound track.

    Args:
        file: open for writing bytes.
        video, sound: Blocks; sound may be None.
        size: (width, height) pixels.
        seconds: length of the video.
        tags: name -> text.
    """
    head = element(
        0x1A45DFA3, _integer(0x4286, 1), _integer(0x42F7, 1), _integer(0x42F2, 4),
        _integer(0x42F3, 8), _text(0x4282, "webm"), _integer(0x4287, 4), _integer(0x4285, 2),
    )  # fmt: skip
    info = element(
        INFO, _integer(0x2AD7B1, 1_000_000), element(0x4489, struct.pack(">d", seconds * 1000)),
        _text(0x4D80, "bakery"), _text(0x5741, "bakery"),
    )  # fmt: skip
    picture = element(0xE0, _integer(0xB0, size[0]), _integer(0xBA, size[1]))
    entries = [_entry(1, 1, video.codec, picture)]
    if sound is not None:
        entries.append(_entry(2, 2, sound.codec, sound.entry))
    notes = [
        element(0x67C8, _text(0x45A3, name), _text(0x4487, value)) for name, value in tags.items()
    ]
    tagged = element(0x1254C367, element(0x7373, element(0x63C0), *notes))
    file.write(head)
    body = info + element(TRACKS, *entries) + tagged
    clusters = list(_clusters([video] if sound is None else [video, sound]))
    cues, at = [], len(body)
    for time, blocks, length in clusters:
        if any(track == 1 for track, *_ in blocks):
            place = element(0xB7, _integer(0xF7, 1), _integer(0xF1, at))
            cues.append(element(0xBB, _integer(0xB3, time), place))
        at += length
    index = element(0x1C53BB6B, *cues)
    file.write(SEGMENT.to_bytes(4, "big") + _size(at + len(index)) + body)
    for time, blocks, length in clusters:
        content = length - 12
        file.write(CLUSTER.to_bytes(4, "big") + _size(content) + _stamp(time))
        for track, offset, key, (path, start, size) in blocks:
            file.write(b"\xa3" + _size(size + 4) + bytes([0x80 | track]))
            file.write(struct.pack(">hB", offset, 0x80 if key else 0))
            with open(path, "rb") as source:
                source.seek(start)
                data = source.read(size)
            if len(data) != size:
                raise InputError(f"{path}: changed while it was read; start again")
            file.write(data)
    file.write(index)


def _stamp(time):
    return element(TIME, int(time).to_bytes(8, "big"))


def _entry(number, kind, codec, rest):
    return element(
        ENTRY, _integer(0xD7, number), _integer(0x73C5, number), _integer(0x83, kind),
        _integer(0x9C, 0), _text(0x86, codec), rest,
    )  # fmt: skip


def _clusters(tracks):
    """(milliseconds, [(track, offset in milliseconds, sync, place)], bytes) in the order of the file.

    A cluster begins at a picture that can be decoded by itself, or where the offset would not fit.
    """
    blocks = sorted(
        (round(time * 1000), number, bool(key), place)
        for number, track in enumerate(tracks, 1)
        for time, key, place in zip(track.seconds, track.sync, track.places)
    )
    first, held, length = None, [], 0
    for time, number, key, place in blocks:
        new = first is None or time - first > 1000 * STEP or (number == 1 and key and held)
        if new and held:
            yield first, held, length
        if new:
            first, held, length = time, [], 12 + len(_stamp(0))
        held.append((number, time - first, key, place))
        length += 1 + 8 + 4 + place[2]
    if held:
        yield first, held, length
