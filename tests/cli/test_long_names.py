"""Names that no file system takes: one line that says so, from every command, and soon."""

import os

import pytest

LONG = "n" * 300
COMMANDS = {
    "build": ["build", "PHOTO", "-o", f"{LONG}.avatar"],
    "dry run": ["build", "PHOTO", "-n", "-o", LONG],
    "work": ["build", "PHOTO", "-o", "a.avatar", "--work", LONG],
    "photo": ["build", LONG, "-o", "a.avatar"],
    "head": ["build", "PHOTO", "--head", LONG, "-n", "-o", "a.avatar"],
    "landmarks": ["build", "PHOTO", "--landmarks", LONG, "-n", "-o", "a.avatar"],
    "detect": ["detect", "PHOTO", "-o", f"{LONG}.json"],
    "fit": ["fit", "PHOTO", "-o", f"{LONG}.json"],
    "inspect": ["inspect", LONG],
    "validate": ["validate", LONG],
    "preview": ["preview", "PHOTO", "-o", f"{LONG}.html"],
    "module": ["preview", "PHOTO", "--module", LONG],
    "render": ["render", LONG, "-o", "a.png"],
    "animate": ["animate", "a.avatar", "--curves", LONG, "-o", "a.webm"],
    "retarget": ["retarget", LONG, "-o", "take.csv"],
    "heads": ["heads", "show", LONG],
}


@pytest.mark.parametrize("name", COMMANDS)
def test_long_names_are_one_line(name, bakery, portrait, tmp_path):
    command = [portrait[0] if word == "PHOTO" else word for word in COMMANDS[name]]
    done = bakery(*command, cwd=tmp_path)
    assert done.returncode in (1, 2) and done.stdout == "" and "Traceback" not in done.stderr
    assert len(done.stderr.splitlines()) == 1 and (
        "too long" in done.stderr or "no bundle" in done.stderr
    )
    assert os.listdir(tmp_path) == []
