"""C2PA manifests of inputs, read without any library: built here box by box, in every container."""

import json
import struct
import zlib

import pytest

from bakery.errors import InputError
from bakery.formats import cbor, jumbf
from bakery.formats.image import encode_image, read_photo
from bakery.formats.ingredient import ingredient_in, note_of, read_ingredient, says_ai
from bakery.formats.mark import IPTC, PNG_XMP, with_texts
from bakery.formats.mp4 import box

AI = IPTC + "trainedAlgorithmicMedia"
UUID = b"\0\x11\0\x10\x80\0\0\xaa\0\x38\x9b\x71"


def packed(value):
    """A value as CBOR, by the standard's words: RFC 8949, section 3."""

    def head(kind, number):
        if number < 24:
            return bytes([kind << 5 | number])
        size = next(n for n in (1, 2, 4, 8) if number < 1 << 8 * n)
        return bytes([kind << 5 | {1: 24, 2: 25, 4: 26, 8: 27}[size]]) + number.to_bytes(
            size, "big"
        )

    if isinstance(value, bool):
        return b"\xf5" if value else b"\xf4"
    if value is None:
        return b"\xf6"
    if isinstance(value, int):
        return head(0, value) if value >= 0 else head(1, -1 - value)
    if isinstance(value, float):
        return b"\xfb" + struct.pack(">d", value)
    if isinstance(value, bytes | str):
        data = value if isinstance(value, bytes) else value.encode()
        return head(2 if isinstance(value, bytes) else 3, len(data)) + data
    if isinstance(value, list):
        return head(4, len(value)) + b"".join(map(packed, value))
    return head(5, len(value)) + b"".join(packed(x) for pair in value.items() for x in pair)


def super_box(kind, label, *inside):
    about = box(b"jumd", kind + UUID, b"\x03" + label.encode() + b"\0")
    return box(b"jumb", about, *inside)


def assertion(label, table):
    return super_box(b"cbor", label, box(b"cbor", packed(table)))


def manifest(name="urn:c2pa:a", generator="Painter", source=AI, version=2):
    """A manifest as c2pa-rs lays it out; of version 1, as the first ones were."""
    claim = {"claim_generator_info": {"name": generator, "version": "3.1"}}
    if version == 1:
        claim = {"claim_generator": f"{generator} 3.1"}
    end = ".v2" if version == 2 else ""
    actions = {"actions": [{"action": "c2pa.created", "digitalSourceType": source}]}
    about = {"hash": bytes(range(32)), "alg": "sha256", "pad": bytes(8)}
    return super_box(
        b"c2ma", name,
        super_box(b"c2as", "c2pa.assertions", assertion(f"c2pa.actions{end}", actions),
                  assertion("c2pa.hash.data", about)),
        super_box(b"c2cl", f"c2pa.claim{end}", box(b"cbor", packed(claim))),
        super_box(b"c2cs", "c2pa.signature", box(b"cbor", b"\xd2" + packed([b"", {"pad": bytes(9)}, None, b"x"]))),
    )  # fmt: skip


def store(*manifests):
    return super_box(b"c2pa", "c2pa", *(manifests or [manifest()]))


def in_jpeg(data, stored, piece=60_000):
    """A JPEG with a store in segments APP11: ISO 19566-5, annex D."""
    segments = b""
    for number, at in enumerate(range(0, len(stored), piece), 1):
        body = b"JP" + struct.pack(">HI", 1, number) + (stored[:8] if number > 1 else b"")
        body += stored[at : at + piece]
        segments += b"\xff\xeb" + struct.pack(">H", len(body) + 2) + body
    return data[:2] + segments + data[2:]


def in_png(data, stored, kind=b"caBX"):
    body = kind + stored
    chunk = struct.pack(">I", len(stored)) + body + struct.pack(">I", zlib.crc32(body))
    return data[:33] + chunk + data[33:]


@pytest.fixture(scope="module")
def picture(tmp_path_factory):
    import numpy as np

    return np.random.default_rng(0).integers(0, 255, (120, 100, 3), np.uint8)


@pytest.mark.parametrize(
    "value",
    [0, 23, 24, 255, 256, 70_000, 2**40, -1, -300, 1.5, True, None, b"", b"ab", "ä", [], [1, [2]], {"a": {1: b"c"}}],
)  # fmt: skip
def test_cbor_comes_back(value):
    assert cbor.loads(packed(value)) == value
    assert cbor.loads(b"\xd2" + packed(value)) == value  # behind a tag


@pytest.mark.parametrize(
    "data", [b"", b"\x18", b"\x5f", b"\x9f\x01\xff", b"\x9b" + b"\xff" * 8, b"\x63ab", b"\x81" * 40, b"\x62\xff\xff", b"\xa1\x80\x01"],
)  # fmt: skip
def test_damaged_cbor_is_refused(data):
    with pytest.raises(cbor.CborError):
        cbor.loads(data)


@pytest.mark.parametrize("version", [1, 2])
def test_a_store_says_who_made_the_file_and_how(version):
    old = manifest("urn:c2pa:old", "Camera", IPTC + "digitalCapture", version)
    said = jumbf.said(store(old, manifest(version=version)))
    assert said.generator == "Painter 3.1", "of the last, which is the active one"
    assert said.source_types == (IPTC + "digitalCapture", AI)
    assert jumbf.signed_digest(store()) == bytes(range(32)).hex()


@pytest.mark.parametrize("kind", [".png", ".jpg", ".webp", ".mp4", "pieces"])
def test_it_is_found_in_every_container(kind, picture):
    stored = store()
    if kind in (".jpg", "pieces"):
        data = in_jpeg(encode_image(picture, ".jpg"), stored, 300 if kind == "pieces" else 60_000)
    elif kind == ".mp4":
        uuid = bytes.fromhex("d8fec3d61b0e483c92975828877ec481")
        data = box(b"ftyp", b"isom") + box(b"uuid", uuid, bytes(4), b"manifest\0", bytes(8), stored)
    else:
        plain = encode_image(picture, kind)
        chunk = b"C2PA" + struct.pack("<I", len(stored)) + stored
        data = in_png(plain, stored) if kind == ".png" else plain + chunk
    assert jumbf.find_store(data) == stored
    found = ingredient_in(data)
    assert found is not None and says_ai(found) == "trainedAlgorithmicMedia"
    assert found.claimed == (AI,) and found.claimed_by == "Painter 3.1" and found.source_type == ""


def test_what_cannot_be_read_is_still_told(picture):
    """A packed manifest, or a damaged one: that there is one, and no more."""
    packed_one = super_box(b"c2pa", "c2pa", super_box(b"c2cm", "urn:c2pa:a", box(b"brob", b"....")))
    damaged = bytearray(store())
    damaged[300:304] = b"\xff" * 4
    for stored in (packed_one, bytes(damaged), super_box(b"c2pa", "c2pa")):
        found = ingredient_in(in_png(encode_image(picture, ".png"), stored))
        assert found is not None and found.store and note_of(found) == "carries a C2PA manifest"


def test_any_damage_ends_in_a_store_that_says_nothing():
    whole = store()
    for at in range(len(whole)):
        for value in (0, 255, whole[at] ^ 1):
            said = jumbf.said(whole[:at] + bytes([value]) + whole[at + 1 :])
            assert isinstance(said.generator, str)
        jumbf.said(whole[:at])
        jumbf.find_store(whole[:at])
    with pytest.raises(InputError, match="damaged C2PA manifest"):
        jumbf.read_store(whole[:-1])


XMP = """<x:xmpmeta xmlns:x="adobe:ns:meta/"><rdf:RDF xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#">
<rdf:Description rdf:about="" xmlns:{0}="http://iptc.org/std/Iptc4xmpExt/2008-02-29/"{1}>{2}</rdf:Description>
</rdf:RDF></x:xmpmeta>"""
FORMS = {
    "element": ("Iptc4xmpExt", "", f"<Iptc4xmpExt:DigitalSourceType>{AI}</Iptc4xmpExt:DigitalSourceType>"),
    "attribute": ("Iptc4xmpExt", f'\n Iptc4xmpExt:DigitalSourceType="{AI}"', ""),
    "resource": ("e", "", f"<e:DigitalSourceType rdf:resource='{AI}'/>"),
    "other prefix": ("iptcExt", f" iptcExt:DigitalSourceType='{AI.replace('http', 'https')}'", ""),
    "bare name": ("e", "", "<e:DigitalSourceType> trainedAlgorithmicMedia </e:DigitalSourceType>"),
}  # fmt: skip


@pytest.mark.parametrize("form", FORMS)
def test_xmp_of_others_is_read(form, picture, tmp_path):
    path = tmp_path / "a.png"
    path.write_bytes(with_texts(encode_image(picture, ".png"), {PNG_XMP: XMP.format(*FORMS[form])}))
    found = read_ingredient(path)
    assert found is not None and found.source_type == AI and found.store == ""
    photo = read_photo(path)
    assert photo.ingredient == found
    assert photo.notes == ("says that it is AI-made or synthetic (trainedAlgorithmicMedia)",)


def test_packed_xmp_of_png_is_read(picture):
    body = PNG_XMP.encode() + b"\0\1\0\0\0" + zlib.compress(XMP.format(*FORMS["element"]).encode())
    found = ingredient_in(in_png(encode_image(picture, ".png"), body, b"iTXt"))
    assert found is not None and found.source_type == AI


@pytest.mark.parametrize(
    "value", ["", "http://example.org/x", "x y", "trained<b>", "a" * 100, "../etc", "http://cv.iptc.org/newscodes/digitalsourcetype/"]
)  # fmt: skip
def test_what_no_list_of_source_types_holds_is_nothing(value, picture):
    text = XMP.format("e", "", f"<e:DigitalSourceType>{value}</e:DigitalSourceType>")
    assert ingredient_in(with_texts(encode_image(picture, ".png"), {PNG_XMP: text})) is None


def test_a_program_with_a_hostile_name_does_no_harm(picture):
    stored = store(manifest(generator="<b>\u202e\n" + "x" * 500))
    found = ingredient_in(in_png(encode_image(picture, ".png"), stored))
    assert found.claimed_by.startswith("b x") and len(found.claimed_by) == 100
    assert json.dumps(found.claimed_by).isascii()


def test_a_photo_without_a_mark_has_no_note(picture):
    assert ingredient_in(encode_image(picture, ".jpg")) is None


def test_a_film_is_read_around_its_pictures(tmp_path):
    """The mark may stand behind the pictures, which are passed over."""
    path = tmp_path / "a.mp4"
    xmp = box(
        b"uuid",
        bytes.fromhex("be7acfcb97a942e89c71999491e3afac"),
        XMP.format(*FORMS["element"]).encode(),
    )
    many = 2**28  # bytes of pictures, more than are looked at; the file has a hole there
    with open(path, "wb") as file:
        file.write(box(b"ftyp", b"isom") + struct.pack(">I4sQ", 1, b"mdat", 16 + many))
        file.seek(many, 1)
        file.write(xmp)
    found = read_ingredient(path)
    assert found is not None and found.source_type == AI
    assert read_ingredient(tmp_path) is None, "a folder of frames"
