"""C2PA manifest stores inside files: where they stand, and what they say. Nothing here checks a
signature (`formats.signing` does); it needs no other package.

A store is a tree of JUMBF boxes: a manifest a box, in each a claim, its assertions, its signature.
JPEG carries it in segments APP11, PNG in a chunk caBX, WebP in a chunk C2PA, MP4 in a box uuid.

Sources: C2PA, "Technical Specification" 2.2, sections 11 (manifests) and A.3 (embedding); ISO 19566-5,
"JPEG universal metadata box format".
"""

import hashlib
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass

from bakery.errors import InputError
from bakery.formats import cbor, mp4

STORE = b"jumdc2pa\x00\x11\x00\x10\x80\x00\x00\xaa\x00\x38\x9b\x71"  # how each store's description begins
IN_MP4 = bytes.fromhex("d8fec3d61b0e483c92975828877ec481")
# Boxes of MP4 that a C2PA hash leaves out; bakery writes none.
UNSIGNED = {b"free", b"skip", b"mfra"}
APP11, COMMON = b"\xff\xeb", b"JP"  # segment of JPEG, and what says that JUMBF is in it
INSTANCE = 0x0211  # number of the box in JPEG, as c2pa-rs writes it
SEGMENT = 60_000  # bytes of a store that stand in one segment of JPEG; bakery's have about 5,000
LARGEST = 64 * 2**20  # bytes of a store
DEEPEST = 8  # boxes within boxes
MANIFEST, CLAIM, SIGNATURE = "c2ma", "c2pa.claim", "c2pa.signature"
ACTIONS, HASH = "c2pa.actions", "c2pa.hash.data"


@dataclass(frozen=True)
class Box:
    """A box that holds others."""

    kind: str  # four letters of its type, such as c2ma
    label: str
    boxes: tuple["Box", ...]  # in it
    contents: tuple[bytes, ...]  # of the boxes in it that hold no others, without their headers


@dataclass(frozen=True)
class Said:
    """What a store says."""

    generator: str  # that made the active manifest: "Program 1.0", "" if it says nothing
    source_types: tuple[str, ...]  # digital source types of all its manifests, URLs, sorted
    sha256: str  # of its bytes


def find_store(data: bytes) -> bytes:
    """The C2PA manifest store that a file carries, b"" if there is none."""
    if data[:2] == b"\xff\xd8":
        return b"".join(_in_jpeg(data))[:LARGEST]
    at = data.find(STORE) - 12  # length and type of the store, length of its description
    if at < 0 or data[at + 4 : at + 8] != b"jumb":
        return b""
    (size,) = struct.unpack_from(">I", data, at)
    return data[at : at + size] if size <= LARGEST else b""


def _in_jpeg(data):
    """The pieces of a store, a segment each; all but the first repeat the box's header."""
    at, number = 2, 0
    while at + 4 <= len(data) and data[at] == 0xFF and data[at + 1] not in (0xDA, 0xD9):
        (size,) = struct.unpack_from(">H", data, at + 2)
        body = data[at + 4 : at + 2 + size]
        if data[at : at + 2] == APP11 and body[:2] == COMMON and len(body) > 16:
            first = STORE in body[:48]
            if first or number:
                yield body[8:] if first else body[16:]
                number += 1
        at += 2 + max(size, 2)


def read_store(store: bytes) -> Box:
    """The boxes of a store.

    Raises:
        InputError: damaged, or not as long as its boxes together.
    """
    boxes = list(_boxes(store, 0))
    if len(boxes) != 1 or not isinstance(boxes[0], Box):
        raise InputError("a damaged C2PA manifest; copy the file again")
    return boxes[0]


def _boxes(data: bytes, depth: int) -> Iterator[Box | bytes]:
    at = 0
    while at < len(data):
        size, name = struct.unpack_from(">I4s", data, at) if at + 8 <= len(data) else (0, b"")
        if size < 8 or at + size > len(data) or depth > DEEPEST:
            raise InputError("a damaged C2PA manifest; copy the file again")
        body = data[at + 8 : at + size]
        yield _box(body, depth) if name == b"jumb" else name + body
        at += size


def _box(body: bytes, depth: int) -> Box:
    first, *others = _boxes(body, depth + 1)
    if not isinstance(first, bytes) or first[:4] != b"jumd" or len(first) < 22:
        raise InputError("a damaged C2PA manifest; copy the file again")
    label = first[21:].split(b"\0")[0] if first[20] & 2 else b""
    return Box(
        first[4:8].decode("latin-1"),
        label.decode("utf-8", "replace"),
        tuple(one for one in others if isinstance(one, Box)),
        tuple(one[4:] for one in others if isinstance(one, bytes)),
    )


def said(store: bytes) -> Said:
    """What a store says about who made the file, and how; what cannot be read says nothing.

    Manifests may be packed (Brotli); of those only their hash is known.
    """
    digest = hashlib.sha256(store).hexdigest()
    try:
        manifests = [box for box in read_store(store).boxes if box.kind == MANIFEST]
        types = {url for one in manifests for url in _source_types(one)}
        generator = _generator(manifests[-1]) if manifests else ""
        return Said(generator, tuple(sorted(types)), digest)
    except (InputError, cbor.CborError):
        return Said("", (), digest)


def _assertions(manifest: Box, label: str) -> Iterator[dict]:
    """The tables of the assertions with a label, in any of its versions."""
    for box in manifest.boxes:
        for one in (box, *box.boxes):
            if one.label == label or one.label.startswith((f"{label}.v", f"{label}__")):
                table = cbor.loads(one.contents[0]) if one.contents else {}
                yield table if isinstance(table, dict) else {}


def _generator(manifest):
    for claim in _assertions(manifest, CLAIM):
        info = claim.get("claim_generator_info")
        info = info[0] if isinstance(info, list) and info else info
        if isinstance(info, dict) and info.get("name"):
            return f"{info['name']} {info.get('version', '')}".strip()
        return str(claim.get("claim_generator", ""))
    return ""


def _source_types(manifest):
    for table in _assertions(manifest, ACTIONS):
        actions = table.get("actions")
        for action in actions if isinstance(actions, list) else ():
            found = action.get("digitalSourceType") if isinstance(action, dict) else None
            if isinstance(found, str):
                yield found


def signed_digest(store: bytes) -> str:
    """The SHA-256 that the active manifest gives of the bytes it is about, "" if it gives none.

    It is that of the whole file where the store stands beside it.
    """
    try:
        manifest = [box for box in read_store(store).boxes if box.kind == MANIFEST][-1:]
        tables = [table for one in manifest for table in _assertions(one, HASH)]
    except (InputError, cbor.CborError):
        return ""
    found = tables[0].get("hash") if tables else None
    return found.hex() if isinstance(found, bytes) else ""


def is_loose(store: bytes, file: bytes = b"") -> bool:
    """Whether bytes could change that no signature covers: lengths of boxes, padding, framing.

    c2pa-rs passes over 1,005 of the 3,004 bytes of a store. What bakery signs has none of them free.

    Args:
        store: of a file that bakery signed.
        file: its bytes; none for a store that stands beside it.
    """
    try:
        for manifest in read_store(store).boxes:
            for box in manifest.boxes:
                if box.label == SIGNATURE and any(_padding(cbor.loads(box.contents[0]))):
                    return True
    except (InputError, cbor.CborError, IndexError, KeyError, TypeError):
        return True
    return bool(file) and (_framed(file, store) not in file or _is_loose_film(file))


def _is_loose_film(file):
    """Whether boxes that C2PA leaves out of its hash are others than bakery's."""
    if file[4:8] != b"ftyp":
        return False
    try:
        kinds = {kind for kind, _, _ in mp4.boxes(file)}
    except ValueError:
        return True
    return bool(kinds & UNSIGNED) or not file.startswith(
        tuple(map(mp4.beginning, (b"isom", b"qt  ")))
    )


def _padding(signature):
    """The bytes of a COSE signature that fill up the place kept for it."""
    return b"".join(value for name, value in signature[1].items() if str(name).startswith("pad"))


def _framed(file, store):
    """A store as it stands in a file of this kind, with the bytes around it."""
    if file[:4] == b"\x89PNG":
        body = b"caBX" + store
        return struct.pack(">I", len(store)) + body + struct.pack(">I", zlib.crc32(body))
    if file[:2] == b"\xff\xd8":
        body = COMMON + struct.pack(">HI", INSTANCE, 1) + store
        return APP11 + struct.pack(">H", len(body) + 2) + body if len(store) < SEGMENT else b""
    if file[4:8] == b"ftyp":
        return mp4.box(b"uuid", IN_MP4, bytes(4), b"manifest\0", bytes(8), store)
    return store
