"""The commands at their edges: names, exit codes, what is on stdout and stderr."""

import json
import os
import shutil
import subprocess
import sys

import numpy as np
import pytest


def _spent():
    """Seconds of processor time of processes that have ended; the wall clock of a busy machine says nothing."""
    return sum(os.times()[2:4])


def test_help_is_quick():
    quickest = 9.0
    for _ in range(5):
        before = _spent()
        subprocess.run([sys.executable, "-m", "bakery", "--help"], capture_output=True, check=True)
        quickest = min(quickest, _spent() - before)
    # The least of five: 0.05 s of 0.06 that are asked for on a quiet machine; shared cores give a half more.
    assert quickest < 0.10


def test_every_command_has_help(bakery):
    from bakery.cli.main import COMMANDS

    for name in COMMANDS:
        done = bakery(name, "--help")
        assert done.returncode == 0 and "Usage" in done.stdout, name


def test_exit_codes(bakery, tmp_path):
    assert bakery("nonsense").returncode == 2
    assert bakery("build").returncode == 2
    done = bakery("build", tmp_path / "no\nphoto.jpg", "-o", tmp_path / "a.avatar")
    assert done.returncode == 1 and done.stdout == ""
    assert len(done.stderr.splitlines()) == 1 and "no such file" in done.stderr


def test_bad_photo_is_refused_at_once(process, tmp_path):
    (tmp_path / "a.jpg").write_bytes(b"\xff\xd8\xff" + bytes(99))
    for command in ("build", "detect", "fit"):
        start = _spent()
        done = process(command, tmp_path / "a.jpg", "-o", tmp_path / "out")
        assert _spent() - start < 3  # 0.3 s on an idle machine
        assert done.returncode == 1 and len(done.stderr.splitlines()) == 1, done.stderr
    assert os.listdir(tmp_path) == ["a.jpg"]


@pytest.fixture
def odd(tmp_path, portrait):
    """The painted portrait under a name with everything in it."""
    name = "-a b\n\u0444 'x'$#"
    shutil.copy(portrait[0], tmp_path / f"{name}.png")
    shutil.copy(portrait[1], tmp_path / f"{name}.json")
    return tmp_path, name


def test_odd_names(bakery, odd):
    folder, name = odd
    given = ["--landmarks", f"./{name}.json", "-n", "-o", f"out/{name}.avatar"]
    done = bakery("build", *given, "--", f"{name}.png", cwd=folder)
    assert done.returncode == 0, done.stderr
    done = bakery("build", *given, "--face", "2", "--", f"{name}.png", cwd=folder)
    assert done.returncode == 1 and len(done.stderr.splitlines()) == 1


def test_no_face(bakery, tmp_path):
    from bakery.formats.image import write_image

    y, x = np.mgrid[:300, :400] / 400
    write_image(tmp_path / "sky.png", np.stack([x, y, 0 * x + 0.8], -1))
    for command in ("detect", "build"):
        done = bakery(command, tmp_path / "sky.png", "-o", tmp_path / "out")
        assert done.returncode == 1 and "no face found" in done.stderr
        assert len(done.stderr.splitlines()) == 1 and done.stdout == ""
    assert os.listdir(tmp_path) == ["sky.png"]


def test_detect_writes_what_fit_reads(bakery, portrait):
    from pathlib import Path

    sample = sorted((Path(__file__).parents[2] / "samples").glob("*.jpg"))[0]
    done = bakery("detect", sample, "-o", "-")
    table = json.loads(done.stdout)
    (face,) = table["faces"]
    assert len(face["points"]) == len(face["confidence"]) == 478 and len(face["box"]) == 4
    truth = np.array(json.loads(sample.with_suffix(".json").read_text())["faces"][0]["points"])
    eyes = np.linalg.norm(truth[33] - truth[263])
    error = np.linalg.norm(np.array(face["points"]) - truth, axis=1).mean() / eyes
    assert error < 0.04  # measured: 0.021; part by part in tests/detectors/test_landmarks.py


def test_fit_many_in_one_process(bakery, portrait, tmp_path):
    photo, marks = portrait
    photos, points = tmp_path / "photos", tmp_path / "points"
    photos.mkdir(), points.mkdir()
    for name in ("one", "two"):
        shutil.copy(photo, photos / f"{name}.png")
        shutil.copy(marks, points / f"{name}.json")
    (photos / "bad.png").write_bytes(b"x")
    every = sorted(photos.iterdir())
    done = bakery("fit", *every, "--landmarks", points, "-o", tmp_path / "fits")
    assert done.returncode == 1 and "bad.png" in done.stderr
    assert sorted(os.listdir(tmp_path / "fits")) == ["one.json", "two.json"]
    table = json.loads((tmp_path / "fits" / "one.json").read_text())
    assert {"head", "camera", "identity", "expression", "gaze", "light", "landmarks_projected",
            "seconds"} <= set(table)  # fmt: skip
    assert len(table["expression"]) == 52 and table["seconds"] > 0
    done = bakery("fit", every[1], "--landmarks", points, "-n", "-o", tmp_path / "fits")
    assert done.returncode == 1 and "--overwrite" in done.stderr
    assert bakery("fit", *every, "-o", tmp_path / "one.json").returncode == 2


def test_landmarks_of_another_photo(bakery, portrait, tmp_path):
    photo, marks = portrait
    table = json.loads(marks.read_text())
    table["image"]["width"] += 1
    (tmp_path / "l.json").write_text(json.dumps(table))
    done = bakery("fit", photo, "--landmarks", tmp_path / "l.json", "-n", "-o", "-")
    assert done.returncode == 1 and "detect again" in done.stderr
    table["image"]["width"] -= 1
    table["faces"] *= 2
    (tmp_path / "l.json").write_text(json.dumps(table))
    done = bakery("fit", photo, "--landmarks", tmp_path / "l.json", "-n", "-o", "-")
    assert done.returncode == 1 and "--face N" in done.stderr
    done = bakery("fit", photo, "--landmarks", tmp_path / "l.json", "--face", "2", "-n", "-o", "-")
    assert done.returncode == 0
    done = bakery("fit", photo, "--landmarks", tmp_path / "l.json", "--face", "3", "-n", "-o", "-")
    assert done.returncode == 1 and "lower --face" in done.stderr


def test_frame_needs_no_number():
    from bakery.cli.options import _plain_frames

    assert list(_plain_frames(["--frame", "a.gif"])) == ["--frame=0", "a.gif"]
    assert list(_plain_frames(["--frame", "3", "a.gif"])) == ["--frame=3", "a.gif"]
    assert list(_plain_frames(["--", "--frame"])) == ["--", "--frame"]


def test_dry_run_writes_nothing(bakery, portrait, tmp_path):
    photo, marks = portrait
    done = bakery("build", photo, "--landmarks", marks, "-o", tmp_path / "a.avatar", "-n")
    assert done.returncode == 0 and "1024 texels" in done.stdout
    assert os.listdir(tmp_path) == []
    done = bakery("build", photo, "-o", tmp_path / "a", "-n", "--set", "texture.size=3")
    assert done.returncode == 2 and "no setting 'size'; known" in done.stderr
    done = bakery("build", photo, "-o", tmp_path / "a", "-n", "--preset", "nothing")
    assert done.returncode == 2 and "known: default" in done.stderr
