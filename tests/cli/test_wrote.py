"""Every command that writes a file says so, in one line that begins with "wrote"."""

import click
import numpy as np
import pytest

from bakery.cli.main import COMMANDS
from bakery.cli.main import bakery as program
from bakery.formats.livelink import Take
from bakery.motion.files import format_take
from bakery.types import EXPRESSIONS

COARSE = ["--preset", "small", "--set", "fit.photometric=false", "--set", "fit.outline=false"]
# PHOTO, MARKS, BUNDLE and TAKE stand for files, the last word for the one to write.
CHEAP = {
    "animate": "BUNDLE --curves TAKE --size 16 --textures static -o a.webm",
    "detect": "PHOTO --landmarks MARKS -o a.json",
    "export": "BUNDLE --format head -o a.npz",
    "farm": "PHOTO --format make -o bundles --to a.mk",
    "fit": "PHOTO --landmarks MARKS COARSE -o a.json",
    "mask": "--preset small -o a.npz",
    "preview": "BUNDLE -o a.html",
    "recover": "BUNDLE jawOpen -o a.exr",
    "render": "BUNDLE --size 16 -o a.png",
    "retarget": "TAKE -o a.csv",
    "segment": "PHOTO --landmarks MARKS -o a.png",
}
# What takes longer says so in tests of its own: these paint or follow a clip.
ELSEWHERE = {
    "albedo": "test_albedo", "build": "test_steps", "bundle": "test_steps", "generate":
    "test_generate", "hair": "test_hair", "perform": "test_perform", "sign": "test_sign", "texture":
    "test_steps", "track": "test_motion",
}  # fmt: skip


def test_no_command_is_left_out():
    context = click.Context(program)
    found = {name: program.get_command(context, name) for name in COMMANDS}
    writing = {n for n, c in found.items() if any(option.name == "output" for option in c.params)}
    assert writing == CHEAP.keys() | ELSEWHERE.keys()


@pytest.mark.parametrize("name", CHEAP)
def test_a_command_says_what_it_wrote(bakery, bundle, portrait, tmp_path, name):
    take = tmp_path / "take.csv"
    weights = np.zeros((2, len(EXPRESSIONS)), np.float32)
    take.write_bytes(format_take(Take(np.arange(2) / 30, weights, np.zeros((2, 3)), None)))
    stand_for = {
        "PHOTO": portrait[:1], "MARKS": portrait[1:], "BUNDLE": [bundle], "TAKE": [take],
        "COARSE": COARSE,
    }  # fmt: skip
    *words, last = CHEAP[name].split()
    given = [word for words in words for word in stand_for.get(words, [words])]
    done = bakery(name, *given, tmp_path / last)
    assert done.returncode == 0, done.stderr
    said = [line for line in done.stderr.splitlines() if line.startswith("wrote ")]
    assert len(said) == 1 and said[0].startswith(f"wrote {tmp_path / last}"), done.stderr
    assert (tmp_path / last).exists()
