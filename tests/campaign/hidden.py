"""Texts that must not be in a file, found in whatever form it may hold them.

Searched are all bytes of a file, and what is unpacked from them, again and again: entries of ZIP, PNG
chunks (pixels too), streams of zlib and gzip at any place, base64 of 64 letters or more (data: URLs, the
files in a page). A text is looked for as UTF-8, Latin-1, UTF-16, hexadecimal, base64 in its three
alignments, percent-encoded, and as JSON and XML escape it. Not unpacked: pixels of EXR, JPEG, WebP and films,
Brotli, base64 in lines. Tags of these files are plain bytes, or XMP, which is.
"""

import base64
import gzip
import html
import io
import json
import re
import struct
import zipfile
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import quote

DEEPEST = 4  # of what is packed in what is packed
MOST = 64 * 2**20  # bytes of one stream
BASE64 = re.compile(rb"[A-Za-z0-9+/]{64,}={0,2}|[A-Za-z0-9_-]{64,}={0,2}")
STREAM = re.compile(rb"\x78[\x01\x5e\x9c\xda]|\x1f\x8b\x08")  # how zlib and gzip begin
PNG = b"\x89PNG\r\n\x1a\n"


@dataclass(frozen=True)
class Token:
    """Something private; `forms` are the bytes of which none may be there."""

    name: str
    forms: tuple[bytes, ...]


def token(name: str, *texts: str | bytes) -> Token:
    """A token by its texts, each in every form; bytes are looked for as they are."""
    forms: list[bytes] = []
    for text in texts:
        forms += [text] if isinstance(text, bytes) else _forms(text)
    return Token(name, tuple(dict.fromkeys(forms)))


def _forms(text: str) -> list[bytes]:
    plain = text.encode()
    wide = [text.encode("utf-16-le"), text.encode("utf-16-be")]
    out = [plain, *wide, plain.hex().encode(), plain.hex().upper().encode()]
    out += [b64 for data in (plain, *wide) for b64 in aligned(data)]
    out += [quote(text, safe="").encode(), quote(text).encode(), html.escape(text).encode()]
    out += ["".join(f"%{byte:02X}" for byte in plain).encode(), json.dumps(text)[1:-1].encode()]
    out += [text.encode("ascii", "xmlcharrefreplace"), text.replace("/", "\\/").encode()]
    try:
        out.append(text.encode("latin-1"))
    except UnicodeEncodeError:
        pass
    return out


def aligned(data: bytes) -> Iterator[bytes]:
    """What base64 makes of data after 0, 1 or 2 other bytes, as far as it depends on data alone."""
    for before in range(3):
        text = base64.b64encode(bytes(before) + data)
        yield text[-(-before * 8 // 6) : (before + len(data)) * 8 // 6]


def views(data: bytes, depth: int = 0) -> Iterator[bytes]:
    """Data, and all that is packed in it."""
    yield data
    if depth == DEEPEST:
        return
    for part in _parts(data):
        if len(part) > 4:
            yield from views(part, depth + 1)


def _parts(data: bytes) -> Iterator[bytes]:
    if data[:2] == b"PK":
        try:
            with zipfile.ZipFile(io.BytesIO(data)) as archive:
                for entry in archive.infolist():
                    yield archive.read(entry)
        except (zipfile.BadZipFile, zlib.error, NotImplementedError):
            pass
    start = data.find(PNG)
    while start >= 0:
        yield _pixels(data, start + len(PNG))
        start = data.find(PNG, start + 1)
    for found in STREAM.finditer(data):
        part = _unpacked(data[found.start() : found.start() + MOST], 47)
        if part:
            yield part
    for found in BASE64.finditer(data):
        text = found[0].rstrip(b"=")
        text = text[: len(text) - (len(text) % 4 == 1)]
        text = text.replace(b"-", b"+").replace(b"_", b"/")
        yield base64.b64decode(text + b"=" * (-len(text) % 4))


def _pixels(data: bytes, at: int) -> bytes:
    """The lines of a PNG; its other chunks are whole, and so found as streams."""
    packed = []
    while at + 8 <= len(data):
        length, kind = struct.unpack_from(">I4s", data, at)
        if kind == b"IDAT":
            packed.append(data[at + 8 : at + 8 + length])
        if kind == b"IEND":
            break
        at += 12 + length
    return _unpacked(b"".join(packed), 15)


def _unpacked(data: bytes, window: int) -> bytes:
    """What can be unpacked of a stream that may be torn, or none at all."""
    machine, out = zlib.decompressobj(window), b""
    try:
        out = machine.decompress(
            data[:4096]
        )  # what is no stream ends here, so that it costs little
        out += machine.decompress(data[4096:], MOST)
    except zlib.error:
        pass
    return out


def found_in(data: bytes, tokens: list[Token]) -> set[str]:
    """Names of the tokens that are in data in some form."""
    out: set[str] = set()
    for view in views(data):
        for each in tokens:
            if each.name not in out and any(form in view for form in each.forms):
                out.add(each.name)
    return out


def planted(folder: Path, text: str, raw: bytes) -> dict[str, bytes]:
    """Files that hold a text, one in each way in which it is to be found; `raw` is a token of bytes."""
    plain = text.encode()
    chunk = _chunk(b"zTXt", b"Comment\0\0" + zlib.compress(plain))
    itxt = _chunk(b"iTXt", b"XML\0\1\0\0\0" + zlib.compress(plain))
    header = _chunk(b"IHDR", struct.pack(">IIBBBBB", len(plain), 1, 8, 0, 0, 0, 0))
    lines = zlib.compress(b"\0" + plain)
    end = _chunk(b"IEND", b"")
    pixels = PNG + header + _chunk(b"IDAT", lines[:9]) + _chunk(b"IDAT", lines[9:]) + end
    box = io.BytesIO()
    with zipfile.ZipFile(box, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("a.txt", bytes(99) + plain)
    out = {
        "utf-8": plain, "utf-16-le": text.encode("utf-16-le"), "utf-16-be": text.encode("utf-16-be"),
        "percent": quote(text, safe="").encode(), "all percent": b"%" + plain.hex("%").upper().encode(),
        "json": json.dumps({"a": text}).encode(), "latin": text.encode("latin-1"),
        "xml": text.encode("ascii", "xmlcharrefreplace"), "hex": plain.hex().encode(),
        "gzip": gzip.compress(plain), "zlib": b"before" + zlib.compress(plain), "zip": box.getvalue(),
        "png zTXt": PNG + header + chunk + end, "png iTXt": PNG + header + itxt + end, "png": pixels,
        "png in a page": b'<img src="data:image/png;base64,' + base64.b64encode(pixels) + b'">',
        "zip in a page": b'<script>' + base64.b64encode(box.getvalue()) + b"</script>",
        "glb": b"glTF" + struct.pack("<IIII", 2, 99, 79, 0x4E4F534A) + json.dumps([text]).encode(),
        "exr attribute": b"\x76\x2f\x31\x01" + b"comments\0string\0" + struct.pack("<I", 9) + plain,
        "bytes": b"....." + raw + b"...",
        "bytes in base64": base64.b64encode(bytes(200) + raw + bytes(200)),
    }  # fmt: skip
    for before in range(3):
        out[f"base64 after {before}"] = b'"' + base64.b64encode(b"abc"[:before] + plain) + b'"'
    folder.mkdir(parents=True, exist_ok=True)
    for name, data in out.items():
        (folder / name.replace(" ", "-")).write_bytes(data)
    return out


def _chunk(kind: bytes, body: bytes) -> bytes:
    check = struct.pack(">I", zlib.crc32(kind + body))
    return struct.pack(">I", len(body)) + kind + body + check
