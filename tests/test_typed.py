"""The types that plug-in authors write against are shipped, and held by mypy (`make lint`)."""

import re
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
MYPY = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["mypy"]


def held():
    """The files that mypy checks strictly."""
    for name in MYPY["files"]:
        path = ROOT / name
        yield from sorted(path.rglob("*.py")) if path.is_dir() else [path]


def test_the_package_says_that_it_is_typed():
    assert (ROOT / "bakery" / "py.typed").is_file()


def test_what_plug_ins_are_written_against_is_held():
    bases = sorted((ROOT / "bakery").glob("*/base.py"))
    assert len(bases) >= 5 and MYPY["strict"]
    wanted = {*bases, *(ROOT / "bakery").glob("bake/*.py"), ROOT / "bakery" / "types.py"}
    assert wanted | {ROOT / "tests" / "plugin" / "bakery_example.py"} <= set(held())


@pytest.mark.parametrize("path", list(held()), ids=lambda path: path.relative_to(ROOT).as_posix())
def test_no_type_is_waved_through(path):
    """Nothing is ignored without its reason behind it."""
    lines = path.read_text(encoding="utf-8").splitlines()
    assert [line for line in lines if re.search(r"type: ignore(?!\[[\w-]+\]  # \w)", line)] == []
