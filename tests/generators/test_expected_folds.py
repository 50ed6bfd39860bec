"""Expected folds: none at rest, where the acting muscle puts them, shaded by the light."""

import gc
import weakref
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from bakery.generators import expected_folds
from bakery.generators.expected_folds import FULL, fold_channels
from bakery.generators.folds import joined, make_folds
from bakery.generators.pagan import PaganGenerator
from bakery.generators.strain import landmark_fragments
from bakery.generators.unet import NetworkOptions, UNet
from bakery.geometry import camera as cameras
from bakery.heads.base import weights
from bakery.types import Camera

SIDE = 320
SMILE = {"mouthSmileLeft": 1.0, "mouthSmileRight": 1.0}
RISE = {"browInnerUp": 1.0, "browOuterUpLeft": 1.0, "browOuterUpRight": 1.0}
CHEEKS, FOREHEAD = [205, 206, 207, 216], [66, 69, 104, 105, 108, 107]  # landmarks


def lit(*direction):
    """Light [9, 3] that falls from a direction, and from all sides."""
    light = np.zeros((9, 3))
    light[0] = 3.0
    light[[3, 1, 2]] = np.array(direction, float)[:, None]
    return light


SUN = lit(0, 0.8, 0.6)
FRONT = Camera(200.0, np.full(2, 32.0), np.zeros(3), np.array([0, 0, -700.0]), 64, 64)


@pytest.fixture(scope="module")
def seen(head):
    """(weights, light) -> height mm and log-shading [H, W, 2], and the landmarks' pixels."""
    camera = Camera(1000.0, np.full(2, SIDE / 2), np.zeros(3), np.array([0, 0, -700.0]), SIDE, SIDE)

    def look(named, light=SUN):
        expression = weights(named)
        pixels = cameras.project(head.landmarks(head.vertices(head.mean, expression)), camera)
        found = landmark_fragments(head, pixels, (SIDE, SIDE))
        drawn = fold_channels(head, expression, light, found)
        return (drawn.astype(float) - 128) / 127 * FULL, pixels

    return look


def around(drawn, pixels, landmarks):
    """The part of a channel that some landmarks enclose."""
    low, high = pixels[landmarks].min(0).astype(int), pixels[landmarks].max(0).astype(int) + 1
    return drawn[low[1] : high[1], low[0] : high[0]]


def test_rest_folds_nothing(seen):
    drawn, _ = seen({})
    assert drawn.shape == (SIDE, SIDE, 2) and (drawn == 0).all()


def test_each_muscle_folds_its_own_skin(seen):
    for mix, here, there in ((SMILE, CHEEKS, FOREHEAD), (RISE, FOREHEAD, CHEEKS)):
        drawn, pixels = seen(mix)
        assert np.ptp(around(drawn[..., 0], pixels, here)) > 0.3  # mm
        assert np.ptp(around(drawn[..., 0], pixels, there)) < 0.05


def test_light_from_the_other_side_turns_the_shading(seen):
    # Lines across a forehead: light from above and from below shade them the other way round.
    above, below = (seen(RISE, lit(0, y, 0.4))[0] for y in (0.9, -0.9))
    assert_allclose(above[..., 0], below[..., 0])
    level = np.abs(above[..., 1]) > 0.02
    assert level.sum() > 50
    assert (np.sign(above[..., 1][level]) == -np.sign(below[..., 1][level])).mean() > 0.95


def test_light_from_everywhere_shades_nothing(seen):
    drawn, _ = seen(SMILE, lit(0, 0, 0))
    assert_allclose(drawn[..., 1], 0, atol=FULL[1] / 127)


def test_a_piece_of_a_head_folds_as_the_whole(head):
    mouth = head.landmarks(head.mean)[13]
    near = np.linalg.norm(head.mean - mouth, axis=1) < 55
    piece = head.cut(np.flatnonzero(near[head.faces].all(1)))
    expression, shape = weights(SMILE | {"jawOpen": 0.4}), (SIDE, SIDE)
    camera = Camera(2500.0, np.full(2, SIDE / 2), np.zeros(3), np.array([0, 60, -700.0]), *shape)
    pixels = cameras.project(head.landmarks(head.vertices(head.mean, expression)), camera)
    found = landmark_fragments(head, pixels, shape)
    whole, part = (fold_channels(one, expression, SUN, found) for one in (head, piece))
    here = np.linalg.norm(np.indices(shape).T - pixels[13], axis=2) < 2500 / 700 * 40
    assert np.ptp(whole[here][:, 0].astype(int)) > 40
    apart = np.abs(whole.astype(int) - part)[here]
    # Folds at the rim are felt by the faces that are left of those they had.
    assert apart.mean() < 0.3 and np.quantile(apart, 0.99) <= 4
    with pytest.raises(ValueError, match="whole"):
        piece.cut(np.arange(3))


def test_people_are_drawn_once_and_let_go(head, monkeypatch):
    other = replace(head, mean=head.mean + np.float32(0))
    PaganGenerator(UNet(NetworkOptions(channels=(8, 8)), folded=True)).get_ready(other)
    monkeypatch.setattr(expected_folds, "_built", None)
    found = landmark_fragments(other, cameras.project(other.landmarks(other.mean), FRONT), (64, 64))
    fold_channels(replace(other, name="lively"), weights(SMILE), SUN, found)
    kept = weakref.ref(expected_folds._mean(other))
    assert expected_folds._mean(other) is kept()
    del other
    gc.collect()
    assert kept() is None


def test_the_mean_of_people_is_the_mean_of_their_reliefs(head):
    points = head.landmarks(head.mean)[:468].astype(np.float32)
    people = [make_folds(head, head.mean, points, np.random.default_rng(k), 50) for k in (1, 2)]
    shape = head.vertices(head.mean, weights(SMILE))
    apart = [folds.relief(folds.depths(shape)) for folds in people]
    both = joined(people)
    assert np.abs(apart).max() > 0.1
    assert_allclose(both.relief(both.depths(shape)), np.mean(apart, 0), atol=1e-5)


@pytest.mark.parametrize("rows", [np.s_[:], np.s_[40:-40]])
def test_drawn_shading_is_that_of_the_reference(rows):
    """To the bit, at the borders of the map too."""
    side, rng = expected_folds.TEXELS, np.random.default_rng(4)
    index = np.arange(side * side).reshape(side, side)[rows].ravel()
    relief = rng.normal(size=len(index)).astype(np.float32)
    lit = rng.normal(size=(len(index), 2)).astype(np.float32)
    out = np.zeros((side, side, 2), np.float32)
    expected_folds._draw(index, relief, lit, out)
    height = np.zeros((side, side), np.float32)
    height.flat[index] = relief
    np.testing.assert_array_equal(out[..., 0], height)
    wanted = expected_folds.shaded_reference(height, index, lit)
    np.testing.assert_array_equal(out[..., 1].flat[index], wanted)
