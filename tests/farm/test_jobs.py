"""Job files: every task comes out of them again as it went in, whatever its name."""

import json
import shlex
import shutil
import stat
import subprocess
import sys
from pathlib import Path

import pytest

from bakery.errors import InputError
from bakery.farm import jobs

NAMES = ["anna.jpg", "two words.jpg", "it's $HOME.jpg", 'a"b\\c#;&.png', "ädä 顔.jpg", "x:y=%z.jpg"]


def job(root, names=NAMES, arguments=("--preset=small", "--set=texture.views=[0.0]"), folder=None):
    places = [(root / "in" / name, root / "out" / f"{name}.avatar") for name in names]
    return jobs.of_places(places, list(arguments), 1.5, folder or root)


def wanted(made):
    return [task.command(made.arguments) for task in made.tasks]


def test_commands_are_read_by_a_shell_as_they_were_meant(tmp_path):
    made = job(tmp_path)
    lines = jobs.as_commands(made).splitlines()
    assert [shlex.split(line) for line in lines] == wanted(made)
    said = subprocess.run(
        ["sh", "-c", lines[2].replace("bakery", "printf '%s\\n'", 1)],
        capture_output=True,
        text=True,
    )
    assert said.stdout.splitlines() == wanted(made)[2][1:]


def program(folder):
    """A program in place of bakery that notes its arguments, a JSON line a call."""
    path = folder / "bin" / "bakery"
    path.parent.mkdir()
    path.write_text(
        f"#!{sys.executable}\nimport json, sys\n"
        f"open({str(folder / 'calls')!r}, 'a').write(json.dumps(sys.argv[1:]) + '\\n')\n"
        "sys.exit('bad' in sys.argv[2])\n"
    )
    path.chmod(path.stat().st_mode | stat.S_IXUSR)
    return path


def calls(folder):
    return sorted(json.loads(line) for line in (folder / "calls").read_text().splitlines())


@pytest.mark.skipif(shutil.which("make") is None, reason="needs make")
def test_make_runs_every_task_and_one_that_fails_stops_no_other(tmp_path):
    made = job(tmp_path, ["bad.jpg", *NAMES])
    (tmp_path / "bakes.mk").write_text(jobs.as_makefile(made))
    path = f"{program(tmp_path).parent}:/usr/bin:/bin"
    done = subprocess.run(
        ["make", "-k", "-j2", "-f", "bakes.mk"], cwd=tmp_path, env={"PATH": path},
        capture_output=True, text=True,
    )  # fmt: skip
    assert calls(tmp_path) == sorted(command[1:] for command in wanted(made))
    assert done.returncode == 2 and "bake-1" in done.stderr  # the bad one


def test_an_open_job_description_holds_photos_of_several_folders(tmp_path):
    places = [(tmp_path / f"p{n % 2}" / f"{n}.jpg", tmp_path / f"{n}.avatar") for n in range(2100)]
    made = jobs.of_places(places, [], 1.5, tmp_path)
    template = json.loads(jobs.as_openjd(made))
    given = {one["name"]: one for one in template["parameterDefinitions"]}
    assert given["Photos1"]["default"] == "p0" and given["Photos2"]["dataFlow"] == "IN"
    assert given["Bundles"]["dataFlow"] == "OUT" and given["Bundles"]["default"] == "."
    sizes = {s["name"]: len(_range(s, "Photo")) for s in template["steps"]}
    assert sizes == {"bake-1-1": 1024, "bake-1-2": 26, "bake-2-1": 1024, "bake-2-2": 26}
    told = [
        (f"{'p0' if step['name'].startswith('bake-1') else 'p1'}/{photo}", bundle)
        for step in template["steps"]
        for photo, bundle in zip(_range(step, "Photo"), _range(step, "Bundle"))
    ]
    assert sorted(told) == sorted((f"p{n % 2}/{n}.jpg", f"{n}.avatar") for n in range(2100))


def _range(step, name):
    found = step["parameterSpace"]["taskParameterDefinitions"]
    return next(one["range"] for one in found if one["name"] == name)


def test_places_outside_the_templates_folder_are_given_when_it_is_submitted(tmp_path):
    made = job(tmp_path, folder=tmp_path / "in")
    template = json.loads(jobs.as_openjd(made))
    given = {one["name"]: one for one in template["parameterDefinitions"]}
    assert "default" not in given["Bundles"] and given["Photos1"]["default"] == "."
    assert jobs.parameters(made) == {"Bundles": str(tmp_path / "out")}


def test_the_model_of_open_job_description_agrees(tmp_path):
    model = pytest.importorskip("openjd.model")
    made = job(tmp_path)
    template = model.decode_job_template(template=json.loads(jobs.as_openjd(made)))
    given = model.preprocess_job_parameters(
        job_template=template, job_parameter_values={}, job_template_dir=tmp_path,
        current_working_dir=tmp_path,
    )  # fmt: skip
    real = model.create_job(job_template=template, job_parameter_values=given)
    (step,) = real.steps
    space = model.StepParameterSpaceIterator(space=step.parameterSpace)
    found = [(task["Photo"].value, task["Bundle"].value) for task in space]
    assert found == [(name, f"{name}.avatar") for name in NAMES]


def test_openjd_runs_the_tasks(tmp_path):
    pytest.importorskip("openjd.cli")
    made = job(tmp_path, NAMES[:3])
    (tmp_path / "job.json").write_text(jobs.as_openjd(made))
    done = subprocess.run(
        [sys.executable, "-m", "openjd", "run", "job.json", "--step", "bake-1-1",
         "-p", f"Bakery={program(tmp_path)}"],
        cwd=tmp_path, capture_output=True, text=True,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    assert calls(tmp_path) == sorted(command[1:] for command in wanted(made))


@pytest.mark.parametrize(
    "names, arguments, said",
    [
        (["a\nb.jpg"], [], "control characters"),
        (["{{Param.X}}.jpg"], [], "cannot hold"),
        (["a.jpg"], ["--preset={{x}}.toml"], "cannot hold"),
    ],
)
def test_names_that_no_job_can_hold_are_refused(tmp_path, names, arguments, said):
    with pytest.raises(InputError, match=said):
        jobs.as_openjd(job(tmp_path, names, arguments))


def test_too_many_folders_are_refused(tmp_path):
    places = [(tmp_path / str(n) / "a.jpg", tmp_path / f"{n}.avatar") for n in range(49)]
    with pytest.raises(InputError, match="write several jobs"):
        jobs.as_openjd(jobs.of_places(places, [], 1.5, tmp_path))


def test_the_command_hands_on_what_it_was_given(bakery, tmp_path):
    for name in ("ada.jpg", "bob.png"):
        (tmp_path / name).touch()
    (tmp_path / "my.toml").write_text("[texture]\nmouths = 5\n")
    done = bakery(
        "farm", ".", "-o", "out", "--format", "commands", "--preset", "my.toml", "--resolution", 512,
        "--set", "texture.mouths=7", "--keep-glasses", "--strict", "--generator", "rendered",
        cwd=tmp_path,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    first, second = map(shlex.split, done.stdout.splitlines())
    assert first == [
        "bakery", "build", str(tmp_path / "ada.jpg"), "-o", str(tmp_path / "out" / "ada.avatar"),
        "--skip-fresh", f"--preset={tmp_path / 'my.toml'}", "--set=texture.mouths=7",
        "--set=texture.resolution=512", "--set=texture.glasses=keep", "--generator=rendered",
        "--strict",
    ]  # fmt: skip
    assert Path(second[2]).name == "bob.png" and second[5:] == first[5:]


@pytest.mark.parametrize(
    "arguments, code, said",
    [
        ([], 2, "give --format"),
        (["--format", "make", "--dask", "tcp://x:1"], 2, "give --format"),
        (["--dask", "tcp://x:1", "--to", "y"], 2, "--to"),
        (["--format", "make", "--json"], 2, "--json"),
        (["--format", "make", "--set", "texture.mouths=0"], 2, "mouths"),
        (["--format", "make", "--to", "a.jpg"], 2, "a.jpg"),
        (["--format", "make", "--to", "there"], 1, "already there"),
    ],
)
def test_wrong_usage_is_one_line(bakery, tmp_path, arguments, code, said):
    (tmp_path / "a.jpg").touch()
    (tmp_path / "there").write_text("mine")
    done = bakery("farm", "a.jpg", "-o", "out", *arguments, cwd=tmp_path)
    assert done.returncode == code and said in done.stderr, done.stderr
    assert "Traceback" not in done.stderr
    assert (tmp_path / "there").read_text() == "mine"
