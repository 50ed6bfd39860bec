"""Whatever writes a picture or a page says which mark it gets: found in the sources, call by call."""

import ast
from pathlib import Path

import pytest

PACKAGE = Path(__file__).resolve().parents[1] / "bakery"
WRITERS = {"write_image", "imwrite", "imsave"}
# Files whose calls need no mark of their own, and why.
MARKED_LATER = {
    "bake/bundle.py": "photo.png is the portrait itself",
    "exporters/preview.py": "`mark.stamp` goes over whole bundles and exports",
    "show/frame.py": "`bakery render` stamps what it drew",
    "cli/each.py": "points and labels drawn over the user's own photo",
    "train/detector/bank.py": "training data, read by nothing but the training",
}


def calls(path):
    text = path.read_text(encoding="utf-8")
    if not any(name in text for name in WRITERS):  # parsing the whole package takes 4 s
        return
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Call):
            name = getattr(node.func, "id", getattr(node.func, "attr", ""))
            if name in WRITERS:
                yield node


def marked(call):
    """A mark is given by name, or as the fourth of `write_image`."""
    return len(call.args) > 3 or any(word.arg == "mark" for word in call.keywords)


FILES = sorted(path for path in PACKAGE.rglob("*.py") if any(calls(path)))


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.relative_to(PACKAGE).as_posix())
def test_every_picture_that_is_written_has_a_mark(path):
    bare = [call.lineno for call in calls(path) if not marked(call)]
    if path.relative_to(PACKAGE).as_posix() in MARKED_LATER:
        assert bare, "is marked now: take it off the list"
    else:
        assert bare == []


def test_every_page_that_is_written_has_a_mark():
    for path in PACKAGE.rglob("*.py"):
        text = path.read_text(encoding="utf-8")
        if "<!doctype html>" in text.lower() and "formats" not in path.parts:
            assert "page_head(" in text, path
