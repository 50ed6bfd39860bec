"""`bakery export`: a bundle in each format; the formats that a preset names."""

import json
from pathlib import Path

import numpy as np
import pytest

from bakery.export import bundle as bundles
from bakery.export.validate import problems
from bakery.formats.files import digest_file
from bakery.plugins import known, plug_in
from bakery.testing import check_exporter

FEW = Path(__file__).parents[1] / "few.toml"


# Their own tests read what these write; written twice they take 5 s each.
LONG = {"glb-full", "glb-lit", "glb-speech", "usd", "vrm", "textures-acescg"}


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(x, marks=pytest.mark.slow) if x in LONG else x
        for x in sorted(known("exporters"))
    ],
)
def test_every_exporter_keeps_its_contract(name, avatar):
    if name == "usd":
        pytest.importorskip("pxr", reason="needs usd-core, the extra usd")
    check_exporter(plug_in("exporters", name), avatar)


def described(path):
    """The JSON of a GLB file without offsets and lengths."""
    data = path.read_bytes()
    table = json.loads(data[20 : 20 + int.from_bytes(data[12:16], "little")])
    return {key: table[key] for key in ("meshes", "nodes", "scenes", "materials")}


def same_picture(one, other):
    from bakery.formats.image import read_photo

    apart = np.abs(read_photo(one).encoded - read_photo(other).encoded)
    return apart.mean() < 0.5 / 255


def same_head(one, other):
    from bakery.heads.file import load_head

    return load_head(one).digest == load_head(other).digest


@pytest.mark.parametrize(
    "name, file, same",
    [
        ("glb", "head.glb", lambda a, b: described(a) == described(b)),
        ("proxies", "proxies.glb", lambda a, b: described(a) == described(b)),
        ("preview", "preview.png", same_picture),
        ("head", "head.npz", same_head),
    ],
)
def test_an_exported_file_is_like_the_bundles_own(bakery, bundle, tmp_path, name, file, same):
    """Not to the bit: head.npz, from which a bundle is opened, rounds its shapes to half floats."""
    out = tmp_path / file
    done = bakery("export", bundle, "--format", name, "-o", out, "--side", 512)
    assert done.returncode == 0, done.stderr
    assert same(out, bundle / file)
    done = bakery("export", bundle, "--format", name, "-o", out)
    assert done.returncode == 1 and "--overwrite" in done.stderr


@pytest.mark.parametrize("name", ["exr", "web"])
def test_exported_folders(bakery, bundle, tmp_path, name):
    done = bakery("export", bundle, "--format", name, "-o", tmp_path / "out")
    assert done.returncode == 0, done.stderr
    made = {path.name for path in (tmp_path / "out").iterdir()}
    assert made == (
        {path.name for path in bundle.glob("*.exr")}
        if name == "exr"
        else {path.name for path in (bundle / "web").iterdir()}
    )
    if name == "exr":
        assert all(
            (tmp_path / "out" / file).read_bytes() == (bundle / file).read_bytes() for file in made
        )
    done = bakery("export", bundle, "--format", name, "-o", tmp_path / "out")
    assert done.returncode == 1 and "holds files already" in done.stderr


def test_wrong_formats_and_names(bakery, bundle, tmp_path):
    done = bakery("export", bundle, "--format", "gbl", "-o", tmp_path / "a.glb")
    assert done.returncode == 2 and "did you mean 'glb'?" in done.stderr
    done = bakery("export", bundle, "--format", "glb", "-o", tmp_path / "a.obj")
    assert done.returncode == 2 and ".glb" in done.stderr
    assert list(tmp_path.iterdir()) == []


def test_a_bundle_of_the_formats_that_a_preset_names_with_consent(bakery, portrait, tmp_path):
    photo, marks = portrait
    out, text = tmp_path / "a.avatar", tmp_path / "consent.txt"
    text.write_text("I agree that an avatar of me\nis made and shown. Ada, 2 May\n")
    done = bakery(
        "build", photo, "--landmarks", marks, "-o", out, "--preset", "small", "--generator",
        "rendered", "--expressions", FEW, "--set", "texture.views=[0.0]",
        "--set", 'bundle.formats=["preview"]', "--hair", "none", "--complete", "none",
        "--consent", text,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert (out / "preview.png").is_file()
    assert not (out / "head.glb").exists() and not (out / "web").exists()
    manifest = bundles.read_manifest(out)
    assert manifest["lods"] == [] and "web" not in manifest
    for command in (["validate"], ["inspect"], ["preview", "-o", tmp_path / "a.html"],
                    ["render", "-o", tmp_path / "a.png", "--size", "64"]):  # fmt: skip
        done = bakery(command[0], out, *command[1:])
        assert done.returncode == 0, (command, done.stderr)
    done = bakery("build", photo, "-o", tmp_path / "b", "--set", 'bundle.formats=["usdd"]', "-n")
    assert done.returncode == 2 and "usdd" in done.stderr, done.stderr
    manifest = (out / "avatar.json").read_text()
    assert json.loads(manifest)["asset"]["version"] == "1.1"
    consent = json.loads(manifest)["provenance"]["consent"]
    assert consent["statement"] == "I agree that an avatar of me is made and shown. Ada, 2 May"
    assert consent["sha256"] == digest_file(text) and problems(out) == []
    assert str(tmp_path) not in manifest and "I agree" in bakery("inspect", out).stdout
