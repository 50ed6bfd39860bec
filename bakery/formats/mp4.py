"""MP4 files (ISO/IEC 14496-12): find the samples of tracks, write tracks into one file.

OpenCV encodes pictures but carries no sound, writes no notes and cannot go on after an interruption;
this joins what it encoded in parts with the sound of another file, without decoding either.
"""

import os
import struct
from dataclasses import dataclass, replace

import numpy as np

from bakery.errors import InputError

LARGEST_INDEX = 64 * 2**20  # bytes of a `moov` box; an hour of video and sound has about 3 MB
CHUNK = 0.5  # seconds of one track in a row
XMP = bytes.fromhex("be7acfcb97a942e89c71999491e3afac")  # Adobe's box of XMP metadata
MATRIX = struct.pack(">9i", 0x10000, 0, 0, 0, 0x10000, 0, 0, 0, 0x40000000)
INSIDE = {b"moov", b"trak", b"mdia", b"minf", b"stbl", b"edts", b"wave"}
SOUND = {b"mp4a", b"Opus", b"alac", b"ac-3", b".mp3", b"fLaC"}


@dataclass(frozen=True)
class Track:
    """One stream: how it is coded, and where its samples stand in which files."""

    kind: str  # "vide" or "soun"
    entry: bytes  # its sample description: the box that says codec and format
    timescale: int  # units a second
    durations: np.ndarray  # [n] int64 units
    places: list  # n times (path, offset, bytes)
    sync: np.ndarray  # [n] bool: can be decoded without the ones before
    skip: float = 0.0  # seconds at the start that are decoded but not shown

    @property
    def seconds(self):
        return float(self.durations.sum()) / self.timescale


def boxes(data, start=0, end=None):
    """(type, start, end) of the boxes in bytes; start and end of what is in them.

    Raises:
        ValueError: damaged.
    """
    end = len(data) if end is None else end
    while start + 8 <= end:
        size, kind = struct.unpack(">I4s", data[start : start + 8])
        body = start + 8
        if size == 1:
            size, body = struct.unpack(">Q", data[body : body + 8])[0], body + 8
        elif size == 0:
            size = end - start
        if size < body - start or start + size > end:
            raise ValueError("a box reaches out of its place")
        yield kind, body, start + size
        start += size


def find(data, path, start=0, end=None):
    """(start, end) of every box at a path of types, as (b"moov", b"trak")."""
    for kind, low, high in boxes(data, start, end):
        if kind == path[0]:
            if len(path) == 1:
                yield low, high
            else:
                yield from find(data, path[1:], low, high)


def is_mp4(path):
    """Whether a file starts like MP4 or QuickTime."""
    with open(path, "rb") as file:
        return file.read(12)[4:8] in (b"ftyp", b"moov", b"wide", b"mdat", b"free")


def read_tracks(path: str | os.PathLike) -> list[Track]:
    """The tracks of an MP4 or QuickTime file.

    Raises:
        InputError: damaged, truncated, or in fragments.
    """
    tracks = _indexed(path)
    for track in tracks:
        _check_whole(path, track)
    return tracks


def check_frames(path: str | os.PathLike) -> None:
    """Refuse a video that was cut off, for those who decode it by other means.

    Raises:
        InputError: frames that the index names lie behind the end of the file.
    """
    try:
        tracks = _indexed(path)
    except InputError:  # of a kind that is not read here; a decoder may know it
        return
    for track in tracks:
        if track.kind == "vide":
            _check_whole(path, track)


def _check_whole(path, track):
    end = os.path.getsize(path)
    held = sum(0 <= offset <= end - size for _, offset, size in track.places)
    if held < len(track.places):
        what = "frames" if track.kind == "vide" else "pieces of sound"
        raise InputError(
            f"{path}: a truncated MP4: {held} of the {len(track.places)} {what} that its index names; "
            "copy or download it again"
        )


def _indexed(path):
    try:
        data = _index(path)
        tracks = [_track(path, data, *place) for place in find(data, (b"trak",))]
    except (ValueError, struct.error, IndexError, StopIteration) as error:
        raise InputError(f"{path}: a damaged MP4 ({error}); copy or download it again") from None
    return [track for track in tracks if track is not None]


def file_boxes(file):
    """(type, start, bytes of its header, bytes of all) of the boxes of an open file, by their headers.

    The last may reach beyond the file, or be shorter than its header; a cut one is a struct.error.
    """
    whole, at = os.fstat(file.fileno()).st_size, 0
    while at + 8 <= whole:
        file.seek(at)
        head = file.read(16)
        (size, kind), header = struct.unpack(">I4s", head[:8]), 8
        if size == 1:
            size, header = struct.unpack(">Q", head[8:16])[0], 16
        size = whole - at if size == 0 else size
        yield kind, at, header, size
        if size < header:
            return
        at += size


def _index(path):
    """What is in the `moov` box of a file; the pictures themselves are not read."""
    whole = os.path.getsize(path)
    with open(path, "rb") as file:
        for kind, at, header, size in file_boxes(file):
            if size < header or at + size > whole:
                raise ValueError("truncated")
            if kind == b"moov":
                if size > LARGEST_INDEX:
                    raise ValueError("its index is too large")
                file.seek(at + header)
                return file.read(size - header)
    raise ValueError("it has no index")


def _track(path, data, start, end):
    low, _ = next(find(data, (b"mdia", b"hdlr"), start, end))
    kind = data[low + 8 : low + 12].decode("latin-1")
    if kind not in ("vide", "soun"):
        return None
    low, _ = next(find(data, (b"mdia", b"mdhd"), start, end))
    timescale = struct.unpack(">I", data[low + (20 if data[low] == 1 else 12) :][:4])[0]
    tables = next(find(data, (b"mdia", b"minf", b"stbl"), start, end))

    def table(name, form):
        for low, high in find(data, (name,), *tables):
            count = struct.unpack(">I", data[low + 4 : low + 8])[0]
            dtype = np.dtype(form)
            if count * dtype.itemsize > high - low - 8:
                raise ValueError("a table is too short")
            return np.frombuffer(data, dtype, count, low + 8)
        return np.zeros(0, np.dtype(form))

    low, high = next(find(data, (b"stsd",), *tables))
    size = struct.unpack(">I", data[low + 8 : low + 12])[0]
    entry = data[low + 8 : low + 8 + size]
    low, high = next(find(data, (b"stsz",), *tables))
    common, count = struct.unpack(">II", data[low + 4 : low + 12])
    if (4 * count > high - low - 12) if not common else (common * count > os.path.getsize(path)):
        raise ValueError("it has more samples than bytes")
    sizes = np.full(count, common) if common else np.frombuffer(data, ">u4", count, low + 12)
    sizes = sizes.astype(np.int64)
    steps = table(b"stts", [("count", ">u4"), ("delta", ">u4")])
    if steps["count"].sum() != count or not timescale:
        raise ValueError("its times are not those of its samples")
    if len(chunks := np.concatenate([table(b"stco", ">u4"), table(b"co64", ">u8")])) > count:
        raise ValueError("it has more chunks than samples")
    durations = np.repeat(steps["delta"].astype(np.int64), steps["count"])
    offsets = _offsets(chunks.astype(np.int64), table(b"stsc", [(n, ">u4") for n in "abc"]), sizes)
    sync = np.ones(count, bool)
    keys = table(b"stss", ">u4").astype(np.int64)
    if len(keys):
        sync[:] = False
        sync[keys[(keys > 0) & (keys <= count)] - 1] = True
    places = [(path, int(offset), int(size)) for offset, size in zip(offsets, sizes)]
    skip = _skipped(data, start, end) / timescale
    return Track(kind, _plain_sound(entry), timescale, durations, places, sync, skip)


def _offsets(chunks, runs, sizes):
    """Where each sample stands in the file [n], by chunk offsets and the runs of chunks."""
    if not len(sizes):
        return sizes
    if not len(runs) or not len(chunks):
        raise ValueError("it has no chunks")
    edges = np.append(runs["a"], len(chunks) + 1).astype(np.int64)
    if edges[0] != 1 or (np.diff(edges) < 0).any():
        raise ValueError("its chunks are out of order")
    per_chunk = np.repeat(runs["b"].astype(np.int64), np.diff(edges))
    if len(per_chunk) != len(chunks) or per_chunk.sum() < len(sizes):
        raise ValueError("its chunks are not those of its samples")
    # A damaged count must not ask for gigabytes: no chunk holds more than all samples.
    per_chunk = np.minimum(per_chunk, len(sizes))
    chunk = np.searchsorted(np.cumsum(per_chunk), np.arange(len(sizes)), side="right")
    before = np.cumsum(sizes) - sizes
    first = np.searchsorted(chunk, chunk)  # first sample of the same chunk
    return chunks[chunk] + before - before[first]


def _skipped(data, start, end):
    """Units that the edit list leaves out at the start, as encoders of sound need."""
    for low, high in find(data, (b"edts", b"elst"), start, end):
        form, size = (">QqI", 20) if data[low] == 1 else (">IiI", 12)
        for at in range(low + 8, high - size + 1, size):
            _, media, _ = struct.unpack(form, data[at : at + size])
            if media >= 0:
                return media
    return 0


def _plain_sound(entry):
    """A sound description as MP4 has it; QuickTime wraps that of AAC once more."""
    version = struct.unpack(">H", entry[16:18])[0] if len(entry) > 36 else 0
    if entry[4:8] != b"mp4a" or version == 0:
        return entry
    at = entry.find(b"esds")
    if at < 4:
        raise ValueError("its sound is not described")
    size = struct.unpack(">I", entry[at - 4 : at])[0]
    plain = entry[8:16] + bytes(8) + entry[24:28] + bytes(4) + entry[32:36]
    return box(b"mp4a", plain + entry[at - 4 : at - 4 + size])


def box(kind, *parts):
    """A box of bytes."""
    body = b"".join(parts)
    return struct.pack(">I4s", len(body) + 8, kind) + body


def full(kind, *parts, version=0, flags=0):
    """A box with version and flags."""
    return box(kind, struct.pack(">I", version << 24 | flags), *parts)


def joined(tracks):
    """One track of several that are coded alike, one after the other."""
    first = tracks[0]
    return replace(
        first,
        durations=np.concatenate([track.durations for track in tracks]),
        places=[place for track in tracks for place in track.places],
        sync=np.concatenate([track.sync for track in tracks]),
    )


def cut(track, start, end):
    """The samples of a track that begin between two times, seconds; and what they come late, seconds."""
    times = np.cumsum(track.durations) - track.durations
    begin = start + track.skip
    kept = np.flatnonzero(
        (times + track.durations > begin * track.timescale)
        & (times < (end + track.skip) * track.timescale)
    )
    late = times[kept[0]] / track.timescale - begin if len(kept) else 0.0
    return replace(
        track,
        durations=track.durations[kept],
        places=[track.places[n] for n in kept],
        sync=track.sync[kept],
        skip=max(-late, 0.0),
    ), max(late, 0.0)


def beginning(brand: bytes) -> bytes:
    """The first box of a file of a brand, as `write_mp4` writes it."""
    return box(b"ftyp", brand, struct.pack(">I", 512), brand + b"iso2mp41")


def write_mp4(file, tracks, size, note, xmp, delays=None, brand=b"isom"):
    """Write tracks into one file, index first, so that it plays while it loads.

    Args:
        file: open for writing bytes.
        tracks: Tracks, the video first.
        size: (width, height) pixels of the video.
        note: text that players show as comment.
        xmp: XMP packet, text.
        delays: seconds at which each track begins, 0 without.
        brand: what the file says it is, four letters.
    """
    delays = delays or [0.0] * len(tracks)
    order = _interleaved(tracks)
    lead = beginning(brand) + box(b"uuid", XMP, xmp.encode())
    blank = _moov(tracks, order, 0, size, note, delays)
    total = sum(place[2] for track in tracks for place in track.places)
    start = len(lead) + len(blank) + 16
    file.write(lead)
    file.write(_moov(tracks, order, start, size, note, delays))
    file.write(struct.pack(">I4sQ", 1, b"mdat", total + 16))
    source, name = None, None
    try:
        for number, first, last in order:
            for path, offset, length in tracks[number].places[first:last]:
                if path != name:
                    if source is not None:
                        source.close()
                    source, name = open(path, "rb"), path
                source.seek(offset)
                data = source.read(length)
                if len(data) != length:
                    raise InputError(f"{path}: changed while it was read; start again")
                file.write(data)
    finally:
        if source is not None:
            source.close()


def _interleaved(tracks):
    """Chunks in the order of the file: (track, first sample, one behind the last)."""
    chunks = []
    for number, track in enumerate(tracks):
        times = (np.cumsum(track.durations) - track.durations) / track.timescale
        slot = (times / CHUNK).astype(int)
        edges = np.flatnonzero(np.diff(slot)) + 1
        for first, last in zip([0, *edges], [*edges, len(slot)]):
            if last > first:
                chunks.append((slot[first], number, int(first), int(last)))
    return [chunk[1:] for chunk in sorted(chunks)]


def _moov(tracks, order, start, size, note, delays):
    timescale = 1000
    lengths = [round((track.seconds - track.skip) * timescale) for track in tracks]
    total = max(length + round(delay * timescale) for length, delay in zip(lengths, delays))
    parts = [
        full(
            b"mvhd", struct.pack(">IIIIIHHQ", 0, 0, timescale, total, 0x10000, 0x100, 0, 0),
            MATRIX, bytes(24), struct.pack(">I", len(tracks) + 1),
        )
    ]  # fmt: skip
    offsets = [[] for _ in tracks]
    for number, first, last in order:
        offsets[number].append((start, last - first))
        start += sum(place[2] for place in tracks[number].places[first:last])
    for number, track in enumerate(tracks):
        parts.append(_trak(number, track, offsets[number], lengths[number], size, delays[number]))
    text = struct.pack(">II", 1, 0) + note.encode()
    tags = box(b"ilst", box(b"\xa9cmt", box(b"data", text)))
    handler = full(b"hdlr", bytes(4), b"mdirappl", bytes(9))
    parts.append(box(b"udta", full(b"meta", handler, tags)))
    return box(b"moov", *parts)


def _trak(number, track, chunks, length, size, delay):
    video = track.kind == "vide"
    width, height = size if video else (0, 0)
    lead = round(delay * 1000)
    edits = [struct.pack(">IiHH", lead, -1, 1, 0)] if lead else []
    edits.append(struct.pack(">IiHH", length, round(track.skip * track.timescale), 1, 0))
    header = full(
        b"tkhd", struct.pack(">IIIIIQHHHH", 0, 0, number + 1, 0, length + lead, 0, 0, 0,
                             0 if video else 0x100, 0),
        MATRIX, struct.pack(">II", width << 16, height << 16), flags=3,
    )  # fmt: skip
    units = int(track.durations.sum())
    media = full(b"mdhd", struct.pack(">IIIIHH", 0, 0, track.timescale, units, 0x55C4, 0))
    handler = full(b"hdlr", bytes(4), track.kind.encode(), bytes(13))
    kind = full(b"vmhd", bytes(8), flags=1) if video else full(b"smhd", bytes(4))
    here = box(b"dinf", full(b"dref", struct.pack(">I", 1), full(b"url ", flags=1)))
    sizes = np.array([place[2] for place in track.places], ">u4")
    edges = np.flatnonzero(np.diff(track.durations, prepend=-1))
    runs = np.diff(np.append(edges, len(track.durations)))
    steps = np.stack([runs, track.durations[edges]], 1).astype(">u4")
    groups = np.array([[n, count, 1] for n, (_, count) in enumerate(chunks, 1)], ">u4")
    tables = [
        full(b"stsd", struct.pack(">I", 1), track.entry),
        full(b"stts", struct.pack(">I", len(steps)), steps.tobytes()),
        full(b"stsc", struct.pack(">I", len(groups)), groups.tobytes()),
        full(b"stsz", struct.pack(">II", 0, len(sizes)), sizes.tobytes()),
        full(b"co64", struct.pack(">I", len(chunks)), np.array([c[0] for c in chunks], ">u8").tobytes()),
    ]  # fmt: skip
    if not track.sync.all():
        keys = np.flatnonzero(track.sync) + 1
        tables.append(full(b"stss", struct.pack(">I", len(keys)), keys.astype(">u4").tobytes()))
    minf = box(b"minf", kind, here, box(b"stbl", *tables))
    return box(
        b"trak", header, box(b"edts", full(b"elst", struct.pack(">I", len(edits)), *edits)),
        box(b"mdia", media, handler, minf),
    )  # fmt: skip
