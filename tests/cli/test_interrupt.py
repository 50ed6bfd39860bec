"""Ctrl-C while the program still imports: exit code 130, and a line instead of a traceback."""

import os
import signal
import subprocess
import sys
import time

import pytest

pytestmark = pytest.mark.skipif(os.name == "nt", reason="sends SIGINT to one process")
CODE = """
import os, signal, sys

_, module, when = sys.argv

class Ending:
    def __del__(self):
        os.kill(os.getpid(), signal.SIGINT)

class Watch:
    def find_spec(self, name, path=None, target=None):
        if name == module:
            print("begun", flush=True)
            if when == "now":
                os.kill(os.getpid(), signal.SIGINT)
            elif when == "ending":
                Ending()

sys.meta_path.insert(0, Watch())
from bakery.__main__ import main
sys.argv[1:] = ["doctor"]
main()
"""


def start(module, when):
    return subprocess.Popen(
        [sys.executable, "-c", CODE, module, when],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        # A shell's background job ignores SIGINT, and so would what it starts.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )  # fmt: skip


def check_end(process):
    said = process.communicate(timeout=60)[1]
    assert process.returncode == 130 and "Traceback" not in said, said
    assert len(said.strip().splitlines()) == 1 and "bakery: interrupted" in said


@pytest.mark.parametrize(
    "module", ["bakery.cli", "bakery.cli.main", "click", "bakery.cli.doctor", "bakery.bake.doctor"]
)
def test_in_the_middle_of_an_import(module):
    check_end(start(module, "now"))


def test_in_a_destructor():
    """Python ignores what a destructor raises, and prints it."""
    check_end(start("bakery.bake.doctor", "ending"))


@pytest.mark.parametrize("delay", [0.0, 0.01, 0.02, 0.03, 0.05, 0.1, 0.3])
def test_in_the_first_moments(delay):
    process = start("bakery.cli", "later")
    assert process.stdout.readline() == "begun\n"
    time.sleep(delay)
    process.send_signal(signal.SIGINT)
    check_end(process)


def test_the_command_is_the_same_either_way():
    """The installed `bakery` begins where `python -m bakery` does."""
    from importlib.metadata import entry_points

    (found,) = [entry for entry in entry_points(group="console_scripts") if entry.name == "bakery"]
    assert found.value == "bakery.__main__:main"
