"""`bakery shapes`."""

import json

from click.testing import CliRunner

from bakery.cli.main import bakery
from bakery.types import EXPRESSIONS


def test_shapes_lists_every_name():
    text = CliRunner().invoke(bakery, ["shapes"])
    assert text.exit_code == 0
    words = set(text.stdout.replace(",", " ").split())
    assert set(EXPRESSIONS) | {"laugh", "key:anger", "viseme:PP"} <= words
    assert max(map(len, text.stdout.splitlines())) <= 100


def test_shapes_as_json():
    table = json.loads(CliRunner().invoke(bakery, ["shapes", "--json"]).stdout)
    assert table["shapes"] == list(EXPRESSIONS)
    assert table["expressions"]["viseme:AA"] == {
        "jawOpen": 0.6, "mouthLowerDownLeft": 0.2, "mouthLowerDownRight": 0.2,
    }  # fmt: skip
