"""Key expressions, gazes and mouths of a file."""

import json

import numpy as np
import pytest

from bakery.bake.targets import read_targets
from bakery.errors import BakeryError
from bakery.types import EXPRESSION_INDEX

GOOD = """
[keys.grin]
mouthSmileLeft = 1
mouthSmileRight = 0.5
[gaze]
directions = [[0, 0], [20.0, 5.0]]
[[mouths]]
[[mouths]]
jawOpen = 0.25
"""


def read(tmp_path, text):
    path = tmp_path / "mine.toml"
    path.write_text(text)
    return read_targets(path)


def test_what_a_file_says_takes_the_place_of_what_ships(tmp_path):
    found = read(tmp_path, GOOD)
    assert found.key_names == ("grin",) and found.key_weights.shape == (1, 52)
    assert found.key_weights[0, EXPRESSION_INDEX["mouthSmileRight"]] == 0.5
    assert found.gaze.tolist() == [[0, 0], [20, 5]]
    assert found.mouths.shape == (2, 52) and found.mouths.sum() == 0.25


def test_what_it_lacks_is_what_ships(tmp_path):
    ships, found = read_targets(), read(tmp_path, "[keys.grin]\njawOpen = 1\n")
    assert len(ships.key_names) == 6 and len(ships.gaze) == 20 and len(ships.mouths) == 300
    assert np.array_equal(found.gaze, ships.gaze) and np.array_equal(found.mouths, ships.mouths)
    assert found.digest != ships.digest == read_targets().digest


@pytest.mark.parametrize(
    "text, message",
    [
        ("# nothing", "holds nothing"),
        ("", "an empty file"),
        ("[[", "not valid TOML"),
        ("[smiles]", "unknown smiles"),
        ("keys = 3", "keys needs 1 to 64"),
        ("[keys]", "keys needs 1 to 64"),
        ("[keys.'a b']\njawOpen = 1", "'a b'; give a name of letters"),
        ("[keys.neutral]\njawOpen = 1", "not neutral"),
        ("[keys.a]\njawOpen = 'x'", "give shape = weight"),
        ("[keys.a]\njawOpen = true", "give shape = weight"),
        ("[keys.a]\njawopen = 1", "jawOpen"),
        ("[keys.a]\njawOpen = 1.5", "0 to 1"),
        ("[keys.a]\njawOpen = nan", "0 to 1"),
        ("mouths = []", "mouths needs 1 to 300"),
        ("mouths = [1]", "give shape = weight"),
        ("[gaze]", "directions = "),
        ("[gaze]\ndirections = []", "directions = "),
        ("[gaze]\ndirections = [[1]]", "directions = "),
        ("[gaze]\ndirections = [[90, 0]]", "beyond 45"),
        ("[gaze]\ndirections = [[nan, 0]]", "beyond 45"),
    ],
)
def test_bad_files_are_one_line(tmp_path, text, message):
    with pytest.raises(BakeryError, match=message) as found:
        read(tmp_path, text)
    assert "\n" not in str(found.value)


def test_a_bake_with_them(bakery, portrait, tmp_path):
    photo, marks = portrait
    (tmp_path / "mine.toml").write_text(GOOD)
    out = tmp_path / "a.avatar"
    done = bakery(
        "build", photo, "--landmarks", marks, "-o", out, "--expressions", tmp_path / "mine.toml",
        "--preset", "small", "--set", "texture.views=[0.0]", "--generator", "rendered",
        "--set", "bundle.formats=[]", "--hair", "none", "--complete", "none",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    manifest = json.loads((out / "avatar.json").read_text())
    assert [key["name"] for key in manifest["keys"]] == ["grin"]
    assert len(manifest["gaze"]["parts"]) == 2 and len(manifest["mouths"]["weights"]) == 2
    assert bakery("validate", out).returncode == 0
    done = bakery("render", out, "-o", tmp_path / "a.png", "--weights", "jawOpen=0.3", "--size", 64)
    assert done.returncode == 0, done.stderr
