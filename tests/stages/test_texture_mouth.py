"""Choosing mouth poses."""

import numpy as np
import pytest

from bakery.stages.texture_mouth import candidate_poses, ranging, smiling, spread, talking
from bakery.types import EXPRESSION_INDEX


def test_spread_takes_the_ends_of_a_line_first():
    points = np.linspace(0, 1, 101)[:, None]
    assert spread(points, 3).tolist() == [0, 100, 50]


def test_spread_is_even():
    """On a square, farthest-point choice keeps every two points apart by nearly the same."""
    points = np.random.default_rng(0).random((4000, 2))
    chosen = points[spread(points, 60)]
    distance = np.linalg.norm(chosen[:, None] - chosen[None], axis=2) + 9 * np.eye(60)
    nearest = distance.min(1)
    # Greedy choice is a 2-approximation of the best spacing (Gonzalez 1985).
    assert nearest.max() / nearest.min() < 2.05


@pytest.mark.parametrize("kind", [talking, smiling, ranging])
def test_candidates_are_weights_and_begin_with_rest(kind):
    poses = candidate_poses(np.random.default_rng(0), kind, 200)
    assert poses.min() >= 0 and poses.max() <= 1
    assert not poses[0].any() and poses[1:].any(1).mean() > 0.85  # the silent viseme is at rest
    assert (poses[:, EXPRESSION_INDEX["browInnerUp"]] == 0).all()
