"""`bakery evaluate complete` measures the ways that are asked for."""

import pytest
from click.testing import CliRunner

from bakery.cli.main import bakery
from bakery.evaluate import completion
from bakery.stages.texture import METHODS


@pytest.mark.parametrize(
    "given, measured",
    [((), list(METHODS)), (("--way", "synthesize", "--way", "none"), ["none", "synthesize"])],
)
def test_ways(monkeypatch, tmp_path, given, measured):
    asked = []
    monkeypatch.setattr(
        completion, "everybody", lambda portraits, head, ways, *rest: asked.extend(ways) or ()
    )
    done = CliRunner().invoke(bakery, ["evaluate", "complete", str(tmp_path), *given])
    assert done.exit_code == 0, done.output
    assert asked == measured


def test_an_unknown_way(tmp_path):
    done = CliRunner().invoke(bakery, ["evaluate", "complete", str(tmp_path), "--way", "magic"])
    assert done.exit_code == 2
    assert "'magic' is not one of" in done.output
