"""`detect`, `fit` and `segment` with `--preview`: files and folders, what is kept, what is refused."""

import os
import re
import shutil
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from bakery.stages.segment import LABELS

SAMPLE = Path(__file__).resolve().parents[2] / "samples" / "anna.jpg"


@pytest.mark.parametrize(
    "command, out", [("detect", "a.json"), ("fit", "a.json"), ("segment", "a.png")]
)
def test_a_picture_beside_the_result(bakery, tmp_path, command, out):
    ask = [command, SAMPLE, "-o", tmp_path / out, "--preview", tmp_path / "seen.jpg"]
    assert bakery(*ask, "-n").returncode == 0 and os.listdir(tmp_path) == []
    done = bakery(*ask)
    assert done.returncode == 0, done.stderr
    seen = np.asarray(Image.open(tmp_path / "seen.jpg"))
    assert seen.shape[2] == 3 and min(seen.shape[:2]) > 800
    (tmp_path / out).unlink()
    again = bakery(*ask)
    assert again.returncode == 1 and "seen.jpg" in again.stderr and "--overwrite" in again.stderr
    assert not (tmp_path / out).exists()
    assert bakery(*ask[:3], tmp_path / out, "--preview", tmp_path / out).returncode == 2
    assert bakery(*ask[:3], tmp_path / out, "--preview", "-").returncode == 2
    assert bakery(*ask[:3], tmp_path / out, "--preview", tmp_path / "x.tif").returncode == 2
    assert os.listdir(tmp_path) == ["seen.jpg"]


def test_folders(bakery, portrait, tmp_path):
    """One picture a photo; one bad photo does not stop the others."""
    photo, points = portrait
    photos = tmp_path / "photos"
    photos.mkdir()
    for name in ("one", "two"):
        shutil.copy(photo, photos / f"{name}.png")
        shutil.copy(points, photos / f"{name}.json")
    (photos / "bad.png").write_bytes(b"x")
    every = sorted(photos.glob("*.png"))
    for command, ending in (("fit", "json"), ("segment", "png")):
        out, seen = tmp_path / command, tmp_path / f"{command}-seen"
        done = bakery(command, *every, "--landmarks", photos, "-o", out, "--preview", seen)
        assert done.returncode == 1 and "bad.png" in done.stderr
        assert sorted(os.listdir(out)) == [f"one.{ending}", f"two.{ending}"]
        assert sorted(os.listdir(seen)) == ["one.png", "two.png"]
    done = bakery("segment", *every, "-o", tmp_path / "new", "--preview", tmp_path / "new")
    assert done.returncode == 2, "labels and overlays would have the same names"


def test_labels_are_those_of_the_help(bakery, portrait, tmp_path):
    """The help's table is the order of LABELS, and the file's indices are labels."""
    said = " ".join(bakery("segment", "--help").stdout.split())
    assert [name for _, name in re.findall(r"\b(\d+) ([a-z]+)[ ,(]", said)][: len(LABELS)] == list(
        LABELS
    )
    photo, points = portrait
    done = bakery("segment", photo, "--landmarks", points, "-o", tmp_path / "labels.png")
    assert done.returncode == 0, done.stderr
    picture = Image.open(tmp_path / "labels.png")
    labels = np.asarray(picture)
    assert picture.mode == "P" and labels.shape == (480, 400)
    assert labels[230, 200] == LABELS.index("skin") and labels[5, 5] == LABELS.index("background")
