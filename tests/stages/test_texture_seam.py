"""Closed lips of open ones: lips where none were seen, a dark seam, and nothing else changed."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from bakery import landmarks as marks
from bakery.geometry.color import LUMA
from bakery.geometry.curve import nearest_on
from bakery.stages.atlas import make_atlas
from bakery.stages.fit.warp import opened
from bakery.stages.texture import seam

LIP, SKIN, TEETH = np.array([0.4, 0.12, 0.14]), np.array([0.45, 0.28, 0.22]), 0.6


@pytest.fixture(scope="module")
def mouth(head):
    """Atlas of skin; of each texel the way from rim to border of its lip, and whether that is the upper."""
    on_skin = make_atlas(head, 512).take("skin")
    apart = opened(head)
    wide = head.landmarks(apart)
    ways = [seam._way(on_skin.at(apart), wide[rim], wide[border]) for rim, border in seam.RINGS]
    upper = ways[0][1] <= ways[1][1]
    return on_skin, np.where(upper, ways[0][0], ways[1][0]), upper


def points_of(head, gap):
    """Landmarks [L, 2] in pixels, the lips so far apart, over the mouth's width."""
    points = head.landmarks(head.mean)[:, :2] * [1, -1]
    width = np.ptp(points[marks.MOUTH_CORNERS, 0])
    points[marks.LIPS_INNER_LOWER[1:-1]] = points[marks.LIPS_INNER_UPPER[1:-1]] + [0, gap * width]
    return points


def test_openness(head):
    assert_allclose(seam.openness(points_of(head, 0.0)), 0)
    assert_allclose(seam.openness(points_of(head, 0.013)), 0.5, atol=1e-6)
    assert_allclose(seam.openness(points_of(head, 0.1)), 1)


def test_closed_lips_are_left_alone(head, mouth):
    on_skin, _, _ = mouth
    colors = np.random.default_rng(0).uniform(0.1, 0.6, (len(on_skin.index), 3))
    facing = np.zeros(len(colors))
    closed = points_of(head, 0.0)
    assert seam.closed_lips(colors, facing, head, head.mean, on_skin, closed) is colors


def test_rims_that_nobody_saw_become_lips(head, mouth):
    on_skin, way, upper = mouth
    rim = way <= 0.4
    colors = np.where((way < 1)[:, None], LIP, SKIN)
    colors[rim] = TEETH
    facing = np.where(rim, 0.0, 1.0)
    made = seam.closed_lips(colors, facing, head, head.mean, on_skin, points_of(head, 0.1))
    places = on_skin.at(head.mean)
    line, along = nearest_on(places, head.landmarks(head.mean)[marks.LIPS_INNER_LOWER])
    middle = (along > 0.2) & (along < 0.8)
    hue = made / made.sum(1, keepdims=True)
    wanted = np.tile(LIP / LIP.sum(), ((rim & middle).sum(), 1))
    assert_allclose(hue[rim & middle], wanted, atol=0.02)
    # Darker toward the seam, as closed lips are.
    away = np.linalg.norm(places - line, axis=1)
    lower = middle & ~upper & rim & (way > 0)
    assert away[lower].min() < 0.6 and away[lower].max() > 1.2
    fall = seam.DEPTH_LOWER * np.exp(-((away[lower] / seam.FADE_LOWER) ** 2))
    assert_allclose(np.log(made[lower] @ LUMA / (LIP @ LUMA)), -fall, atol=0.01)
    # Skin is as it was.
    assert_array_equal(made[way > 1.05], colors[way > 1.05])


def test_what_is_dark_stays_in_the_middle_and_is_a_gap_beside_the_corners(head, mouth):
    on_skin, way, _ = mouth
    colors = np.tile(LIP, (len(way), 1))
    dark = (way > 0) & (way < 0.4)
    colors[dark] = 0.02  # darker than any seam
    made = seam.closed_lips(
        colors, np.ones(len(way)), head, head.mean, on_skin, points_of(head, 0.1)
    )
    line = head.landmarks(head.mean)[marks.LIPS_INNER_LOWER]
    along = (on_skin.at(head.mean)[:, 0] - line[0, 0]) / (line[-1, 0] - line[0, 0])
    off = np.abs(along - 0.5)
    assert_array_equal(made[dark & (off < seam.BESIDE[0])], 0.02)
    gap = dark & (off > seam.BESIDE[1]) & (off < 0.5 - seam.END)
    deepest = max(seam.DEPTH_LOWER, seam.DEPTH_UPPER + seam.DEPTH_CORNER)
    assert gap.any() and (made[gap] @ LUMA >= LIP @ LUMA * np.exp(-deepest) * 0.99).all()
