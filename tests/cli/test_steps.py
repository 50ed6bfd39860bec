"""The single steps of a bake give the same bytes as `build`."""

import json
import os
import sys
from functools import partial
from pathlib import Path

import pytest

from bakery import plugins

FEW = Path(__file__).parents[1] / "few.toml"
QUICK = ["--expressions", FEW, "--resolution", "512"]
PRESET = """
[segment]
rounds = 2
[fit]
modes = 40
focal = 2.5
landmark_steps = 6
[texture]
mouths = 2
views = [20.0]
[bundle.web]
side = 512
"""


def content(folder):
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file()
    }


def step_by_step(process, bakery, photo, folder, options, marks=None, *last):
    """A bundle by the single steps, each given the options of `build`.

    Without landmarks the first step finds them, in its own process; `last` is for the last step.
    """
    points, fit, textures, masks, out = (
        folder / name for name in ("p.json", "f.json", "t.npz", "m.npz", "steps.avatar")
    )
    if marks is None:
        done = process("detect", photo, "-o", points, *options)
        assert done.returncode == 0, done.stderr
    given = [photo, "--landmarks", marks or points]
    made = ["--fit", fit, "--textures", textures, "--masks", masks]
    for command in (
        ["fit", *given, "-o", fit],
        ["texture", *given, "--fit", fit, "-o", textures],
        ["mask", "-o", masks],
        ["bundle", *given, *made, "-o", out, *last],
    ):
        done = bakery(*command, *options)
        assert done.returncode == 0, (command, done.stderr)
        assert f"wrote {command[command.index('-o') + 1]}" in done.stderr
    return out


@pytest.fixture
def plugged(installed, monkeypatch):
    """The environment of `installed`; its plug-ins are there in this process, too."""
    monkeypatch.syspath_prepend(installed["PYTHONPATH"].split(os.pathsep)[0])
    monkeypatch.delitem(sys.modules, "bakery_example", raising=False)
    plugins.plug_in.cache_clear()
    yield installed
    plugins.plug_in.cache_clear()
    sys.modules.pop("bakery_example", None)


@pytest.mark.parametrize(
    "case",
    [
        pytest.param("default", marks=pytest.mark.slow),  # 80 s: two whole bakes
        pytest.param("fit table, no hair", marks=pytest.mark.slow),
        pytest.param("fit table, other generator", marks=pytest.mark.slow),
        "fit table, plug-ins",
    ],
)
def test_the_single_steps_are_the_bake(process, bakery, plugged, tmp_path, case):
    """Not a byte differs; a detector finds the face, as users have it, or a file has it."""
    sample = Path(__file__).parents[2] / "samples" / "emil.jpg"
    options, marks, last = ["--preset", "default", *QUICK], None, []
    if case != "default":
        (tmp_path / "mine.toml").write_text(PRESET)
        hair = "red" if "plug-ins" in case else "none"
        options = ["--preset", tmp_path / "mine.toml", "--hair", hair, *QUICK]
        marks, last = sample.with_suffix(".json"), ["--keep-photo", "--consent", "Emil agreed"]
    if case == "fit table, other generator":
        options += ["--generator", "rendered", "--set", "bundle.formats=[]"]
    if case == "fit table, plug-ins":
        options += ["--generator", "still", "--detector", "mirrored", "--set", "bundle.formats=[]"]
        marks, process = None, partial(process, env=plugged)
    whole = tmp_path / "whole.avatar"
    found = ["--landmarks", marks] if marks else []
    done = bakery("build", sample, *found, "-o", whole, *options, *last)
    assert done.returncode == 0, done.stderr
    assert f"wrote {whole}: look at {whole / 'preview.png'}" in done.stderr
    if case == "fit table, plug-ins":
        made_by = json.loads((whole / "avatar.json").read_text())["provenance"]
        assert (made_by["generator"], made_by["detector"]) == ("still", "mirrored")
    steps = step_by_step(process, bakery, sample, tmp_path, options, marks, *last)
    ours, theirs = content(whole), content(steps)
    assert ours.keys() == theirs.keys()
    assert [name for name in ours if ours[name] != theirs[name]] == []
