"""`--strict`, both ways: a portrait that warns is refused with it only, one that does not never is."""

import os
from pathlib import Path

import pytest

from bakery.bake import pipeline

SAMPLES = Path(__file__).resolve().parents[2] / "samples"
SMILES, RESTS = "dalia", "bela"  # one sample smiles, which stays in the neutral texture


def build(bakery, name, out, *more):
    """A dry run, which does everything before it would paint."""
    photo = SAMPLES / f"{name}.jpg"
    given = ["--landmarks", photo.with_suffix(".json"), "-n", "-o", out / "a.avatar"]
    done = bakery("build", photo, *given, *more)
    assert os.listdir(out) == []
    return done


def fit(bakery, name, out, *more):
    photo = SAMPLES / f"{name}.jpg"
    given = ["--landmarks", photo.with_suffix(".json"), "-o", out / "fit.json"]
    return bakery("fit", photo, *given, *more)


@pytest.mark.parametrize("name, strict, code", [
    (SMILES, True, 1), (SMILES, False, 0), (RESTS, True, 0), (RESTS, False, 0),
])  # fmt: skip
def test_strict_refuses_what_warns_and_nothing_else(bakery, tmp_path, name, strict, code):
    done = build(bakery, name, tmp_path, *["--strict"] * strict)
    assert done.returncode == code, done.stderr
    lines = done.stderr.splitlines()
    assert len(lines) == (name == SMILES), done.stderr
    if name == SMILES:
        assert "the face is not neutral" in lines[0] and "expression 1." in lines[0]
        assert ("leave out --strict" in lines[0]) == strict
    assert bool(done.stdout) == (code == 0)


def test_strict_refuses_before_anything_is_painted(bakery, tmp_path, monkeypatch):
    """The bake itself, not its dry run: what warns costs no minutes of painting."""
    painted = []
    monkeypatch.setattr(pipeline, "paint", lambda *given: painted.append(given))
    photo = SAMPLES / f"{SMILES}.jpg"
    given = ["--landmarks", photo.with_suffix(".json"), "-o", tmp_path / "a.avatar", "--strict"]
    done = bakery("build", photo, *given)
    assert done.returncode == 1 and "the face is not neutral" in done.stderr
    assert not painted and not (tmp_path / "a.avatar").exists()


@pytest.mark.parametrize("name, strict, code", [
    (SMILES, True, 1), (SMILES, False, 0), (RESTS, True, 0),
])  # fmt: skip
def test_a_strict_fit_is_refused_as_the_bake_is(bakery, tmp_path, name, strict, code):
    done = fit(bakery, name, tmp_path, *["--strict"] * strict)
    assert done.returncode == code, done.stderr
    assert ("the face is not neutral" in done.stderr) == (code == 1)
    assert os.listdir(tmp_path) == (["fit.json"] if code == 0 else [])
