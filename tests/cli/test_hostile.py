"""Bundles that mean harm: refused by every reader in one line, before a pixel is opened."""

import hashlib
import io
import json
import os
import shutil
import zipfile
import zlib

import numpy as np
import OpenEXR
import pytest

from bakery.errors import BundleError
from bakery.export import hostile, schema
from bakery.export.open import open_avatar
from bakery.export.validate import problems
from bakery.formats import exr
from bakery.formats.files import digest


@pytest.fixture
def copy(bundle, tmp_path):
    return shutil.copytree(bundle, tmp_path / "copy.avatar")


def rewrite(folder, change):
    """Change the manifest as its author can: everything in it fits together again."""
    path = folder / "avatar.json"
    manifest = json.loads(path.read_text())
    change(manifest)
    path.write_bytes(schema.seal(manifest))


def swap(folder, name, data):
    """Put other bytes in a file's place, with the right size and hash."""
    (folder / name).write_bytes(data)

    def change(manifest):
        for entry in manifest["files"]:
            if entry["path"] == name:
                entry |= {"bytes": len(data), "sha256": hashlib.sha256(data).hexdigest()}

    rewrite(folder, change)


def listed(path):
    """List one more file, by any path, with the right size and hash."""

    def change(folder):
        victim = folder.parent / "secret.txt"
        victim.write_text("secret")
        entry = {"path": path, "role": "web", "bytes": 6}
        entry["sha256"] = hashlib.sha256(b"secret").hexdigest()
        rewrite(folder, lambda manifest: manifest["files"].append(entry))

    return change


def linked(folder):
    target = folder.parent / "elsewhere.exr"
    (folder / "mouth.exr").rename(target)
    (folder / "mouth.exr").symlink_to(target)


def linked_folder(folder):
    (folder / "web").rename(folder.parent / "elsewhere")
    (folder / "web").symlink_to(folder.parent / "elsewhere")


def pipe(folder):
    (folder / "coverage.exr").unlink()
    os.mkfifo(folder / "coverage.exr")


def huge_exr(folder):
    """A header of 100,000 x 100,000 texels over the data of four."""
    buffer = io.BytesIO()
    channels = {"RGB": OpenEXR.Channel(np.zeros((2, 2, 3), np.float16))}
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    OpenEXR.File([OpenEXR.Part(header, channels, "neutral")]).write(buffer)
    data = bytearray(buffer.getvalue())
    for name in (b"dataWindow\0", b"displayWindow\0"):
        at = data.find(name) + len(name) + len(b"box2i\0") + 4
        data[at : at + 16] = np.array([0, 0, 99_999, 99_999], "<i4").tobytes()
    swap(folder, "face.exr", bytes(data))


def huge_png(folder):
    """A PNG header of 60,000 x 60,000 pixels."""

    def chunk(kind, body):
        return (
            len(body).to_bytes(4, "big") + kind + body + zlib.crc32(kind + body).to_bytes(4, "big")
        )

    size = (60_000).to_bytes(4, "big")
    head = chunk(b"IHDR", size + size + b"\x08\x02\0\0\0")
    data = (
        b"\x89PNG\r\n\x1a\n"
        + head
        + chunk(b"IDAT", zlib.compress(b"\0" * 100))
        + chunk(b"IEND", b"")
    )
    swap(folder, "photo.png", data)


def bomb(folder):
    """An npz whose directory promises 1 GiB."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("mean.npy", bytes(100))
    data = bytearray(buffer.getvalue())
    at = data.find(b"PK\x01\x02") + 24
    data[at : at + 4] = (2**30).to_bytes(4, "little")
    swap(folder, "head.npz", bytes(data))


def text(place, value):
    def change(folder):
        def edit(manifest):
            table = manifest
            for step in place[:-1]:
                table = table[step]
            table[place[-1]] = value

        rewrite(folder, edit)

    return change


def raw(old, new):
    def change(folder):
        path = folder / "avatar.json"
        data = path.read_text()
        assert old in data
        stated = json.loads(data)["sha256"]
        blank = data.replace(old, new, 1).replace(stated, schema.BLANK)
        path.write_text(blank.replace(schema.BLANK, digest(blank.encode())))

    return change


CASES = {
    "traversal": (listed("../secret.txt"), "does not match"),
    "absolute": (listed("/etc/hostname"), "does not match"),
    "backslash": (listed("..\\secret.txt"), "does not match"),
    "device": (listed("C:secret.txt"), "does not match"),
    "dots inside": (listed("web/../../secret.txt"), "does not match"),
    "link": (linked, "mouth.exr: a link"),
    "folder link": (linked_folder, "a link"),
    "pipe": (pipe, "coverage.exr: not a plain file"),
    "wrong hash": (lambda f: (f / "face.exr").write_bytes(bytes(99)), "face.exr: 99 bytes"),
    "huge texture": (huge_exr, "claims 100000x100000 texels"),
    "huge photo": (huge_png, "far more than 64 megapixels"),
    "npz bomb": (bomb, "unpacks to 1024 MiB"),
    "script": (text(("head", "name"), "</script><script>alert(1)</script>"), "head/name: .*markup"),
    "script in a key": (
        text(("provenance", "licences", "<img src=x onerror=alert(1)>"), "MIT"), "markup"
    ),
    "right to left": (text(("keys", 0, "name"), "smile\u202egnp.exe"), "keys/0/name: .*U\\+202E"),
    "isolate": (text(("provenance", "generator"), "a\u2066b"), "U\\+2066"),
    "null": (text(("provenance", "generator"), "a\0b"), "U\\+0000"),
    "line break": (text(("provenance", "generator"), "a\nb"), "U\\+000A"),
    "nan": (raw('"jawOpen": ', '"jawOpen": NaN, "jawLeft": '), "not valid JSON"),
    "infinite": (text(("gaze", "directions", 0), [0, "INF"]), "INF"),
    "overflow": (raw('"focal": ', '"focal": 1e999, "was": '), "fit/camera/focal: .*not finite"),
    "huge weight": (text(("keys", 0, "weights", "jawOpen"), 1e30), "greater than the maximum"),
    "huge integer": (text(("provenance", "input", "width"), 10**30), "beyond 2\\^53"),
}  # fmt: skip


@pytest.mark.parametrize("case", CASES)
def test_refused_before_a_pixel_is_opened(copy, case, monkeypatch):
    import re

    change, message = CASES[case]
    change(copy)

    def opened(*_):
        raise AssertionError("a pixel was opened")

    monkeypatch.setattr(exr, "_picture", opened)
    monkeypatch.setattr("cv2.imdecode", opened)
    monkeypatch.setattr("numpy.load", opened)
    found = problems(copy)
    assert any(re.search(message, line) for line in found), found
    with pytest.raises(Exception) as caught:
        open_avatar(copy)
    assert isinstance(caught.value, BundleError) or "not valid JSON" in str(caught.value)
    assert re.search(message, str(caught.value)), caught.value
    assert "a pixel was opened" not in str(caught.value)


def test_commands_refuse_in_one_printable_line(copy, bakery, tmp_path):
    text(("keys", 0, "name"), "smile\u202egnp.exe")(copy)
    take = tmp_path / "take.csv"
    take.write_text("Timecode\n")
    for command in (
        ["render", copy, "-o", tmp_path / "a.png"],
        ["animate", copy, "--curves", take, "-o", tmp_path / "a.webm"],
        ["inspect", copy],
        ["validate", copy],
    ):
        done = bakery(*command)
        assert done.returncode == 1 and "Traceback" not in done.stderr
        assert len(done.stderr.splitlines()) == 1
        assert "\u202e" not in done.stdout + done.stderr
    assert sorted(path.name for path in tmp_path.iterdir()) == ["copy.avatar", "take.csv"]


def test_ordinary_names_pass():
    for name in ("José Ångström", "名前", "O'Neil & Sons", "smile (wide)", "مرحبا", "e\u0301"):
        assert hostile.text_problem(name) is None
    assert list(hostile.table_problems({"a": [1, 0.5, "x", {"b": None, "c": True}]})) == []
    deep = []
    for _ in range(40):
        deep = [deep]
    assert "deep" in next(hostile.table_problems(deep))
