"""docs/cli.md says what the commands say; other documents name commands and options that exist."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
# What a reader copies; logs tell of what was.
PAGES = [ROOT / "README.md", *(p for p in DOCS.rglob("*.md") if not p.name.startswith("log"))]


@pytest.fixture(scope="module")
def reference():
    # In a process of its own: click keeps a command's help option from its first call, and other
    # tests call commands without the group, whose `-h` they then never learn of.
    code = "import runpy, sys; sys.stdout.write(runpy.run_path(sys.argv[1])['reference']())"
    command = [sys.executable, "-c", code, str(DOCS / "cli.py")]
    return subprocess.run(command, capture_output=True, check=True, encoding="utf-8").stdout


def test_the_reference_is_that_of_the_commands(reference):
    assert (DOCS / "cli.md").read_text(encoding="utf-8") == reference, "run `make cli`"


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_documents_name_commands_and_options_that_exist(page, reference):
    known = {}
    for path, text in re.findall(
        r"^## bakery (.+?)\n\n```text\n(.+?)\n```", reference, re.M | re.S
    ):
        known[path] = set(re.findall(r"--[a-z][a-z-]*", text))
    text = page.read_text(encoding="utf-8")
    shown = re.findall(r"`bakery ([^`]+)`", text) + re.findall(r"^    bakery (.+)$", text, re.M)
    for line in shown:
        words = line.split()
        if not re.fullmatch(r"[a-z]+", words[0]):
            continue  # bakery --help, bakery COMMAND
        paths = (" ".join(words[:count]) for count in (3, 2, 1))
        path = next((path for path in paths if path in known), words[0])
        assert path in known or words[0] == "mine", line  # a plug-in of docs/plug-ins.md
        for option in re.findall(r"(?<![\w-])--[a-z][a-z-]*", line):
            assert option in known[path] | {"--help"}, f"{line}: {path} has no {option}"
