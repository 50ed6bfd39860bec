"""C2PA signatures: made and checked by c2pa-python, and read again by others and by hand."""

import hashlib
import io
import json
import re
import shutil
import socket
import struct
import subprocess
import threading
import time
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from bakery.errors import InputError
from bakery.formats import cbor, jumbf, mark, signing, video
from bakery.formats.image import encode_image
from bakery.formats.ingredient import read_around

ROOT = Path(__file__).resolve().parents[2]
MARK = mark.Mark(mark.IPTC + "compositeSynthetic", "bakery 0.1.0", "ab" * 32)
KINDS = (".png", ".jpg", ".webp", ".mp4", ".webp plain", ".mov")
C2PA = bytes.fromhex("d8fec3d61b0e483c92975828877ec481")


@pytest.fixture(scope="module")
def credentials(signer):
    return signing.read_credentials(signer.chain, signer.key)


def unsigned(folder, kind):
    """A small file as bakery writes it."""
    path = folder / f"a{kind.split()[0]}"
    pixels = np.random.default_rng(0).integers(0, 256, (24, 32, 3), np.uint8)
    if kind in (".mp4", ".mov"):
        part = folder / "part"
        part.write_bytes(video.encode([pixels] * 3, ".mp4", 25.0))
        note = video.Note("Synthetic media", MARK.source_type)
        video.join(path, [part], kind, 25.0, (32, 24), note)
        part.unlink()
    else:
        plain = encode_image(pixels, path.suffix, 101 if "plain" in kind else 80)
        path.write_bytes(mark.stamped(path.suffix, plain, MARK))
    return path


@pytest.fixture
def signed(tmp_path, credentials):
    """A function (kind) -> path of a signed file."""

    def make(kind):
        path = unsigned(tmp_path, kind)
        signing.sign_file(path, path, credentials)
        return path

    return make


@pytest.mark.parametrize("kind", KINDS)
def test_a_signed_file_says_who_made_it_and_stays_as_it_was(kind, tmp_path, credentials, signer):
    path, made = unsigned(tmp_path, kind), tmp_path / f"b{kind.split()[0]}"
    before = path.read_bytes()
    signing.sign_file(path, made, credentials)
    assert path.read_bytes() == before
    said = signing.check_file(made, signer.anchors.read_bytes())
    assert said.trusted and (said.by, said.organisation) == ("signer", "Test studio")
    assert said.source_types == (MARK.source_type,) and said.generator.startswith("bakery ")
    assert not signing.check_file(made).trusted, "nobody was named whom to trust"
    assert mark.found(made) == mark.found(path)
    if path.suffix in (".mp4", ".mov"):
        films = [[frame for _, frame in video.Clip(one).frames()] for one in (path, made)]
        np.testing.assert_array_equal(*films)
    else:
        one, other = (np.asarray(Image.open(place)) for place in (path, made))
        np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize("kind", [".png", ".jpg", ".webp", ".mp4"])
def test_no_byte_of_a_signed_file_may_change(kind, signed, tmp_path):
    """Every byte of the manifest's framing and of its padding, which c2pa passes over; others in turn."""
    path = signed(kind)
    data, other = path.read_bytes(), tmp_path / f"changed{path.suffix}"
    begin = data.find(jumbf.find_store(read_around(path)))
    chosen = {*range(0, begin + 60), *range(0, len(data), 23), *range(len(data) - 20, len(data))}
    for at in sorted(chosen):
        other.write_bytes(data[:at] + bytes([data[at] ^ 0xFF]) + data[at + 1 :])
        with pytest.raises(InputError) as caught:
            signing.check_file(other)
        assert "\n" not in str(caught.value), at
    for changed in (data + b"\0", data[:-1], data[: begin // 2]):
        other.write_bytes(changed)
        with pytest.raises(InputError):
            signing.check_file(other)


def test_no_byte_beside_a_sidecar_may_change(credentials):
    data = b'{"files": []}'
    store = signing.sign_beside(data, MARK, credentials)
    assert signing.check_beside("it", "its store", data, store).by == "signer"
    for at in range(len(store)):
        with pytest.raises(InputError, match="^its store: "):
            changed = store[:at] + bytes([store[at] ^ 0xFF]) + store[at + 1 :]
            signing.check_beside("it", "its store", data, changed)
    for other in (data + b" ", data[:-1], b'{"files": [0]}'):
        with pytest.raises(InputError, match="^it: changed since it was signed"):
            signing.check_beside("it", "its store", other, store)


def assertion(store, label):
    """The table of an assertion of the last manifest, by the boxes alone."""
    active = jumbf.read_store(store).boxes[-1]
    (found,) = (b for part in active.boxes for b in part.boxes if b.label.startswith(label))
    return cbor.loads(found.contents[0])


@pytest.mark.parametrize("kind", [".png", ".jpg", ".webp"])
def test_the_hash_of_pictures_is_that_of_the_standard(kind, signed):
    """Computed here from the file: C2PA 2.2, 18.5, all bytes but those that the manifest stands in."""
    path = signed(kind)
    data, table = (
        path.read_bytes(),
        assertion(jumbf.find_store(path.read_bytes()), "c2pa.hash.data"),
    )
    kept, at = b"", 0
    for gap in table["exclusions"]:
        kept += data[at : gap["start"]]
        at = gap["start"] + gap["length"]
    assert hashlib.sha256(kept + data[at:]).digest() == table["hash"]


def test_the_hash_of_films_is_that_of_the_standard(signed):
    """C2PA 2.2, 18.6: the outer boxes but ftyp and the manifest's own, each behind its offset."""
    path = signed(".mp4")
    data, hashed, at = path.read_bytes(), hashlib.sha256(), 0
    while at < len(data):
        size, kind = struct.unpack_from(">I4s", data, at)
        size = struct.unpack_from(">Q", data, at + 8)[0] if size == 1 else size
        if kind != b"ftyp" and data[at + 8 : at + 24] != C2PA:
            hashed.update(struct.pack(">Q", at) + data[at : at + size])
        at += size
    assert hashed.digest() == assertion(jumbf.find_store(data), "c2pa.hash.bmff")["hash"]


READER = """
import { readFile } from 'node:fs/promises';
import { JPEG, PNG } from '@trustnxt/c2pa-ts/asset';
import { SuperBox } from '@trustnxt/c2pa-ts/jumbf';
import { ManifestStore } from '@trustnxt/c2pa-ts/manifest';
class Beside {
  mimeType = 'application/json';
  constructor(data, store) { this.data = data; this.store = store; }
  getDataLength() { return this.data.length; }
  async getDataRange(start = 0, length) { return this.data.subarray(start, length && start + length); }
  getManifestJUMBF() { return this.store; }
  getHashExclusionRange() { return { start: 0, length: 0 }; }
}
for (const file of process.argv.slice(2)) {
  const data = new Uint8Array(await readFile(file));
  const kind = [JPEG, PNG].find((one) => one.canRead(data));
  const beside = async () => new Uint8Array(await readFile(`${file}.c2pa`));
  const asset = kind ? new kind(data) : new Beside(data, await beside());
  const store = ManifestStore.read(SuperBox.fromBuffer(await asset.getManifestJUMBF()));
  const result = await store.validate(asset);
  console.log(JSON.stringify([result.isValid, result.statusEntries.map((one) => one.code)]));
}
"""


def test_an_independent_reader_takes_it(signed, credentials, tmp_path):
    """c2pa-ts shares no code with c2pa-rs, which c2pa-python is made of; it reads no WebP, no MP4."""
    folder = ROOT / "node_modules" / "@trustnxt" / "c2pa-ts"
    if not (folder.is_dir() and shutil.which("node")):
        pytest.skip("needs `npm install --no-save @trustnxt/c2pa-ts` in the checkout")
    (tmp_path / "node_modules").symlink_to(ROOT / "node_modules")
    (tmp_path / "read.mjs").write_text(READER)
    good, bad = [signed(".png"), signed(".jpg"), tmp_path / "a.json"], []
    good[2].write_bytes(b'{"files": []}')
    store = signing.sign_beside(good[2].read_bytes(), MARK, credentials)
    for path in good:
        data = bytearray(path.read_bytes())
        data[-30 if path.suffix != ".json" else -2] ^= 1  # of its pixels
        bad.append(path.with_stem("changed"))
        bad[-1].write_bytes(data)
    for path in (good[2], bad[2]):
        path.with_name(f"{path.name}.c2pa").write_bytes(store)
    words = ["node", tmp_path / "read.mjs", *good, *bad]
    done = subprocess.run(words, capture_output=True, text=True, check=True)
    said = list(map(json.loads, done.stdout.splitlines()))
    for valid, codes in said[:3]:
        assert valid and {"claimSignature.validated", "assertion.dataHash.match"} <= set(codes)
    for valid, codes in said[3:]:
        assert not valid and "assertion.dataHash.mismatch" in codes
    assert len(said) == 6


@pytest.mark.parametrize("kind", ["p384", "ed25519", "rsa"])
def test_keys_of_other_kinds_sign(kind, authority, tmp_path):
    other = authority.signer(kind, kind)
    path = unsigned(tmp_path, ".png")
    signing.sign_file(path, path, signing.read_credentials(other.chain, other.key))
    assert signing.check_file(path, other.anchors.read_bytes()).by == kind


CASES = {  # name -> how the signer is made, what the message says
    "expired": ({"days": (-30, -1)}, r"chain.pem: the certificate expired on 20\d\d-\d\d-\d\d; get a new"),
    "too early": ({"days": (2, 30)}, r"chain.pem: the certificate is valid from 20\d\d-.* check the clock"),
    "encrypted": ({"password": b"secret"}, r"key.pem: the key is encrypted; decrypt a copy"),
    "of another use": ({"usable": False}, r"chain.pem: cannot sign \(.*\); C2PA wants one that an auth"),
    "short": ({"kind": "rsa-short"}, r"key.pem: a key that C2PA does not take"),
    "of another curve": ({"kind": "k256"}, r"key.pem: a key that C2PA does not take"),
}  # fmt: skip


@pytest.mark.parametrize("name", CASES)
def test_certificates_that_cannot_sign_are_one_line(name, authority):
    how, message = CASES[name]
    other = authority.signer(name, **how)
    with pytest.raises(InputError, match=message) as caught:
        signing.read_credentials(other.chain, other.key)
    assert "\n" not in str(caught.value) and len(str(caught.value)) < 600


def test_files_that_are_no_certificate_and_no_key_are_one_line(authority, signer, tmp_path):
    other, text = authority.signer("other"), tmp_path / "text.pem"
    text.write_text("words")
    for chain, key, message in (
        (signer.key, signer.chain, "holds a private key; give the certificate first"),
        (text, signer.key, "text.pem: no certificate in PEM"),
        (signer.chain, text, "text.pem: no private key in PEM"),
        (signer.chain, other.key, "is not the key of .*signer-chain.pem"),
        (signer.chain, tmp_path / "none.pem", "none.pem: no such file"),
        (authority.anchors, signer.key, "is not the key of"),
    ):
        with pytest.raises(InputError, match=message) as caught:
            signing.read_credentials(chain, key)
        assert "\n" not in str(caught.value)
    with pytest.raises(InputError, match="text.pem: no certificates in PEM"):
        signing.read_anchors(text)


def test_a_key_shows_itself_nowhere(credentials, signer):
    secret = b"".join(signer.key.read_bytes().splitlines()[1:-1]).decode()
    assert secret[:20] not in repr(credentials) and "key" not in repr(credentials).split("chain")[0]
    store = signing.sign_beside(b"{}", MARK, credentials)
    assert signer.key.read_bytes().splitlines()[1] not in store


def test_a_stranger_is_not_trusted(signed, tmp_path_factory, authority):
    stranger = type(authority)(tmp_path_factory.mktemp("stranger"), "Stranger").signer()
    with pytest.raises(InputError, match="whom no certificate given by --trust vouches for"):
        signing.check_file(signed(".png"), stranger.anchors.read_bytes())


def test_a_certificate_that_expired_since_is_told(authority, tmp_path):
    """A signature without a time stamp holds as long as its certificate: here for five seconds."""
    brief, end = authority.signer("brief", days=(-1, 5 / 86400)), time.time() + 5
    path = unsigned(tmp_path, ".png")
    signing.sign_file(path, path, signing.read_credentials(brief.chain, brief.key))
    assert signing.check_file(path).by == "brief"
    time.sleep(max(end + 1.5 - time.time(), 0))  # X.509 counts whole seconds
    with pytest.raises(InputError, match="the signer's certificate expired; have it signed again"):
        signing.check_file(path)


def test_what_cannot_be_signed_stays_as_it_is(tmp_path, credentials, signed):
    plain = tmp_path / "plain.png"
    plain.write_bytes(encode_image(np.zeros((9, 9, 3), np.uint8), ".png"))
    exr = tmp_path / "a.exr"
    exr.write_bytes(b"\x76\x2f\x31\x01")
    whole = signed(".jpg")
    for path, message in (
        (plain, "carries no mark that says what it is; sign what bakery wrote"),
        (whole, "is signed already; --overwrite signs it anew"),
        (exr, "exr: "),
    ):
        before = path.read_bytes()
        with pytest.raises(InputError, match=message):
            signing.sign_file(path, path, credentials)
        assert path.read_bytes() == before
    signing.sign_file(whole, whole, credentials, again=True)
    assert len(jumbf.read_store(jumbf.find_store(whole.read_bytes())).boxes) == 1
    assert signing.check_file(whole).by == "signer"
    with pytest.raises(InputError, match="carries no C2PA signature"):
        signing.check_file(plain)


def test_a_failing_signature_leaves_the_older_file(tmp_path, credentials, monkeypatch):
    path = unsigned(tmp_path, ".png")
    before = path.read_bytes()
    c2pa = signing.library()

    def failing(*_):
        raise c2pa.C2paError("Error during signing: Signature: no\nluck")

    monkeypatch.setattr(c2pa.Builder, "sign", failing)
    with pytest.raises(InputError, match="a.png: cannot be signed: no luck"):
        signing.sign_file(path, path, credentials)
    assert path.read_bytes() == before and [p.name for p in tmp_path.iterdir()] == ["a.png"]


ELSEWHERE = (
    '<x:xmpmeta xmlns:x="adobe:ns:meta/"><rdf:RDF xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#">'
    '<rdf:Description rdf:about="" xmlns:dcterms="http://purl.org/dc/terms/" '
    'dcterms:provenance="ADDRESS"/></rdf:RDF></x:xmpmeta>'
)


def asked_by(context):
    """How often a server here is asked by who reads a file that names a manifest on it."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        server.settimeout(0.5)
        asked = []

        def count():
            try:
                while True:
                    asked.append(server.accept()[0].close())
            except TimeoutError:
                pass

        waiting = threading.Thread(target=count)
        waiting.start()
        address = f"http://127.0.0.1:{server.getsockname()[1]}/a.c2pa"
        xmp = ELSEWHERE.replace("ADDRESS", address)
        plain = encode_image(np.zeros((9, 9, 3), np.uint8), ".png")
        data = io.BytesIO(mark.with_texts(plain, {mark.PNG_XMP: xmp}))
        c2pa = signing.library()
        with pytest.raises(c2pa.C2paError), context:
            c2pa.Reader("image/png", data, context=context)
        waiting.join()
    return len(asked)


def test_no_network_is_used(credentials):
    c2pa = signing.library()
    assert asked_by(c2pa.Context()) > 0, "the library asks by itself"
    assert asked_by(signing._context()) == 0
    allowed = signing.SETTINGS | {"verify": {"remote_manifest_fetch": True}}
    assert asked_by(c2pa.Context(c2pa.Settings.from_dict(allowed))) == 0, (
        "no host is allowed either"
    )


def test_without_the_extra_one_line_says_so(tmp_path, monkeypatch):
    import sys

    monkeypatch.setitem(sys.modules, "c2pa", None)
    path = unsigned(tmp_path, ".png")
    for call in (
        lambda: signing.read_credentials(path, path),
        lambda: signing.check_file(path),
        lambda: signing.read_anchors(path),
    ):
        with pytest.raises(InputError, match=re.escape("pip install 'bakery[c2pa]'")):
            call()
