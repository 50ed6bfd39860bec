"""Every shape does what Apple's description of it says, on its own side."""

import tomllib

import numpy as np
import pytest

from bakery.heads.base import weights
from bakery.heads.embed import mirror_points
from bakery.heads.report.described import DESCRIBED, moved, table
from bakery.preset import find
from bakery.types import EXPRESSIONS


def key(name):
    """The weights of one key expression."""
    return tomllib.loads(find("expressions/keys.toml").read_text())[name]


def test_every_shape_is_described():
    assert set(DESCRIBED) == set(EXPRESSIONS)
    assert all(rules for _, rules in DESCRIBED.values())


@pytest.mark.parametrize("name", EXPRESSIONS)
def test_the_shape_moves_as_described(head, name):
    for rule in DESCRIBED[name][1]:
        assert moved(head, name, rule) >= rule.least, rule


LEFT = {name for name in EXPRESSIONS if name.endswith("Left")}
WAYS = {"jawLeft", "mouthLeft"}  # both sides move that way


@pytest.mark.parametrize("name", sorted(LEFT - WAYS))
def test_the_left_shape_moves_the_left_side(head, name):
    rest = head.landmarks(head.mean)
    shape = head.landmarks(head.vertices(head.mean, weights({name: 1.0}))) - rest
    other = mirror_points(rest[None, :, :2] * [1, -1])
    length = np.linalg.norm(shape, axis=1)
    left = rest[:468, 0] > 8  # mm; nearer the middle both sides take part
    if name.startswith("eyeLook"):
        assert length[473] > 5 and length[468] < 1e-3
    # The lower lip is one muscle for both sides: 2.7 times; all others 6 times and more.
    assert length[:468][left].sum() > 2.5 * length[other[left]].sum()


def test_table_has_a_line_for_each_shape(head):
    lines = table(head).splitlines()
    assert len(lines) == len(EXPRESSIONS) + 2
    assert all(line.count("|") == 4 for line in lines)


def test_puckered_lips_stay_full(head):
    """Corners come in by 40%, not more, and the red of the lips grows: no lips drawn to a point."""
    rest = head.landmarks(head.mean)
    for expression, low, high in (({"mouthPucker": 1.0}, 0.55, 0.6), (key("kiss"), 0.58, 0.7)):
        found = head.landmarks(head.vertices(head.mean, weights(expression)))
        width, upper, lower = (
            np.linalg.norm(found[a] - found[b]) / np.linalg.norm(rest[a] - rest[b])
            for a, b in ((61, 291), (0, 13), (14, 17))
        )
        assert low < width < high
        assert min(upper, lower) > 1
