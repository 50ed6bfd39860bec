"""The single steps of a bake take nothing that was made of something else."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from bakery.export.bundle import read_manifest

FEW = Path(__file__).parents[1] / "few.toml"


@pytest.fixture(scope="module")
def steps(bakery, portrait, tmp_path_factory):
    """Fit, textures by the rendered generator, and masks of the painted portrait."""
    photo, marks = portrait
    folder = tmp_path_factory.mktemp("steps")
    small = ["--preset", "small", "--expressions", FEW, "--set", "texture.views=[0.0]"]
    small += ["--set", "bundle.formats=[]", "--hair", "none", "--complete", "none"]
    given = [photo, "--landmarks", marks, *small]
    for command in (
        ["fit", *given, "-o", folder / "f.json"],
        ["texture", *given, "--fit", folder / "f.json", "-o", folder / "t.npz", "--generator",
         "rendered"],
        ["mask", "-o", folder / "m.npz", *small],
    ):  # fmt: skip
        done = bakery(*command)
        assert done.returncode == 0, done.stderr
    return folder, given


def bundled(bakery, steps, out, *more, **files):
    folder, given = steps
    names = {"fit": "f.json", "textures": "t.npz", "masks": "m.npz"}
    paths = {name: files.get(name, folder / file) for name, file in names.items()}
    options = [item for name, path in paths.items() for item in (f"--{name}", path)]
    return bakery("bundle", *given, *options, "-o", out, *more)


def test_a_bundle_says_who_painted_its_textures(bakery, steps, tmp_path):
    """--generator cannot say otherwise."""
    done = bundled(bakery, steps, tmp_path / "a.avatar", "--generator", "pagan")
    assert done.returncode == 0, done.stderr
    said = read_manifest(tmp_path / "a.avatar")["provenance"]
    assert said["generator"] == "rendered"
    assert said["digitalSourceType"].endswith("compositeSynthetic")


def one_line(done, *words):
    assert done.returncode == 1 and len(done.stderr.splitlines()) == 1, done.stderr
    for word in words:
        assert word in done.stderr, done.stderr


def test_a_fit_of_another_head_is_refused(bakery, steps, head, tmp_path):
    from bakery.heads.file import save_head

    folder, given = steps
    save_head(tmp_path / "other.npz", replace(head, mean=head.mean * 1.01))
    other = ["--head", tmp_path / "other.npz"]
    done = bakery("texture", *given, "--fit", folder / "f.json", "-o", tmp_path / "t.npz", *other)
    one_line(done, "a fit of another head", "fit again")
    one_line(bundled(bakery, steps, tmp_path / "a.avatar", *other), "a fit of another head")
    done = bakery("mask", "-o", tmp_path / "m.npz", "--preset", "small", *other)
    assert done.returncode == 0, done.stderr
    done = bundled(bakery, steps, tmp_path / "a.avatar", masks=tmp_path / "m.npz")
    one_line(done, "masks of another head")


def test_textures_of_another_fit_are_refused(bakery, steps, tmp_path):
    folder, given = steps
    table = json.loads((folder / "f.json").read_text())
    table["identity"][0] += 0.5
    (tmp_path / "f.json").write_text(json.dumps(table))
    done = bundled(bakery, steps, tmp_path / "a.avatar", fit=tmp_path / "f.json")
    one_line(done, "painted from another photo, fit or head")
    table["camera"]["width"] += 2
    (tmp_path / "f.json").write_text(json.dumps(table))
    done = bundled(bakery, steps, tmp_path / "a.avatar", fit=tmp_path / "f.json")
    one_line(done, "fit this photo")
    assert not (tmp_path / "a.avatar").exists()


def test_unknown_plug_ins_are_named(bakery, portrait, tmp_path):
    photo, _ = portrait
    for option, known in (("generator", "pagan"), ("detector", "network"), ("hair", "layer")):
        done = bakery("build", photo, "-o", tmp_path / "a", f"--{option}", "nothing", "-n")
        assert done.returncode in (1, 2) and known in done.stderr, done.stderr
