"""Wrong usage: exit code 2, a guess at what was meant, nothing asked for twice."""

import json
import signal
import subprocess
import sys

import click
import pytest

from bakery.bake import estimate
from bakery.cli import main as cli
from bakery.cli import options
from bakery.cli.group import Interrupted
from bakery.errors import nearest, no_such


@pytest.fixture
def run(capsys):
    """A function of words that gives exit code, stdout and stderr of the program, in this process."""

    def call(*words):
        with pytest.raises(SystemExit) as ended:
            cli.main(list(map(str, words)))
        said = capsys.readouterr()
        return ended.value.code, said.out, said.err

    return call


@pytest.mark.parametrize(
    "words, message",
    [
        (["--preset", "smal"], "no preset 'smal'; did you mean 'small'?"),
        (["--set", "texture.mouths=0"], "preset default.texture.mouths: 0; 1 to 300"),
        (["--set", "texture.mouhts=3"], "no setting 'mouhts'; did you mean 'mouths'?"),
        (["--set", "mouths=3"], "no setting 'mouths'; did you mean 'texture.mouths'?"),
        (["--set", "texture"], "give KEY=VALUE"),
        (["--generator", "pagen"], "no generator 'pagen'; did you mean 'pagan'?"),
        (["--detector", "netwrok"], "no detector 'netwrok'; did you mean 'network'?"),
        (["--head", "makehumen"], "no head model 'makehumen'; did you mean 'makehuman'?"),
    ],
)
def test_wrong_values_are_wrong_usage(run, portrait, tmp_path, words, message):
    photo, marks = portrait
    given = [] if words[0] == "--detector" else ["--landmarks", marks]
    code, out, said = run("build", photo, *given, "-o", tmp_path / "a.avatar", "-n", *words)
    assert (code, out) == (2, "") and message in said and len(said.splitlines()) == 1


def test_an_unreadable_photo_is_none(run, tmp_path, monkeypatch):
    photo = tmp_path / "a.jpg"
    photo.write_bytes(b"x")
    real = options.click.types.os.access
    monkeypatch.setattr("os.access", lambda path, mode: path != str(photo) and real(path, mode))
    code, _, said = run("detect", photo, "-o", tmp_path / "out.json")
    assert code == 1 and "is not readable" not in said and len(said.splitlines()) == 1


@pytest.mark.parametrize(
    "words, guess",
    [
        (["biuld"], "'build'"),
        (["Render"], "'render'"),
        (["synth", "sample"], "'samples'"),
        (["train", "pagn"], "'pagan'"),
        (["heads", "build", "makehumn"], "'makehuman'"),
    ],
)
def test_a_mistyped_command_is_guessed(run, words, guess):
    code, _, said = run(*words)
    assert code == 2 and f"Did you mean {guess}?" in said
    code, _, said = run("qqqq")
    assert code == 2 and "No such command 'qqqq'." in said and "mean" not in said


@pytest.mark.parametrize(
    "words",
    [["--weights", "jawOpen=1", "--weights", "jawLeft=1"], ["-o", "a.png", "--output", "b.png"]],
)
def test_an_option_given_twice_is_refused(run, tmp_path, words):
    code, _, said = run("render", tmp_path, "-o", "x.png", *words)
    assert code == 2 and "is given twice" in said


def test_options_for_many_may_be_repeated(run, portrait, tmp_path):
    photo, marks = portrait
    many = ["--set", "texture.mouths=3", "--set", "texture.resolution=512", "-q", "-q"]
    code, out, said = run("build", photo, "--landmarks", marks, "-o", tmp_path / "a", "-n", *many)
    assert code == 0 and "512" in out, said


@pytest.mark.parametrize("generator", ["pagan", "rendered"])
def test_a_dry_run_says_what_the_bake_takes(run, portrait, tmp_path, monkeypatch, generator):
    """By the sizes and the generator that are asked for, on a host whose reference load takes 0.1 s."""
    monkeypatch.setattr(estimate, "reference_seconds", lambda: 0.1)
    photo, marks = portrait
    asked = ["--preset", "small", "--set", "texture.mouths=7", "--generator", generator]
    code, out, _ = run("build", photo, "--landmarks", marks, "-o", tmp_path / "a", "-n", *asked)
    chosen = options.build_options("small", ["texture.mouths=7"])
    seconds = 0.1 * sum(long for long, _ in estimate.plan(chosen, generator=generator).values())
    line = f"takes       about {seconds:.0f} s and "
    assert code == 0 and out.splitlines()[-1].startswith(line) and "GiB of memory" in out


def test_the_nearest_name():
    assert nearest("JAWOPEN", ["jawOpen", "jawLeft"]) == "jawOpen"
    assert nearest("x", ["jawOpen"]) is None
    many = [f"shape{n}" for n in range(40)]
    said = str(no_such("no shape", "shape77", many, "see there"))
    assert said == "no shape 'shape77'; did you mean 'shape7'? see there"
    assert str(no_such("no shape", "zzz", ["a", "b"])) == "no shape 'zzz'; known: a, b"
    assert (
        str(no_such("no shape", "ax", [], "see there")) == "no shape 'ax'; known: none; see there"
    )
    assert len(str(no_such("no shape", "z" * 999, ["a"]))) < 120


def test_interruption_says_what_comes_of_it(run, monkeypatch):
    def interrupted(**_):
        raise KeyboardInterrupt

    for resumes in (False, True):
        command = options.Command("long", callback=interrupted, resumes=resumes)
        monkeypatch.setattr(cli.LazyGroup, "get_command", lambda *_, command=command: command)
        code, _, said = run("long")
        assert code == 130 and len(said.splitlines()) == 1
        assert said.startswith("bakery: interrupted") and ("goes on" in said) is resumes


def test_only_commands_that_go_on_say_so():
    context = click.Context(cli.bakery)
    goes_on = {
        name for name in cli.COMMANDS
        if getattr(cli.bakery.get_command(context, name), "resumes", False)
    }  # fmt: skip
    assert goes_on == {"build", "animate", "perform"}


def test_ctrl_c_in_a_real_process(tmp_path):
    code = (
        "import time; from bakery.cli import doctor, main; doctor.doctor.callback = "
        "lambda **_: (print('on', flush=True), time.sleep(60)); main.main(['doctor'])"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )  # fmt: skip
    process.stdout.readline()
    process.send_signal(signal.SIGINT)
    _, said = process.communicate(timeout=30)
    assert process.returncode == 130 and said.strip() == "bakery: interrupted"
    assert issubclass(Interrupted, Exception)


def test_verbose_says_how_long_and_quiet_nothing(bakery, tmp_path):
    loud = bakery("-v", "mask", "-o", tmp_path / "a.npz", "--preset", "small")
    assert loud.returncode == 0 and "mask:" in loud.stderr and "s in all" in loud.stderr
    assert f"wrote {tmp_path / 'a.npz'}" in loud.stderr
    usual = bakery("mask", "-o", tmp_path / "b.npz", "--preset", "small")
    assert usual.stderr == f"wrote {tmp_path / 'b.npz'}\n" and usual.stdout == ""
    quiet = bakery("mask", "-o", tmp_path / "c.npz", "--preset", "small", "-q")
    assert quiet.stderr == quiet.stdout == "" and (tmp_path / "c.npz").exists()


def test_presets(run, tmp_path):
    code, out, _ = run("presets", "list")
    assert code == 0 and out.startswith("default ") and "\nsmall " in out
    assert set(json.loads(run("presets", "list", "--json")[1])) == {"default", "mobile", "small"}
    code, out, _ = run("presets", "show", "small", "--set", "texture.mouths=7")
    assert code == 0 and "mouths = 7  # 1 to 300; " in out
    (tmp_path / "mine.toml").write_text(out)
    code, again, _ = run("presets", "show", tmp_path / "mine.toml")
    assert code == 0 and again == out
    assert json.loads(run("presets", "show", "small", "--json")[1])["texture"]["mouths"] == 60
    assert run("presets", "show", "smal")[0] == 2


@pytest.mark.parametrize(
    "words, line",
    [
        (["build", "--set", "help"], "mouths = 300  # 1 to 300; mouth poses that are baked"),
        (["train", "pagan", "--set", "help"], "batch = 8  # 1 to 65536; crops a step"),
    ],
)
def test_all_settings_are_listed_on_demand(run, words, line):
    code, out, _ = run(*words)
    assert code == 0 and line in out.splitlines()
