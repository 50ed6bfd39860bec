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


def test_every_option_with_names_completes_them():
    """Of all commands: who has --preset, --head, --generator, --detector or --weights."""
    wanted = {"preset", "head", "heads", "generator", "detector", "weights", "settings"}

    def walk(group):
        context = click.Context(group)
        for name in group.list_commands(context):
            command = group.get_command(context, name)
            if isinstance(command, click.Group):
                yield from walk(command)
            else:
                yield name, command

    for name, command in walk(bakery):
        for option in command.params:
            several_networks = option.name == "weights" and option.multiple
            if option.name in wanted and isinstance(option, click.Option) and not several_networks:
                assert option._custom_shell_complete is not None, f"{name} --{option.name}"
