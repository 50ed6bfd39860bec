"""`bakery sign`, `bakery verify`, `build --sign`: bundles whole by their signature; ingredients."""

import io
import json
import shutil
from pathlib import Path

import pytest

from bakery.formats import jumbf
from bakery.formats.files import digest_file
from bakery.formats.image import encode_image, read_photo
from bakery.formats.mark import IPTC, PNG_XMP, packet, with_texts

FEW = [
    "--preset", "small", "--expressions", Path(__file__).parents[1] / "few.toml",
    "--generator", "rendered", "--hair", "none", "--set", "texture.views=[0.0]",
]  # fmt: skip
AI = IPTC + "trainedAlgorithmicMedia"


@pytest.fixture(scope="module")
def sealed(bundle, bakery, signer, tmp_path_factory):
    """The bundle of the painted portrait, signed; tests must not change it."""
    out = tmp_path_factory.mktemp("sealed") / "painted.avatar"
    done = bakery("sign", bundle, signer.chain, signer.key, "-o", out)
    assert done.returncode == 0 and done.stderr == f"wrote {out}\n", done.stderr
    return out


@pytest.fixture
def copied(sealed, tmp_path):
    return Path(shutil.copytree(sealed, tmp_path / "a.avatar"))


def one_line(done, words):
    """A run that ended in one line of its own, with exit code 1."""
    assert done.returncode == 1 and words in done.stderr, done.stderr
    assert done.stderr.count("\n") == 1 and done.stdout == "", done.stderr


def test_a_signed_bundle_is_verified_and_valid(sealed, bundle, bakery, signer):
    done = bakery("verify", sealed, "--trust", signer.anchors, "--json")
    assert done.returncode == 0, done.stderr
    said = json.loads(done.stdout)
    assert said["signed by"] == "signer, Test studio" and said["trusted"] == "yes"
    assert said["source type"].startswith("composite") and said["made by"].startswith("bakery ")
    assert bakery("validate", sealed).returncode == 0
    assert json.loads(bakery("inspect", sealed, "--json").stdout)["signature"] == "avatar.c2pa"
    assert json.loads(bakery("inspect", bundle, "--json").stdout)["signature"] == "none"
    changed = [
        path.relative_to(sealed).as_posix()
        for path in sealed.rglob("*")
        if path.is_file() and not (bundle / path.relative_to(sealed)).is_file()
        or path.is_file() and digest_file(path) != digest_file(bundle / path.relative_to(sealed))
    ]  # fmt: skip
    assert sorted(changed) == ["avatar.c2pa", "avatar.json", "preview.png"]
    assert bakery("verify", sealed / "preview.png").returncode == 0
    assert "bakery verify" in bakery("inspect", sealed / "preview.png").stdout


def test_a_flipped_byte_in_any_file_of_a_bundle_fails(copied, bakery):
    files = sorted(path for path in copied.rglob("*") if path.is_file())
    assert len(files) > 15
    for path in files:
        data = path.read_bytes()
        for at in {0, len(data) // 2, len(data) - 1}:
            path.write_bytes(data[:at] + bytes([data[at] ^ 0x20]) + data[at + 1 :])
            done = bakery("verify", copied)
            assert done.returncode == 1 and done.stderr.count("\n") == 1, (path.name, at)
        path.write_bytes(data)
    assert bakery("verify", copied).returncode == 0


def test_files_that_are_missing_added_or_linked_fail(copied, bakery):
    (copied / "web" / "more.png").write_bytes(b"more")
    one_line(bakery("verify", copied), "not in the list of files")
    (copied / "web" / "more.png").unlink()
    (copied / "face.exr").rename(copied.parent / "face.exr")
    one_line(bakery("verify", copied), "missing")
    (copied / "face.exr").symlink_to(copied.parent / "face.exr")
    one_line(bakery("verify", copied), "a link")


def test_the_manifest_of_another_bundle_fails(copied, bundle, bakery):
    """An honest bundle beside somebody else's signature."""
    for name in ("avatar.json", "preview.png"):
        shutil.copyfile(bundle / name, copied / name)
    one_line(bakery("verify", copied), "changed since it was signed")
    done = bakery("validate", copied)
    assert done.returncode == 1 and "avatar.c2pa: signs another manifest" in done.stdout


def test_a_bundle_is_signed_in_its_place(bundle, bakery, signer, authority, tmp_path):
    copy = Path(shutil.copytree(bundle, tmp_path / "a.avatar"))
    one_line(bakery("verify", copy), "carries no avatar.c2pa; `bakery sign` makes one")
    assert bakery("sign", copy, signer.chain, signer.key).returncode == 0
    assert bakery("verify", copy).returncode == 0
    other = authority.signer("later")
    one_line(bakery("sign", copy, other.chain, other.key), "--overwrite signs it anew")
    assert bakery("sign", copy, other.chain, other.key, "--overwrite").returncode == 0
    said = json.loads(bakery("verify", copy, "--json").stdout)
    assert said["signed by"].startswith("later") and bakery("validate", copy).returncode == 0
    assert [path.name for path in tmp_path.iterdir()] == ["a.avatar"]


def test_a_bundle_that_cannot_be_signed_stays(copied, bakery, signer, authority, tmp_path):
    old = authority.signer("old", days=(-9, -1))
    before = {path: path.read_bytes() for path in copied.rglob("*") if path.is_file()}
    one_line(bakery("sign", copied, old.chain, old.key, "--overwrite"), "expired on")
    data = (copied / "face.exr").read_bytes()
    (copied / "face.exr").write_bytes(data[:-1])
    words = "sign", copied, signer.chain, signer.key, "--overwrite"
    one_line(bakery(*words), "face.exr")
    one_line(bakery(*words, "-o", tmp_path / "b.avatar"), "face.exr")
    (copied / "face.exr").write_bytes(data)
    assert before == {path: path.read_bytes() for path in copied.rglob("*") if path.is_file()}
    assert [path.name for path in tmp_path.iterdir()] == ["a.avatar"]


def test_places_are_asked_for_before_anything_is_written(sealed, bundle, bakery, signer, tmp_path):
    keys = signer.chain, signer.key
    done = bakery("sign", sealed / "web" / "neutral.webp", *keys)
    assert done.returncode == 2 and "lies in the bundle" in done.stderr
    taken = tmp_path / "a.png"
    shutil.copyfile(bundle / "preview.png", tmp_path / "b.png")
    taken.write_text("mine")
    one_line(bakery("sign", tmp_path / "b.png", *keys, "-o", taken), "--overwrite replaces it")
    assert taken.read_text() == "mine"
    assert bakery("sign", tmp_path / "b.png", *keys, "-o", taken, "--overwrite").returncode == 0
    assert bakery("verify", taken).returncode == 0
    one_line(bakery("sign", tmp_path / "none.png", *keys), "no such file")
    one_line(bakery("verify", tmp_path / "none.png"), "no such file")
    one_line(bakery("verify", tmp_path), "no bundle")
    one_line(
        bakery("sign", bundle / "face.exr", *keys, "-o", tmp_path / "face.exr"), "cannot carry"
    )


def test_build_signs_what_it_bakes(bakery, portrait, signer, authority, tmp_path):
    out = tmp_path / "a.avatar"
    words = "build", portrait[0], "--landmarks", portrait[1], "-o", out, *FEW
    other = authority.signer("another")
    done = bakery(*words, "--sign", signer.chain, other.key)
    one_line(done, "is not the key of")
    assert not out.exists()
    assert bakery(*words, "--sign", signer.chain, signer.key).returncode == 0
    assert bakery("verify", out, "--trust", signer.anchors).returncode == 0
    assert bakery("verify", out / "preview.png", "--trust", signer.anchors).returncode == 0
    done = bakery(*words, "--sign", signer.chain, signer.key, "--skip-fresh", "--json")
    assert json.loads(done.stdout)["state"] == "fresh", "it would come out the same"
    (out / "avatar.c2pa").unlink()
    done = bakery(*words, "--skip-fresh", "--json")
    assert json.loads(done.stdout)["state"] == "fresh", "without a signature too, if none is wanted"
    assert json.loads(bakery("inspect", out, "--json").stdout)["signature"] == "none"


def test_a_portrait_that_says_it_is_made_by_ai_keeps_its_mark(bakery, portrait, signer, tmp_path):
    """XMP and C2PA of the photo become an ingredient; nothing else of its manifest is taken over."""
    from bakery.formats.signing import library

    c2pa = library()
    pixels = read_photo(portrait[0]).encoded
    plain = encode_image(pixels, ".png")
    given = c2pa.C2paSignerInfo("es256", signer.chain.read_bytes(), signer.key.read_bytes(), None)
    claim = {
        "claim_generator_info": [{"name": "Painter", "version": "3"}], "title": "Ada in Rome.png",
        "assertions": [{"label": "c2pa.actions", "data": {"actions": [
            {"action": "c2pa.created", "digitalSourceType": AI, "when": "2026-01-02T03:04:05Z"}]}}],
    }  # fmt: skip
    photo = tmp_path / "ada.png"
    with open(photo, "w+b") as file:
        marked = with_texts(plain, {PNG_XMP: packet({"Iptc4xmpExt:DigitalSourceType": AI})})
        c2pa.Builder(claim).sign(
            c2pa.Signer.from_info(given), "image/png", io.BytesIO(marked), file
        )
    out = tmp_path / "a.avatar"
    done = bakery(
        "build", photo, "--landmarks", portrait[1], "-o", out, *FEW,
        "--sign", signer.chain, signer.key,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert f"{photo}: says that it is AI-made or synthetic (trainedAlgorithmicMedia)" in done.stderr
    provenance = json.loads((out / "avatar.json").read_text())["provenance"]
    store = jumbf.find_store(photo.read_bytes())
    said = {
        "sha256": jumbf.said(store).sha256,
        "generator": "Painter 3",
        "digitalSourceTypes": [AI],
    }
    assert provenance["ingredients"] == [
        {"sha256": digest_file(photo), "digitalSourceType": AI, "c2pa": said}
    ]
    assert any("AI-made" in note for note in provenance["input"]["notes"])
    assert bakery("validate", out).returncode == 0 and bakery("verify", out).returncode == 0
    for path in out.rglob("*"):
        data = path.read_bytes() if path.is_file() else b""
        assert b"Rome" not in data and b"2026-01-02" not in data, path
    table = json.loads(c2pa.Reader("application/json", (out / "avatar.json").open("rb"),
                                   (out / "avatar.c2pa").read_bytes()).json())  # fmt: skip
    (ingredient,) = table["manifests"][table["active_manifest"]]["ingredients"]
    assert ingredient["instance_id"] == f"urn:sha256:{digest_file(photo)}"
    assert ingredient["relationship"] == "inputTo" and ingredient["description"] == AI


def test_a_portrait_without_a_mark_has_no_ingredient(bundle):
    assert "ingredients" not in json.loads((bundle / "avatar.json").read_text())["provenance"]


def test_without_the_extra_one_line_says_so(bundle, bakery, portrait, tmp_path, monkeypatch):
    import sys

    monkeypatch.setitem(sys.modules, "c2pa", None)
    for words in (
        ("sign", bundle, portrait[0], portrait[0]), ("verify", bundle), ("verify", bundle / "preview.png"),
        ("build", portrait[0], "-o", tmp_path / "a.avatar", "--sign", portrait[0], portrait[0]),
    ):  # fmt: skip
        one_line(bakery(*words), "pip install 'bakery[c2pa]'")
    assert list(tmp_path.iterdir()) == []
