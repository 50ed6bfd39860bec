"""The mark that files carry: they are synthetic, by which program, made from what.

One module writes it into files of every kind and finds it again: XMP with the IPTC digital source type
in PNG, JPEG, WebP and MP4, and in the pictures of USDZ; tags in WebM; KHR_xmp_json_ld in GLB and VRM;
header attributes in OpenEXR; <meta> and JSON-LD in pages; `provenance` in manifests. It names the
portrait by its hash alone. Pixels, samples and triangles stay as they were to the bit.

Sources: IPTC, "Digital Source Type NewsCodes"; Adobe, "XMP Specification Part 3: Storage in Files";
Khronos, "KHR_xmp_json_ld".
"""

import html
import io
import json
import os
import re
import struct
import zipfile
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from xml.sax.saxutils import escape, unescape

from bakery import __version__
from bakery.errors import BakeryError, InputError
from bakery.formats import glb
from bakery.formats.exr_header import MAGIC, MULTI_PART, attributes
from bakery.formats.files import read_bytes, write_bytes
from bakery.formats.usdz import package
from bakery.types import Ingredient

IPTC = "http://cv.iptc.org/newscodes/digitalsourcetype/"
SOURCE, TOOL, FROM = "Iptc4xmpExt:DigitalSourceType", "xmp:CreatorTool", "dc:source"
NAMESPACES = {
    "Iptc4xmpExt": "http://iptc.org/std/Iptc4xmpExt/2008-02-29/",
    "dc": "http://purl.org/dc/elements/1.1/",
    "xmp": "http://ns.adobe.com/xap/1.0/",
}
PACKET = """<?xpacket begin="\ufeff" id="W5M0MpCehiHzreSzNTczkc9d"?>
<x:xmpmeta xmlns:x="adobe:ns:meta/"><rdf:RDF xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#">
<rdf:Description rdf:about=""{spaces}>
{body}
</rdf:Description></rdf:RDF></x:xmpmeta>
<?xpacket end="r"?>"""
NOTE = (
    '<dc:description><rdf:Alt><rdf:li xml:lang="x-default">{}</rdf:li></rdf:Alt></dc:description>'
)
INGREDIENTS = (
    '<xmpMM:Ingredients xmlns:xmpMM="http://ns.adobe.com/xap/1.0/mm/" '
    'xmlns:stRef="http://ns.adobe.com/xap/1.0/sType/ResourceRef#"><rdf:Bag>{}</rdf:Bag></xmpMM:Ingredients>'
)
INGREDIENT = (
    '<rdf:li rdf:parseType="Resource"><stRef:documentID>{}</stRef:documentID>'
    "<Iptc4xmpExt:DigitalSourceType>{}</Iptc4xmpExt:DigitalSourceType></rdf:li>"
)
PNG_HEADER, PNG_XMP = 33, "XML:com.adobe.xmp"  # bytes before the first text; keyword of XMP
JPEG_XMP = b"http://ns.adobe.com/xap/1.0/\0"
WEBP_XMP = 0x04  # flag of the chunk VP8X
EXTENSION = "KHR_xmp_json_ld"
EXR = {"digitalSourceType": SOURCE, "creatorTool": TOOL, "madeFrom": FROM}  # attribute -> property
URN = "urn:sha256:"
MATROSKA = b"\x1aE\xdf\xa3"  # how its files, and those of WebM, begin
MOST = 64 * 2**20  # bytes of a film that are looked at: the mark stands before its pictures


@dataclass(frozen=True)
class Mark:
    """What a file says about itself."""

    source_type: str  # IPTC digital source type, a URL
    tool: str  # program and version: "bakery 0.1.0"
    photo: str = ""  # SHA-256 of the portrait's bytes, "" if unknown

    def properties(self) -> dict[str, str]:
        """By XMP's names; what is not known is left out."""
        made_from = URN + self.photo if self.photo else ""
        every = {SOURCE: self.source_type, TOOL: self.tool, FROM: made_from}
        return {name: value for name, value in every.items() if value}


def of_ours(source_type: str, photo: str = "") -> Mark:
    """The Mark of what this version makes.

    Args:
        source_type: name of an IPTC digital source type; photo: SHA-256 of the portrait.
    """
    return Mark(IPTC + source_type, f"bakery {__version__}", photo)


PAINTED = of_ours("algorithmicMedia")  # people who do not exist
MIXED = of_ours("compositeSynthetic")  # photographs beside what was made of them


def of_manifest(table: dict) -> Mark | None:
    """What the manifest of a bundle says, which is the mark of all that is made of it."""
    about = table.get("provenance") or {}
    if "digitalSourceType" not in about:
        return None
    return Mark(
        about["digitalSourceType"], table["asset"]["generator"], about["input"].get("sha256", "")
    )


def packet(
    properties: dict[str, str], note: str = "", ingredients: Sequence[Ingredient] = ()
) -> str:
    """An XMP packet of properties by name, with words for people, and with what went in."""
    also = {"dc"} if note else set()
    used = sorted({name.split(":")[0] for name in properties} | also)
    spaces = "".join(f'\n xmlns:{name}="{NAMESPACES[name]}"' for name in used)
    lines = [f"<{name}>{escape(value)}</{name}>" for name, value in properties.items()]
    lines += [NOTE.format(escape(note))] if note else []
    if ingredients:
        entries = [INGREDIENT.format(URN + one.sha256, named(one)) for one in ingredients]
        lines.append(INGREDIENTS.format("".join(entries)))
    return PACKET.format(spaces=spaces, body="\n".join(lines))


def type_name(url: str) -> str:
    """The name of a digital source type without the list that it stands in."""
    return url.rsplit("/", 1)[-1]


def named(found: Ingredient) -> str:
    """The source type that an input names for itself, a URL; "" if it names none."""
    return next((url for url in (found.source_type, *found.claimed) if url), "")


def with_texts(data: bytes, texts: dict[str, str]) -> bytes:
    """A PNG with texts by keyword in it: chunks iTXt, not packed."""
    chunks = b""
    for keyword, text in texts.items():
        body = b"iTXt" + keyword.encode() + bytes(5) + text.encode()
        chunks += struct.pack(">I", len(body) - 4) + body + struct.pack(">I", zlib.crc32(body))
    return data[:PNG_HEADER] + chunks + data[PNG_HEADER:]


def stamped(kind: str, data: bytes, mark: Mark) -> bytes:
    """The bytes of a file with a mark in it.

    Args:
        kind: ending of its name: .png, .jpg, .webp, .exr, .glb, .vrm or .usdz; others come back as they are.
        data: its bytes, as bakery wrote them.
    """
    return _STAMPS[kind](data, mark) if kind in _STAMPS else data


def stamp(path: Path, mark: Mark) -> None:
    """Put a mark into a file, or into each file of a folder but for the portrait itself."""
    places = sorted(path.rglob("*")) if path.is_dir() else [path]
    for place in places:
        kind = place.suffix.lower()
        if kind in _STAMPS and place.is_file() and place.stem != "photo":
            write_bytes(place, stamped(kind, read_bytes(place, 2**31), mark), sync=False)


def page_head(mark: Mark, kind: str = "3DModel") -> str:
    """Elements for the head of a page: <meta> for programs that look for names, JSON-LD for others.

    Args:
        kind: of schema.org, what the page shows.
    """
    metas = {"generator": mark.tool, "digital-source-type": mark.source_type}
    lines = [f'<meta name="{name}" content="{html.escape(to)}">' for name, to in metas.items()]
    table = {"@context": NAMESPACES | {"@vocab": "https://schema.org/"}, "@type": kind}
    text = json.dumps(table | mark.properties()).replace("<", "\\u003c")
    return "\n".join([*lines, f'<script type="application/ld+json">{text}</script>'])


def _png(data: bytes, mark: Mark) -> bytes:
    return with_texts(data, {PNG_XMP: packet(mark.properties())})


def _jpeg(data: bytes, mark: Mark) -> bytes:
    body = JPEG_XMP + packet(mark.properties()).encode()
    at = 2
    if data[2:4] == b"\xff\xe0":  # JFIF stands first
        at = 4 + int.from_bytes(data[4:6], "big")
    return data[:at] + b"\xff\xe1" + struct.pack(">H", len(body) + 2) + body + data[at:]


def _webp(data: bytes, mark: Mark) -> bytes:
    chunks = list(_riff(data))
    if chunks[0][0] != b"VP8X":
        chunks.insert(0, (b"VP8X", _canvas(*chunks[0])))
    name, body = chunks[0]
    chunks[0] = name, bytes([body[0] | WEBP_XMP]) + body[1:]
    chunks.append((b"XMP ", packet(mark.properties()).encode()))
    packed = [n + struct.pack("<I", len(b)) + b + bytes(len(b) % 2) for n, b in chunks]
    inner = b"WEBP" + b"".join(packed)
    return b"RIFF" + struct.pack("<I", len(inner)) + inner


def _riff(data):
    """The chunks of a WebP file, (name, bytes)."""
    at = 12
    while at + 8 <= len(data):
        (size,) = struct.unpack_from("<I", data, at + 4)
        yield data[at : at + 4], data[at + 8 : at + 8 + size]
        at += 8 + size + size % 2


def _canvas(name, body):
    """What VP8X says of a file that holds one plain picture: its alpha and its size."""
    if name == b"VP8L":
        (bits,) = struct.unpack_from("<I", body, 1)
        width, height, alpha = bits & 0x3FFF, bits >> 14 & 0x3FFF, bits >> 28 & 1
    else:
        width, height = (side - 1 & 0x3FFF for side in struct.unpack_from("<HH", body, 6))
        alpha = 0
    flags = struct.pack("<I", 0x10 if alpha else 0)
    return flags + width.to_bytes(3, "little") + height.to_bytes(3, "little")


def _glb(data: bytes, mark: Mark) -> bytes:
    document, binary = glb.apart(data)
    said = {"@context": NAMESPACES, "@id": "", **mark.properties()}
    used = document.setdefault("extensionsUsed", [])
    if EXTENSION not in used:
        used.append(EXTENSION)
    document.setdefault("extensions", {})[EXTENSION] = {"packets": [said]}
    document["asset"].setdefault("extensions", {})[EXTENSION] = {"packet": 0}
    return glb.joined(document, binary)


def _exr(data: bytes, mark: Mark) -> bytes:
    """Attributes of the first part; the chunks move back, so the tables of their places change."""
    known = {of: name for name, of in EXR.items()}
    extra = b""
    for name, value in mark.properties().items():
        text = value.encode()
        extra += known[name].encode() + b"\0string\0" + struct.pack("<i", len(text)) + text
    multi = bool(struct.unpack_from("<I", data, 4)[0] & MULTI_PART)
    _, first = attributes(data, 8)
    at = first
    while multi and data[at]:
        _, at = attributes(data, at)
    at += multi
    end, places = len(data), []
    while at + 8 * len(places) < end:  # the tables end where the first chunk begins
        (place,) = struct.unpack_from("<Q", data, at + 8 * len(places))
        places.append(place)
        end = min(end, place)
    moved = struct.pack(f"<{len(places)}Q", *(place + len(extra) for place in places))
    return data[: first - 1] + extra + data[first - 1 : at] + moved + data[end:]


def _usdz(data: bytes, mark: Mark) -> bytes:
    """In each picture of the package: its layer says it by USD's means, which only USD reads."""
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        files = {name: archive.read(name) for name in archive.namelist()}
    return package({name: stamped(Path(name).suffix, one, mark) for name, one in files.items()})


_STAMPS = {
    ".png": _png, ".jpg": _jpeg, ".jpeg": _jpeg, ".webp": _webp, ".exr": _exr, ".glb": _glb, ".vrm": _glb,
    ".usdz": _usdz,
}  # fmt: skip


def found(path: str | Path) -> Mark | None:
    """The mark of a file of any kind that bakery writes, or None; it is told by its first bytes.

    Raises:
        InputError: it cannot be read.
    """
    data = read_bytes(path, first=MOST)
    try:
        said = _said(data)
    except (BakeryError, LookupError, TypeError, ValueError, struct.error, AttributeError):
        raise InputError(f"{os.fspath(path)}: damaged; make it again") from None
    if SOURCE not in said:
        return None
    return Mark(said[SOURCE], said.get(TOOL, ""), said.get(FROM, "").removeprefix(URN))


def matroska_tag(data: bytes, name: str) -> str:
    """The text of a tag of Matroska, "" without it: it stands behind the tag's name."""
    at = data.find(name.encode() + b"\x44\x87") + len(name) + 2
    if at < len(name) + 2 or not data[at : at + 1].strip(b"\0"):
        return ""
    # Bytes of the length behind its first one, whose top bit says so.
    more = 8 - data[at].bit_length()
    size = int.from_bytes(data[at : at + 1 + more], "big") - (1 << 7 * (more + 1))
    return data[at + 1 + more : at + 1 + more + size].decode("utf-8", "replace")


def _said(data: bytes) -> dict[str, str]:
    if data[:4] == MAGIC:
        read, _ = attributes(data, 8)
        return {of: read[name][1].decode() for name, of in EXR.items() if name in read}
    if data[:4] == b"glTF":
        packets = glb.apart(data)[0].get("extensions", {}).get(EXTENSION, {}).get("packets", [{}])
        return {name: text for name, text in packets[0].items() if isinstance(text, str)}
    if data[:1] == b"{":
        mark = of_manifest(json.loads(data))
        return mark.properties() if mark else {}
    if data[:4] == MATROSKA:
        said = {name: matroska_tag(data, name) for name in (SOURCE, TOOL)}
        return {name: text for name, text in said.items() if text}
    if data.lstrip()[:9].lower() == b"<!doctype":
        here = re.search(rb'<script type="application/ld\+json">(.*?)</script>', data)
        return json.loads(here[1]) if here else {}
    every = (SOURCE, TOOL, FROM)
    values = {n: re.search(f"<{n}>([^<]*)</{n}>".encode(), data) for n in every}
    return {name: unescape(here[1].decode()) for name, here in values.items() if here}
