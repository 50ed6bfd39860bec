"""The mark that an input carries already: how a portrait or a clip says that it was made.

XMP and C2PA are read wherever a file keeps them; no signature is checked, so this is what the file
says, and no more. Names, places and times that stand beside it are not taken over.

Sources: IPTC, "Digital Source Type NewsCodes"; Adobe, "XMP Specification Part 1".
"""

import contextlib
import os
import re
import struct
import zlib
from collections.abc import Iterator
from pathlib import Path

from bakery.formats import jumbf, mp4
from bakery.formats.files import digest, digest_file, read_bytes
from bakery.formats.mark import IPTC, MATROSKA, MOST, NAMESPACES, SOURCE, matroska_tag, type_name
from bakery.types import Ingredient

EXTENSION = re.escape(NAMESPACES["Iptc4xmpExt"]).encode()
PREFIX = re.compile(rb"xmlns:([\w.-]{1,64})\s*=\s*[\"']" + EXTENSION)
KNOWN = re.compile(
    r"https?://(cv\.iptc\.org/newscodes|c2pa\.org)/digitalsourcetype/([A-Za-z]{1,64})"
)
FORMS = (  # of a property: an element, an attribute, an element that names a resource
    rb"<NAME>\s*([^<]{1,200}?)\s*</NAME>",
    rb"\sNAME\s*=\s*[\"']([^\"'<]{1,200})[\"']",
    rb"<NAME\s+rdf:resource\s*=\s*[\"']([^\"'<]{1,200})[\"']",
)
MADE_BY_AI = {
    "trainedAlgorithmicMedia", "compositeWithTrainedAlgorithmicMedia", "compositeSynthetic",
}  # fmt: skip
LONGEST = 100  # letters of a program's name
LARGEST_TEXT = 4 * 2**20  # bytes of packed XMP


def ingredient_in(data: bytes, sha256: str | None = None) -> Ingredient | None:
    """What a file says about how it was made, None if it says nothing.

    Args:
        data: its bytes, or those of them that may hold a mark.
        sha256: of all its bytes, if `data` are not all.
    """
    store, source_type = jumbf.find_store(data), _source_type(data)
    if not (store or source_type):
        return None
    said = jumbf.said(store) if store else jumbf.Said("", (), "")
    types = sorted({url for one in said.source_types if (url := _known(one))})
    return Ingredient(
        sha256 or digest(data), source_type, said.sha256, _plain(said.generator), tuple(types)
    )


def read_ingredient(path: str | Path) -> Ingredient | None:
    """What a file of any kind says about how it was made; of a film, its pictures are not read.

    Returns:
        None for one that says nothing, and for a folder of frames.

    Raises:
        InputError: it cannot be read.
    """
    if os.path.isdir(path):
        return None
    return ingredient_in(read_around(path), digest_file(path))


def read_around(path: str | Path) -> bytes:
    """The bytes of a file that may hold a mark; of a film, its pictures are not read.

    Raises:
        InputError: it cannot be read.
    """
    data = read_bytes(path, largest=2**50, first=MOST)
    if data[4:8] in (b"ftyp", b"moov"):
        return b"".join(_around_pictures(path))
    return data


def says_ai(found: Ingredient | None) -> str:
    """The name of the source type by which an input says that AI made it, "" if it does not."""
    urls = () if found is None else (found.source_type, *found.claimed)
    names = map(type_name, urls)
    return next((name for name in names if name in MADE_BY_AI), "")


def note_of(found: Ingredient | None) -> str:
    """What is told of an input's own mark, "" if there is nothing to tell."""
    if name := says_ai(found):
        return f"says that it is AI-made or synthetic ({name})"
    if found is not None and found.store:
        return "carries a C2PA manifest"
    return ""


def _source_type(data):
    """The digital source type in XMP or in a Matroska tag, a URL; "" if there is none."""
    if data[:4] == MATROSKA:
        return _known(matroska_tag(data, SOURCE))
    for packet in _packets(data):
        for prefix in PREFIX.findall(packet):
            name = re.escape(prefix) + rb":DigitalSourceType"
            for form in FORMS:
                here = re.search(form.replace(b"NAME", name), packet)
                if here and (url := _known(here[1].decode("utf-8", "replace"))):
                    return url
    return ""


def _packets(data: bytes) -> Iterator[bytes]:
    """The XMP packets of a file, wherever it keeps them; PNG may have packed its one."""
    at = 0
    while (at := data.find(b"<x:xmpmeta", at)) >= 0:
        end = data.find(b"</x:xmpmeta>", at)
        if end < 0:
            break
        yield data[at:end]
        at = end
    if data[:4] == b"\x89PNG":
        at = 8
        while at + 8 <= len(data):
            size, kind = struct.unpack_from(">I4s", data, at)
            body = data[at + 8 : at + 8 + size]
            if kind == b"iTXt" and body.startswith(b"XML:com.adobe.xmp\0\1"):
                packed = body[20:].split(b"\0", 2)[-1]  # behind a language and a translation
                try:
                    yield zlib.decompressobj().decompress(packed, LARGEST_TEXT)
                except zlib.error:
                    pass
            at += 12 + size


def _around_pictures(path):
    """The boxes of an MP4 or MOV file that may hold a mark, MOST bytes of them."""
    left = MOST
    with open(path, "rb") as file, contextlib.suppress(struct.error):
        for kind, at, header, size in mp4.file_boxes(file):
            if size < header or left <= 0:
                return
            if kind != b"mdat":
                file.seek(at)
                piece = file.read(min(size, left))
                left -= len(piece)
                yield piece


def _known(text):
    """A source type that IPTC or C2PA list, as a URL; a bare name is one of IPTC's."""
    text = text.strip()
    if here := KNOWN.fullmatch(text):
        return f"http://{here[1]}/digitalsourcetype/{here[2]}"
    return IPTC + text if re.fullmatch(r"[A-Za-z]{1,64}", text) else ""


def _plain(text):
    """The name of a program as a manifest may hold it."""
    kept = "".join(c if c.isascii() and c.isprintable() and c not in "<>" else " " for c in text)
    return " ".join(kept.split())[:LONGEST]
