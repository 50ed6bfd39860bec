"""What the shell completes, and that a key press does not wait."""

import os
import subprocess
import sys

import click
import pytest
from click.shell_completion import ShellComplete

from bakery.cli import complete
from bakery.cli.main import bakery
from bakery.formats.targets import named_expressions
from bakery.motion.retarget import ANGLES
from bakery.types import EXPRESSIONS


def completed(line):
    """The words that a shell would offer at the end of a line."""
    *words, incomplete = line.split(" ")
    found = ShellComplete(bakery, {}, "bakery", "_X").get_completions(words, incomplete)
    return [item.value for item in found if item.type == "plain"]


@pytest.mark.parametrize(
    "line, words",
    [
        ("bui", {"build"}),
        ("build --preset s", {"small"}),
        ("build --generator ", {"pagan", "rendered"}),
        ("build --detector n", {"network"}),
        ("build --head make", {"makehuman"}),
        (
            "build --set texture.",
            {
                "texture.resolution=",
                "texture.views=",
                "texture.mouths=",
                "texture.complete=",
                "texture.glasses=",
                "texture.neutral=",
            },
        ),
        ("train pagan --set crop.e", {"crop.eyes=", "crop.eye_weight=", "crop.exact="}),
        ("train detector --set mi", {"minutes="}),
        ("render a --weights mouthPu", {"mouthPucker="}),
        ("render a --weights jawOpen=0.6,mouthPu", {"jawOpen=0.6,mouthPucker="}),
        ("generate a --weights jawF", {"jawForward="}),
        ("recover a jawF", {"jawForward"}),
        ("recover a jawOpen mouthPu", {"mouthPucker"}),
        ("animate a --gain he", {"head="}),
        ("retarget a --gain jawOpen=0.8,ga", {"jawOpen=0.8,gaze="}),
        ("build --hair no", {"none"}),
        ("export a --format glb-s", {"glb-speech"}),
        ("render a --expression laug", {"laugh="}),
        ("render a --light sun", {"sunset"}),
        ("heads show make", {"makehuman"}),
        ("heads measure makehuman make", {"makehuman"}),
        ("presets show mo", {"mobile"}),
    ],
)
def test_names_are_completed(line, words):
    assert set(completed(line)) == words


def test_names_or_files():
    items = complete.presets(None, None, "my")
    assert [(item.type, item.value) for item in items] == [("file", "my")]


def test_expressions_behind_the_last_comma():
    values = [item.value for item in complete.expressions(None, None, "laugh=0.5,viseme:A")]
    assert values == ["laugh=0.5,viseme:AA="]


def test_the_kept_list_is_true():
    """`python -m bakery.cli.complete` writes it anew."""
    assert complete.words() == complete.made()
    assert complete.words()["shapes"] == list(EXPRESSIONS)
    assert set(named_expressions()) == set(complete.words()["expressions"])
    assert complete.ANGLES == ANGLES


@pytest.mark.parametrize(
    "words", ["build --preset ", "build --set ", "render a --weights ", "build --head ", ""]
)
def test_completion_loads_nothing_slow(words):
    code = (
        "import sys\nfrom bakery.cli.main import main\n"
        "try:\n    main()\nfinally:\n    print(sorted(sys.modules.keys() & "
        "{'numpy', 'torch', 'cv2', 'PIL', 'numba', 'jsonschema'}), file=sys.stderr)"
    )
    line = f"bakery {words}"
    env = os.environ | {
        "_BAKERY_COMPLETE": "zsh_complete",
        "COMP_WORDS": line,
        "COMP_CWORD": str(len(line.split(" ")) - 1),
    }
    before = os.times()
    done = subprocess.run([sys.executable, "-c", code], env=env, capture_output=True, text=True)
    after = os.times()
    assert done.stderr.splitlines()[-1] == "[]" and done.stdout
    # Processor time, 0.1 s: the wall clock of a busy machine says nothing.
    assert sum(after[2:4]) - sum(before[2:4]) < 0.4


NAMED = {
    "--preset", "--head", "--generator", "--detector", "--hair", "--format", "--weights",
    "--expression", "--light", "--gain", "--set",
}  # fmt: skip
# --hair/--no-hair; kinds that click completes itself.
NOT_NAMES = click.types.BoolParamType, click.Choice, click.Path


def commands(group, name=""):
    """Every command there is, by its words."""
    context = click.Context(group)
    for word in group.list_commands(context):
        command, words = group.get_command(context, word), f"{name} {word}".strip()
        if isinstance(command, click.Group):
            yield from commands(command, words)
        else:
            yield words, command


def test_every_option_with_names_completes_them():
    met = set()
    for name, command in commands(bakery):
        for option in command.params:
            folder = "--set" in option.opts and option.name != "settings"  # of `evaluate`
            files = option.name == "weights" and option.multiple
            if folder or files or isinstance(option.type, NOT_NAMES):
                continue
            for word in NAMED.intersection(option.opts):
                met.add(word)
                assert option._custom_shell_complete is not None, f"{name} {word}"
    assert met == NAMED


def test_every_argument_that_names_a_head_or_a_shape_completes_it():
    for name, command in commands(bakery):
        for argument in command.params:
            named = name.startswith("heads ") and argument.name in ("name", "names")
            if named or (name, argument.name) == ("recover", "expressions"):
                assert argument._custom_shell_complete is not None, f"{name} {argument.name}"
