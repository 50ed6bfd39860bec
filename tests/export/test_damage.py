"""Every flipped byte of a bundle is found, whatever a file says; nothing hangs, nothing crashes."""

import copy as copies
import json
import os

import numpy as np
import pytest

from bakery.errors import BakeryError
from bakery.export import bundle as bundles
from bakery.export import hostile, validate
from bakery.export.schema import seal
from bakery.export.validate import problems
from bakery.export.validate_glb import glb_problems
from bakery.formats.files import digest
from bakery.heads.base import PROXIES


def is_noticed(folder):
    """Whether the manifest is refused, by the function that players and `validate` begin with."""
    try:
        return bool(bundles.check_manifest(folder)[1])
    except BakeryError as error:
        return "\n" not in str(error)


def test_every_byte_of_the_manifest_counts(copy):
    """Its line ends, its digest and 2,000 bytes more, each changed to any other byte."""
    path = copy / "avatar.json"
    data = path.read_bytes()
    rng = np.random.default_rng(0)
    lines = [at for at, byte in enumerate(data) if byte == ord("\n")]
    ends = range(len(data) - 80, len(data))
    places = {*lines, *ends, *rng.choice(len(data), 2000, replace=False).tolist()}
    for at in sorted(places):
        other = bytes([(data[at] + int(rng.integers(1, 256))) % 256])
        path.write_bytes(data[:at] + other + data[at + 1 :])
        assert is_noticed(copy), (at, data[at : at + 1], other)
    for more in (data + b"\n", data[:-1], b" " + data, data.replace(b": ", b":", 1)):
        path.write_bytes(more)
        assert is_noticed(copy)
    path.write_bytes(data)
    assert not is_noticed(copy)


@pytest.mark.parametrize("stated", [r"\ud800", "x", "", 5, None, [], {"a": 1}])
def test_a_digest_of_another_kind_is_a_finding(copy, stated):
    """Half a letter, as JSON can hold it, too."""
    path = copy / "avatar.json"
    manifest = json.loads(path.read_bytes())
    text = json.dumps(manifest | {"sha256": stated}).replace("\\\\ud800", "\\ud800")
    path.write_text(text)
    found = problems(copy)
    assert found and not any("\n" in line for line in found)


def test_the_digest_as_another_program_computes_it(bundle):
    """What the schema's description says, in three lines."""
    data = (bundle / "avatar.json").read_text(encoding="utf-8")
    stated = json.loads(data)["sha256"]
    assert digest(data.replace(stated, "0" * 64).encode()) == stated
    assert data.count(stated) == 1


def test_every_file_but_the_manifest_is_in_its_list(bundle):
    listed = {entry["path"] for entry in bundles.read_manifest(bundle)["files"]}
    found = {p.relative_to(bundle).as_posix() for p in bundle.rglob("*") if p.is_file()}
    assert found - listed == {"avatar.json"} and listed <= found


def test_every_byte_of_the_other_files_counts(copy):
    rng = np.random.default_rng(1)
    for entry in bundles.read_manifest(copy)["files"]:
        path = copy / entry["path"]
        data = path.read_bytes()
        for at in (0, len(data) - 1, *rng.integers(0, len(data), 4).tolist()):
            path.write_bytes(data[:at] + bytes([data[at] ^ 1]) + data[at + 1 :])
            assert "SHA-256" in hostile.file_problem(copy, entry), (entry["path"], at)
        path.write_bytes(data)


# A preset may leave these formats out; what is for browsers can be derived.
OPTIONAL = ("proxies.glb", "preview.png", "web/avatar.json")


def test_each_needed_file_is_asked_for(copy):
    """A manifest that does not list a file that players open is no whole bundle."""
    manifest = json.loads((copy / "avatar.json").read_text())
    for entry in manifest["files"][::2]:
        name = entry["path"]
        if name in OPTIONAL:
            continue
        less = manifest | {"files": [one for one in manifest["files"] if one is not entry]}
        (copy / name).rename(copy.parent / "away")
        (copy / "avatar.json").write_bytes(seal(less))
        assert any(name in line for line in problems(copy)), name
        (copy.parent / "away").rename(copy / name)


def swap(folder, name, data):
    """Put other bytes in a file's place, as its author can."""
    (folder / name).write_bytes(data)
    manifest = json.loads((folder / "avatar.json").read_text())
    for entry in manifest["files"]:
        if entry["path"] == name:
            entry |= {"bytes": len(data), "sha256": digest(data)}
    (folder / "avatar.json").write_bytes(seal(manifest))


def test_the_head_is_opened(copy, bakery, tmp_path):
    """Its hash being right does not make it a head model."""
    data = (copy / "head.npz").read_bytes()
    swap(copy, "head.npz", data.replace(b"mean.npy", b"mead.npy"))
    (found,) = problems(copy)
    assert found.startswith("head.npz: ") and "\n" not in found
    done = bakery("render", copy, "-o", tmp_path / "a.png")
    assert done.returncode == 1 and len(done.stderr.splitlines()) == 1


@pytest.mark.parametrize("name", ["head.glb", "proxies.glb", "web/player.glb"])
def test_names_of_shapes_that_are_no_list(copy, glb, name):
    split, join = glb
    document, rest = split((copy / name).read_bytes())
    manifest = bundles.read_manifest(copy)
    for wrong in (5, None, "jawOpen", [5] * 52, {}, [[]] * 52):
        document["meshes"][0]["extras"]["targetNames"] = wrong
        swap(copy, name, join(document, rest))
        (found,), _ = validate._content_problems(copy / name, name, manifest)
        assert found.startswith(f"{name}: ") and "\n" not in found
    assert problems(copy) == [found]


WRONG = [None, True, 5, -1, 2**70, 1e308, "x", [], {}, [[]], {"a": None}]


def places_in(value, at=()):
    """Paths to all that stands in a document."""
    yield at
    items = value.items() if isinstance(value, dict) else enumerate(value)
    for key, entry in items:
        yield (*at, key)
        if isinstance(entry, (dict, list)):
            yield from places_in(entry, (*at, key))


def test_malformed_descriptions_of_glb_are_findings(bundle, glb):
    """Anything in the place of anything: a list of lines, never an error."""
    split, join = glb
    document, rest = split((bundle / "proxies.glb").read_bytes())
    assert glb_problems("a", join(document, rest), PROXIES, 1) == []
    places = sorted(set(places_in(document)) - {()}, key=str)
    structure = [at for at in places if len(at) < 4]
    rng = np.random.default_rng(2)
    chosen = rng.choice(len(places), 200, replace=False).tolist()
    for at in [*structure[:: max(1, len(structure) // 300)], *(places[k] for k in chosen)]:
        broken = copies.deepcopy(document)
        table = broken
        for step in at[:-1]:
            table = table[step]
        table[at[-1]] = WRONG[int(rng.integers(len(WRONG)))]
        found = glb_problems("a", join(broken, rest), PROXIES, 1)
        assert all(isinstance(line, str) and "\n" not in line for line in found)
    deep = b'{"meshes": ' + b"[" * 100_000
    deep += b" " * (-len(deep) % 4)
    for text in (deep, b"[]  ", b"5   ", b'"ab"', b"\xff\xfe\xfd\xfc"):
        whole = join({}, rest)
        start = whole[:8] + (20 + len(text) + len(rest)).to_bytes(4, "little")
        data = start + len(text).to_bytes(4, "little") + b"JSON" + text + rest
        assert glb_problems("a", data, PROXIES, 1) == ["a: its description is damaged"]


def test_cut_glb(bundle):
    data = (bundle / "proxies.glb").read_bytes()
    for size in (0, 3, 11, 20, 27, 100, len(data) - 1):
        assert len(glb_problems("a", data[:size], PROXIES, 1)) == 1


@pytest.mark.parametrize("name", ["avatar.json", "face.exr", "head.npz", "web/avatar.json"])
def test_pipes_do_not_hang(copy, bakery, name, tmp_path):
    (copy / name).unlink()
    os.mkfifo(copy / name)
    for command in (["validate", copy], ["inspect", copy], ["render", copy, "-o", tmp_path / "a"]):
        done = bakery(*command, timeout=60)
        whole = command[0] == "inspect" and name in ("head.npz", "web/avatar.json")
        assert done.returncode == (0 if whole else 1), (command, done.stderr)
        assert len(done.stderr.splitlines()) == (0 if whole else 1), done.stderr


def test_inspect_of_a_bundle_without_its_face(copy, bakery):
    (copy / "face.exr").unlink()
    done = bakery("inspect", copy)
    assert done.returncode == 1 and len(done.stderr.splitlines()) == 1
    assert "face.exr: no such file" in done.stderr


def test_a_finding_about_a_name_without_end_is_short(copy):
    """One line that a terminal can show, whatever its author wrote (found by the fuzzer)."""
    name = "web/avatar.json"
    table = json.loads((copy / name).read_text())
    next(iter(table["atlases"].values()))["file"] = "x" * 5000 + ".png"
    swap(copy, name, json.dumps(table).encode())
    (line,) = problems(copy)
    assert line.startswith(f"{name}: names web/xxx") and len(line) < 400
