"""`--same-person`: several photos, one identity, one bundle."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from bakery.export.bundle import read_manifest
from bakery.export.open import open_avatar
from bakery.stages.texture.complete import OBSERVED

FEW = Path(__file__).parents[1] / "few.toml"
QUICK = [
    "--preset", "small", "--expressions", FEW, "--set", "texture.views=[0.0]",
    "--generator", "rendered", "--set", "bundle.formats=[]",
]  # fmt: skip


@pytest.fixture(scope="module")
def photos(portrait, aside, tmp_path_factory):
    """A folder of both photos and their landmarks, and the photos."""
    place = tmp_path_factory.mktemp("ada")
    for photo, marks in (portrait, aside):
        shutil.copy(photo, place)
        shutil.copy(marks, place)
    return place, place / "aside.png", place / "painted.png"


def test_fits_share_identity_and_warp(bakery, photos, tmp_path):
    place, *both = photos
    done = bakery("fit", *both, "--landmarks", place, "--same-person", "-o", tmp_path / "fits")
    assert done.returncode == 0, done.stderr
    assert "painted.png: leads" in done.stderr and "differ" not in done.stderr
    side, front = (
        json.loads((tmp_path / "fits" / f"{name}.json").read_text())
        for name in ("aside", "painted")
    )
    assert side["identity"] == front["identity"] and side["residual"] == front["residual"]
    assert abs(side["diagnostics"]["yaw"] - front["diagnostics"]["yaw"] - 40) < 3
    one = tmp_path / "one.json"
    done = bakery("fit", *both, "--landmarks", place, "--same-person", "-o", one)
    assert done.returncode == 0, done.stderr
    found = json.loads(one.read_text())
    assert found["camera"] == front["camera"] and found["identity"] == front["identity"]


@pytest.mark.parametrize("command, output", [("fit", "one.json"), ("build", "one.avatar")])
def test_what_is_refused(bakery, photos, tmp_path, command, output):
    place, first, _ = photos
    given = ["--landmarks", place, "--same-person", "-o", tmp_path / output]
    done = bakery(command, first, *given)
    assert done.returncode == 2 and "two photos or more" in done.stderr
    copy = tmp_path / "aside.png"
    shutil.copy(first, copy)
    done = bakery(command, first, copy, *given)
    assert done.returncode == 1 and "the same photo twice" in done.stderr
    assert "Traceback" not in done.stderr
    assert not (tmp_path / output).exists()


@pytest.mark.slow
def test_one_bundle_that_knows_both_sides(bakery, bundle, photos, tmp_path):
    """Beside the bundle of one photo; generators, which differ, have no part in these textures."""
    place, *both = photos
    alone, out = bundle, tmp_path / "ada.avatar"
    # A name that ends in .avatar is one bundle, whether --same-person is said or not.
    done = bakery("build", *both, "--landmarks", place, "-o", out, *QUICK)
    assert done.returncode == 0, done.stderr
    assert bakery("validate", out).returncode == 0
    seen = [(open_avatar(bundle).textures.source == OBSERVED).sum() for bundle in (alone, out)]
    assert seen[1] > 1.05 * seen[0]  # the turned photo shows a cheek and an ear
    camera = read_manifest(out)["fit"]["camera"]  # the frontal photo leads
    assert np.abs(camera["rotation"]).max() < 0.1
    textures = [open_avatar(bundle).textures.neutral.astype(float) for bundle in (alone, out)]
    # Light of the turned photo is 0.7 of the other's: no patch of it shows.
    brightness = [np.median(texture[texture > 0.01]) for texture in textures]
    assert abs(brightness[1] / brightness[0] - 1) < 0.1
