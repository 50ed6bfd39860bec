"""Strain of the skin: nothing at rest, the muscles' own directions, the same on both sides."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from bakery.generators.strain import FULL, landmark_fragments, strain_channels
from bakery.geometry import camera as cameras
from bakery.heads.base import weights
from bakery.types import Camera

GLABELLA, FOREHEAD, CHEEK_LEFT, CHEEK_RIGHT = 9, 151, 425, 205  # landmarks


@pytest.fixture(scope="module")
def seen(head):
    """(weights) -> the channels and where the landmarks lie in them."""
    middle = np.array([128.0, 128.0])
    camera = Camera(900.0, middle, np.zeros(3), np.array([0, 0, -700.0]), 256, 256)

    def look(named):
        expression = weights(named)
        pixels = cameras.project(head.landmarks(head.vertices(head.mean, expression)), camera)
        found = landmark_fragments(head, pixels, (256, 256))
        return strain_channels(head, expression, pixels, found), pixels

    return look


def at(drawn, pixels, landmark):
    """Log stretch [2] under a landmark."""
    column, row = pixels[landmark].astype(int)
    return (drawn[row, column].astype(float) - 128) / 127 * FULL


def test_rest_strains_nothing(seen):
    drawn, _ = seen({})
    assert drawn.shape == (256, 256, 2)
    assert_allclose(drawn, 128, atol=1)


def test_brows_that_frown_press_the_glabella_across(seen):
    across, along = at(*seen({"browDownLeft": 1.0, "browDownRight": 1.0}), GLABELLA)
    assert across < -0.05 and across < along


def test_brows_that_rise_press_the_forehead_along(seen):
    rise = {"browInnerUp": 1.0, "browOuterUpLeft": 1.0, "browOuterUpRight": 1.0}
    across, along = at(*seen(rise), FOREHEAD)
    assert along < -0.05 and along < across


def test_one_corner_strains_its_own_side_and_mirrors(seen):
    left, right = (seen({f"mouthSmile{side}": 1.0}) for side in ("Left", "Right"))
    here, there = at(*left, CHEEK_LEFT), at(*left, CHEEK_RIGHT)
    assert np.abs(here).max() > 3 * np.abs(there).max()
    assert_allclose(at(*right, CHEEK_RIGHT), here, atol=0.02)  # a pixel's place


def test_outside_the_face_there_is_none(seen):
    drawn, _ = seen({"jawOpen": 1.0})
    assert (drawn[:5] == 128).all() and (drawn[:, :5] == 128).all()
