"""The page as a file: nothing in it is markup but what the project wrote; bad bundles are refused."""

import base64
import hashlib
import json
import re
import shutil
import threading
import urllib.error
import urllib.request

import pytest

from bakery.errors import BundleError, InputError
from bakery.export.schema import seal
from bakery.formats.files import digest
from bakery.show.page import page, plain
from bakery.show.serve import make_server

LEGAL_TYPES = {None, "application/json", "application/octet-stream"}


@pytest.fixture
def copy(bundle, tmp_path):
    return shutil.copytree(bundle, tmp_path / "copy.avatar")


def change(folder, name, alter):
    """Alter a JSON file of a bundle and keep the manifest's hashes right, as a forger would."""
    table = json.loads((folder / name).read_text())
    alter(table)
    data = seal(table) if name == "avatar.json" else json.dumps(table).encode()
    (folder / name).write_bytes(data)
    if name != "avatar.json":
        manifest = json.loads((folder / "avatar.json").read_text())
        for entry in manifest["files"]:
            if entry["path"] == name:
                entry.update(bytes=len(data), sha256=digest(data))
        (folder / "avatar.json").write_bytes(seal(manifest))


def scripts(text):
    """(type, id, content) of every script element."""
    found = re.findall(r"<script([^>]*)>(.*?)</script>", text, re.S)
    for attributes, content in found:
        table = dict(re.findall(r'(\w+)="([^"]*)"', attributes))
        yield table.get("type"), table.get("id"), content


def test_only_our_script_and_style_may_run(bundle):
    text = page(bundle).decode()
    policy = re.search(r'http-equiv="Content-Security-Policy" content="([^"]*)"', text)[1]
    rules = dict(rule.split(" ", 1) for rule in policy.split("; "))
    assert rules["default-src"] == "'none'" and rules["connect-src"] == "'none'"
    assert "unsafe" not in policy and "*" not in policy and "http" not in policy
    (script,) = [content for kind, _, content in scripts(text) if kind is None]
    (style,) = re.findall(r"<style>(.*?)</style>", text, re.S)
    for rule, content in (("script-src", script), ("style-src", style)):
        sha = base64.b64encode(hashlib.sha256(content.encode()).digest()).decode()
        assert rules[rule] == f"'sha256-{sha}'"
    assert not re.search(r"<[^>]+\son\w+=", text.replace(script, "")), "no handlers in markup"
    assert not re.search(r'(src|href)="(?!data:,|#)', text.replace(script, "")), "no other files"


def test_it_holds_the_bundle(bundle):
    text = page(bundle).decode()
    found = {name: (kind, content) for kind, name, content in scripts(text)}
    assert {kind for kind, _ in found.values()} <= LEGAL_TYPES
    description = json.loads(found["description"][1])
    assert len(description["expressions"]) == 52
    for atlas in description["atlases"].values():
        kept = base64.b64decode(found["file:" + atlas["file"]][1])
        assert kept == (bundle / "web" / atlas["file"]).read_bytes()
    about = json.loads(found["page"][1])
    assert len(about["named"]) == 10 and about["watch"] is None
    assert page(bundle) == page(bundle), "the same bytes twice"


def test_hostile_text_is_refused_and_would_stay_text(copy, monkeypatch):
    nasty = "</script><script>alert(1)</script><!-- \u202egnp.\u2066 & \u2028"
    change(copy, "avatar.json", lambda table: table["head"].update(name=nasty))
    with pytest.raises(BundleError, match="head/name"):
        page(copy)
    monkeypatch.setattr("bakery.show.page.problems", lambda folder: [])
    monkeypatch.setattr("bakery.export.hostile.table_problems", lambda manifest: [])
    text = page(copy).decode()
    assert text.count("</script>") == len(list(scripts(text)))
    assert "alert(1)" not in text.replace("\\u003e", "").split("<script>")[-1].split("</script>")[0]
    about = json.loads(next(content for _, name, content in scripts(text) if name == "page"))
    shown = dict(map(tuple, about["facts"]))["Head"]
    assert shown == "</script><script>alert(1)</script><!-- gnp. &"


def test_plain_names():
    assert plain("a\u202eb\nc\x00d\u200fe\tf") == "abcdef"
    assert plain("  two   words ") == "two words"
    assert len(plain("x" * 500)) == 80
    assert plain("\u5f15 \u05d0\u05d1 na\u00efve") == "\u5f15 \u05d0\u05d1 na\u00efve"


def traversal(table):
    table["atlases"]["neutral"]["file"] = "../photo.png"


def unlisted(table):
    table["atlases"]["neutral"]["file"] = "other.webp"


def infinite(table):
    table["lips"]["rest"][3] = float("nan")


def huge(table):
    table["atlases"]["mouths"]["columns"] = 10**9


def key_name(table):
    table["keys"][0]["name"] = "</script>"


@pytest.mark.parametrize("alter", [traversal, unlisted, infinite, huge, key_name])
def test_forged_descriptions_are_refused(copy, alter):
    change(copy, "web/avatar.json", alter)
    with pytest.raises(BundleError, match=r"web/avatar.json: .*; bake it again"):
        page(copy)


def test_links_and_changed_files_are_refused(copy, tmp_path):
    (tmp_path / "away").mkdir()
    shutil.move(copy / "web", tmp_path / "away" / "web")
    (copy / "web").symlink_to(tmp_path / "away" / "web")
    with pytest.raises(BundleError, match="link"):
        page(copy)
    (copy / "web").unlink()
    shutil.move(tmp_path / "away" / "web", copy / "web")
    page(copy)
    data = bytearray((copy / "web" / "neutral.webp").read_bytes())
    data[-1] ^= 1
    (copy / "web" / "neutral.webp").write_bytes(data)
    with pytest.raises(BundleError, match="SHA-256"):
        page(copy)


def test_older_bundles_get_their_web_files_made(copy):
    manifest = json.loads((copy / "avatar.json").read_text())
    kept = [one for one in manifest["files"] if one["path"] not in ("web/avatar.json",)]
    (copy / "avatar.json").write_bytes(seal(manifest | {"files": kept}))
    (copy / "web" / "avatar.json").rename(copy.parent / "description")
    files = {f"web/{p.name}": p.read_bytes() for p in (copy / "web").iterdir()}
    files["web/avatar.json"] = (copy.parent / "description").read_bytes()
    with pytest.raises(BundleError, match=r"lacks web/avatar.json; bake it again"):
        page(copy)
    assert b'id="description"' in page(copy, derive=lambda folder: files)


def read(address, host=None):
    request = urllib.request.Request(address, headers={"Host": host} if host else {})
    with urllib.request.urlopen(request, timeout=10) as answer:
        return answer.read().decode()


def test_server_shows_a_new_bake(copy):
    server = make_server(copy, 0)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    home = f"http://127.0.0.1:{server.server_address[1]}"
    try:
        token = read(home + "/version")
        assert f'"watch":"{token}"' in read(home + "/")
        assert "connect-src 'self'" in read(home + "/")
        with pytest.raises(urllib.error.HTTPError, match="403"):
            read(home + "/", host="elsewhere.example")
        with pytest.raises(urllib.error.HTTPError, match="404"):
            read(home + "/web/neutral.webp")
        change(copy, "avatar.json", lambda table: table["head"].update(name="other"))
        newer = read(home + "/version")
        assert newer != token and '"other"' in read(home + "/")
        with pytest.raises(InputError, match="give another --port"):
            make_server(copy, server.server_address[1])
        (copy / "avatar.json").write_text("{")
        assert read(home + "/version") == newer, "a broken bundle leaves the last page"
    finally:
        server.shutdown()


def test_module_for_a_page_of_ones_own(bakery, bundle, tmp_path):
    done = bakery("preview", bundle, "--module", tmp_path / "site")
    assert done.returncode == 0, done.stderr
    written = {path.relative_to(tmp_path / "site").as_posix() for path in tmp_path.rglob("*.*")}
    assert {
        "avatar.js",
        "avatar.d.ts",
        "index.html",
        "web/avatar.json",
        "web/player.glb",
    } <= written
    again = bakery("preview", bundle, "--module", tmp_path / "site")
    assert again.returncode == 1 and "holds files already" in again.stderr
    assert bakery("preview", bundle).returncode == 2
    assert bakery("preview", bundle, "--serve", "-o", tmp_path / "x.html").returncode == 2
