"""Ctrl-C in the middle of painting: what was finished is kept, used again, and changes nothing."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

pytestmark = pytest.mark.skipif(os.name == "nt", reason="sends SIGINT to one process")
FEW = [
    "--expressions", Path(__file__).parents[1] / "few.toml", "--preset", "small",
    "--set", "texture.views=[0.0]", "--generator", "rendered", "--set", "bundle.formats=[]",
]  # fmt: skip
ENOUGH = "key001.npz.key"  # the second of four or six key expressions is finished


def interrupted(command, work, env=None):
    """Start a bake and interrupt it while it paints; what it said."""
    process = subprocess.Popen(
        [sys.executable, "-m", "bakery", *map(str, command)],
        stderr=subprocess.PIPE,
        text=True,
        env=env,
        # A shell's background job ignores SIGINT, and so would what it starts.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )
    end = time.monotonic() + 300
    while not any((folder / ENOUGH).exists() for folder in work()):
        assert process.poll() is None and time.monotonic() < end, "it never came to paint"
        time.sleep(0.02)
    process.send_signal(signal.SIGINT)
    said = process.communicate(timeout=60)[1]
    assert process.returncode == 130, said
    return said


def written(folder):
    """When each finished step of a work folder was written."""
    return {
        path.name.removesuffix(".key"): path.stat().st_mtime_ns for path in folder.glob("*.key")
    }


def content(folder):
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file()
    }


def test_an_interrupted_bake_goes_on(bakery, portrait, tmp_path):
    """No step is run twice; what all steps in one go give, the test below compares."""
    photo, marks = portrait
    out, work = tmp_path / "a.avatar", tmp_path / "work"
    bare = ["--hair", "none", "--complete", "none"]  # painting is what is interrupted
    command = ["build", photo, "--landmarks", marks, "-o", out, *FEW, *bare, "--work", work]
    said = interrupted(command, lambda: [work])
    assert "interrupted" in said and "Traceback" not in said and len(said.splitlines()) == 1
    assert not out.exists()
    first = written(work)
    assert {"detect.json", "fit.json", "neutral.npz", "key000.npz", "key001.npz"} <= set(first)
    assert not any(name.startswith(("gaze", "mouth")) for name in first)

    done = bakery("-v", *command)
    assert done.returncode == 0, done.stderr
    then = written(work)
    assert {name: then[name] for name in first} == first  # not written, so not made again
    assert set(first) <= set(then)  # what takes little time is not kept
    for name in then:
        taken = f"{name}: taken from the work folder" in done.stderr
        assert taken == (name in first), (name, done.stderr)
    whole = content(out)

    done = bakery("-v", *command, "--overwrite")  # all is there
    assert done.returncode == 0 and written(work) == then, done.stderr
    assert done.stderr.count("taken from the work folder") == len(then)
    assert content(out) == whole


@pytest.mark.slow
def test_the_work_folder_of_its_own_is_found_and_cleared_away(process, bakery, portrait, tmp_path):
    """Without --work it lies hidden beside the bundle until that is complete.

    Other processes, folder, clock and locale than those of a bake in one go: not a byte differs.
    """
    photo, marks = portrait
    folder, whole = tmp_path / "f", tmp_path / "whole.avatar"
    folder.mkdir()
    out = folder / "other name.avatar"
    command = ["build", photo, "--landmarks", marks, *FEW, "--keep-photo", "-o"]
    env = os.environ | {"LC_ALL": "C", "TZ": "Asia/Tokyo", "PYTHONHASHSEED": "1"}
    interrupted([*command, out], lambda: folder.glob(".bakery-*-work"), env)
    (hidden,) = folder.iterdir()
    before = set(written(hidden))
    done = process("-v", *command, out, env=env)
    assert done.returncode == 0, done.stderr
    assert all(f"{name}: taken from the work folder" in done.stderr for name in before)
    assert [path.name for path in folder.iterdir()] == [out.name]
    done = bakery(*command, whole)
    assert done.returncode == 0, done.stderr
    mine, theirs = content(out), content(whole)
    assert mine.keys() == theirs.keys()
    assert [name for name in mine if mine[name] != theirs[name]] == []
