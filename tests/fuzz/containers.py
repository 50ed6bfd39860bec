"""Changes of files that know the format: zip and npy, EXR, glTF; `media` has clips and pictures.

Each takes (rng, data, others) and returns bytes, like those of `mutate`. `data` is a valid file; what
is known of it is computed once.
"""

import io
import random
import struct
import zipfile
import zlib
from functools import cache

import mutate
import numpy as np

BOMB = 3 << 30  # bytes that a few megabytes of deflated zeros unpack to


# --- npz ---

DTYPES = (
    "<f4",
    ">f8",
    "|O",
    "<U3",
    "<U100000000",
    "|S0",
    "|V8",
    "<c16",
    "|b1",
    "<i8",
    "<M8[s]",
    "<f2",
)
DTYPES += (
    "{'names': ['a'], 'formats': ['<f4'], 'offsets': [2147483647]}",
    "[('a', '<f4')]",
    "f4, (9,)i8",
)
SHAPES = (
    "()",
    "(0,)",
    "(1,)",
    "(-1,)",
    "(-3, -3)",
    "(2**31,)",
    "(1 << 40,)",
    "(40000, 40000)",
    "(1,) * 40",
)
SHAPES += (
    "(99999999999999999999,)",
    "(3.0,)",
    "('a',)",
    "None",
    "5",
    "(16, 16)",
    "(52,)",
    "(1, 2, 3, 4)",
)
HEADERS = (
    "{}",
    "[]",
    "{'descr': '<f4'}",
    "__import__('os')",
    "(" * 500,
    "{'descr': '<f4', 'x': 1}",
    "\0",
)


@cache
def arrays(data):
    """The entries of an npz: [(name, npy bytes)]."""
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        return [(name, archive.read(name)) for name in archive.namelist()]


def npy(header, body, version=(1, 0), length=None):
    """An npy file with any text for its header."""
    text = header.encode("latin-1", "replace")
    size = struct.pack("<H" if version == (1, 0) else "<I", (length or len(text)) % 65536)
    return b"\x93NUMPY" + bytes(version) + size + text + body


def npy_header(rng, content):
    """An npy whose header promises something else."""
    start = 10 + struct.unpack("<H", content[8:10])[0]
    header, body = content[10:start].decode("latin-1"), content[start:]
    what = rng.random()
    if what < 0.4:
        left, right = header.index("'shape':") + 8, header.rindex("}")
        header = header[:left] + rng.choice(SHAPES) + header[right:]
    elif what < 0.7:
        dtype = rng.choice(DTYPES)
        end = header.index(", 'fortran_order'")
        header = "{'descr': " + (dtype if dtype[0] in "[{" else f"'{dtype}'") + header[end:]
    elif what < 0.8:
        header = header.replace("False", rng.choice(("True", "None", "1", "'a'")))
    elif what < 0.9:
        header = rng.choice(HEADERS)
    else:
        version = rng.choice(((1, 0), (2, 0), (3, 0), (9, 9), (0, 0)))
        return npy(header, body, version, rng.choice((None, 0, 1, 65535)))
    return npy(header, body)


def other_array(rng, content):
    """Another array in an array's place: type, shape or values."""
    array = np.load(io.BytesIO(content), allow_pickle=False)
    what = rng.randrange(9)
    numeric = array.dtype.kind in "fiu"
    if what == 0:
        array = (
            array.astype(rng.choice(("f8", "i8", "u1", "c8", "b1"))) if numeric else np.arange(3)
        )
    elif what == 1:
        array = array.reshape(-1)[: rng.randrange(array.size + 1)]
    elif what == 2:
        array = array[None]
    elif what == 3:
        array = np.array(rng.choice(("", "x", 1.5, -1, True, "\u202e")))
    elif what == 4 and numeric and array.size:
        array = array.copy()
        limits = (
            (np.inf, -np.inf, np.nan, 6e4, -1.0)
            if array.dtype.kind == "f"
            else (-1, 255, 2**31 - 1)
        )
        array.flat[rng.randrange(array.size)] = np.array(rng.choice(limits)).astype(array.dtype)
    elif what == 5 and array.size:
        array = np.concatenate([array.reshape(-1), array.reshape(-1)])
    elif what == 6:
        array = np.zeros((0,) + array.shape[1:], array.dtype)
    elif what == 7:
        array = np.array(["a", "b", "\ud800"[:0]])
    elif array.ndim > 1:
        array = np.swapaxes(array, 0, -1)
    out = io.BytesIO()
    np.lib.format.write_array(out, array, allow_pickle=False)
    return out.getvalue()


def zip_of(rng, entries):
    """Entries as a zip, stored or deflated."""
    out = io.BytesIO()
    method = rng.choice((zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED))
    with zipfile.ZipFile(out, "w", method, compresslevel=1) as archive:
        for name, content in entries:
            archive.writestr(zipfile.ZipInfo(name), content, method)
    return out.getvalue()


def npz_entry(rng, data, others):
    """An npz with one array changed, left out, renamed, or there twice."""
    entries = list(arrays(data))
    at, what = rng.randrange(len(entries)), rng.random()
    name, content = entries[at]
    if what < 0.4:
        entries[at] = name, npy_header(rng, content)
    elif what < 0.75:
        entries[at] = name, other_array(rng, content)
    elif what < 0.8:
        del entries[at]
    elif what < 0.85:
        entries.append(
            (rng.choice((name, "x.npy", "../x.npy", "x", "", "a/b.npy", "\u202e.npy")), content)
        )
    elif what < 0.9:
        entries[at] = name, rng.choice((b"", b"\x93NUMPY", content[:9], rng.randbytes(50)))
    else:
        entries[at] = name, mutate.any_bytes(rng, content, [content])
    import warnings

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of the duplicate name
        return zip_of(rng, entries)


ZIP_FIELDS = {  # record: (offset, bytes) of its numbers
    b"PK\x03\x04": ((4, 2), (6, 2), (8, 2), (10, 4), (14, 4), (18, 4), (22, 4), (26, 2), (28, 2)),
    b"PK\x01\x02": (
        (6, 2),
        (8, 2),
        (10, 2),
        (16, 4),
        (20, 4),
        (24, 4),
        (28, 2),
        (30, 2),
        (32, 2),
        (42, 4),
    ),
    b"PK\x05\x06": ((4, 2), (8, 2), (10, 2), (12, 4), (16, 4), (20, 2)),
}


def zip_field(rng, data, others):
    """A number of a zip's records changed: method, encryption, sizes, names, places."""
    kind = rng.choice(list(ZIP_FIELDS))
    places = [n for n in range(len(data) - 22) if data.startswith(kind, n)] or [0]
    offset, size = rng.choice(ZIP_FIELDS[kind])
    at = rng.choice(places) + offset
    near = int.from_bytes(data[at : at + size], "little")
    return mutate.put(data, at, mutate.number(rng, size, near))


@cache
def _zeros():
    """Deflated zeros, a megabyte of them, as a piece that can be repeated."""
    packer = zlib.compressobj(9, zlib.DEFLATED, -15)
    return packer.compress(bytes(1 << 20)) + packer.flush(zlib.Z_FULL_FLUSH)


def npz_bomb(rng, data, others):
    """An array of gigabytes in a file of megabytes; the directory owns up to it or lies."""
    name, content = rng.choice(arrays(data))
    header = npy(f"{{'descr': '|u1', 'fortran_order': False, 'shape': ({BOMB},), }}", b"")
    stream = zlib.compressobj(1, zlib.DEFLATED, -15)
    body = stream.compress(header) + stream.flush(zlib.Z_FULL_FLUSH)
    body += _zeros() * (BOMB >> 20) + b"\x03\0"
    told = rng.choice((BOMB + len(header), len(header) + 100, len(content)))
    about = struct.pack("<HHHHIII", 0, 8, 0, 33, 0, len(body), told & 0xFFFFFFFF)
    name = name.encode()
    out = (
        b"PK\x03\x04"
        + struct.pack("<H", 20)
        + about
        + struct.pack("<HH", len(name), 0)
        + name
        + body
    )
    directory = b"PK\x01\x02" + struct.pack("<HH", 20, 20) + about
    directory += struct.pack("<HHHHHII", len(name), 0, 0, 0, 0, 0, 0) + name
    end = struct.pack("<HHHHIIH", 0, 0, 1, 1, len(directory), len(out), 0)
    return out + directory + b"PK\x05\x06" + end


def npz(rng, data, others):
    what = rng.random()
    if what < 0.001:
        return npz_bomb(rng, data, others)
    return (npz_entry if what < 0.7 else zip_field)(rng, data, others)


# --- EXR ---

TYPES = (
    b"int",
    b"float",
    b"string",
    b"box2i",
    b"chlist",
    b"compression",
    b"lineOrder",
    b"v2f",
    b"preview",
)
TYPES += (
    b"tiledesc",
    b"timecode",
    b"bytes",
    b"double",
    b"stringvector",
    b"m44f",
    b"deepImageState",
    b"x" * 300,
)


@cache
def attributes(data):
    """The attributes of an EXR's headers: [(start, value's start, end)]."""
    found, at = [], 8
    while data[at]:
        while data[at]:
            start = at
            at = data.index(0, data.index(0, at) + 1) + 1
            size = struct.unpack("<i", data[at : at + 4])[0]
            found.append((start, at + 4, at + 4 + size))
            at += 4 + size
        at += 1
        if not data[4:8][1] & 0x10:  # one part: its header is not followed by another
            break
    return found, at


def exr(rng, data, others):
    """An EXR with an attribute, its channels, its flags or its table of places changed."""
    found, end = attributes(data)
    start, value, after = rng.choice(found)
    what = rng.random()
    if what < 0.3:
        at = value + 4 * rng.randrange(max((after - value) // 4, 1))
        return mutate.put(data, at, mutate.number(rng, 4))
    if what < 0.4:
        return mutate.put(data, value - 4, mutate.number(rng, 4, after - value))
    if what < 0.5:
        name, kind = data[start : value - 4].split(b"\0")[:2]
        if rng.random() < 0.5:
            kind = rng.choice(TYPES)
        else:
            name = rng.choice(
                (b"name", b"type", b"tiles", b"chunkCount", b"version", b"y" * 300, b"\xff\xfe")
            )
        return data[:start] + name + b"\0" + kind + b"\0" + data[value - 4 :]
    if what < 0.58:
        return data[:start] + data[after:]
    if what < 0.66:
        return data[:start] + data[start:after] * rng.choice((2, 3, 50)) + data[after:]
    if what < 0.74:
        return _channels(rng, data, found)
    if what < 0.8:
        return mutate.put(data, 4, bytes([2, rng.choice((0, 2, 4, 8, 16, 24, 0x1E)), 0, 0]))
    at = end + 8 * rng.randrange(max((len(data) - end) // 8, 1))
    if what < 0.9:  # places of the lines, their numbers and sizes
        return mutate.put(data, at, mutate.number(rng, rng.choice((4, 8)), len(data)))
    window = next(place for place in found if data[place[0] :].startswith(b"dataWindow"))
    corners = [rng.choice((0, 1, -1, 15, 99, 16383, 16384, 2**31 - 1, -(2**31))) for _ in range(4)]
    return mutate.put(data, window[1], struct.pack("<4i", *corners))


def _channels(rng, data, found):
    """More channels, other sample types and steps; the data stay as they are."""
    start, value, after = next(p for p in found if data[p[0] :].startswith(b"channels"))
    count = rng.choice((0, 1, 2, 3, 200, 2000))
    kind, step = rng.choice((0, 1, 2, 3, 99)), rng.choice((1, 1, 1, 0, 2, -1, 1000))
    one = struct.pack("<IB3xii", kind, rng.randrange(2), step, step)
    names = rng.choice(
        (("R", "G", "B"), ("Y",), [f"c{n:04d}" for n in range(count)], ("", "a.b", "\x01"))
    )
    table = b"".join(name.encode() + b"\0" + one for name in names) + b"\0"
    return data[: value - 4] + struct.pack("<i", len(table)) + table + data[after:]


# --- glTF ---


@cache
def _gltf(data):
    length = struct.unpack("<I", data[12:16])[0]
    text = data[20 : 20 + length]
    return text, mutate.tree(text), data[20 + length :]


def glb(rng, data, others):
    """A GLB with its description, its chunks or its header changed."""
    if rng.random() < 0.2:
        at = 4 * rng.randrange(5)
        return mutate.put(
            data, at, mutate.number(rng, 4, int.from_bytes(data[at : at + 4], "little"))
        )
    text, root, rest = _gltf(data)
    for _ in range(rng.choice((1, 1, 1, 2))):
        text, root = mutate.json_value(rng, text, root), root
        break
    text += b" " * (-len(text) % 4)
    if rng.random() < 0.05:
        rest = rng.choice((b"", rest[:8], rest + rest, rest[: len(rest) // 2]))
    size = 20 + len(text) + len(rest)
    return b"glTF" + struct.pack("<III4s", 2, size, len(text), b"JSON") + text + rest


def generator(seed):
    """The random numbers of one case."""
    return random.Random(seed)
