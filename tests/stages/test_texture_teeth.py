"""The tone of teeth: seen between open lips, else likely by the skin."""

import cv2
import numpy as np
import pytest
from numpy.testing import assert_allclose

from bakery.geometry.color import LUMA
from bakery.landmarks import EYES, LIPS_INNER, LIPS_INNER_LOWER, LIPS_INNER_UPPER
from bakery.stages.texture.teeth import likely_teeth, seen_teeth, teeth_color

SKIN = np.array([0.5, 0.3, 0.2], np.float32)
TEETH = np.array([0.6, 0.5, 0.4], np.float32)
GUMS = np.array([0.4, 0.15, 0.15], np.float32)


def face(opening, teeth=TEETH, side=400):
    """A flat face [side, side, 3] whose lips are `opening` pixels apart, and its points [478, 2]."""
    points = np.full((478, 2), side / 2.0)
    points[EYES[0][0]], points[EYES[1][0]] = (300, 120), (100, 120)
    across = np.linspace(140, 260, len(LIPS_INNER_UPPER))
    arch = opening / 2 * np.sin(np.linspace(0, np.pi, len(across)))
    points[LIPS_INNER_UPPER] = np.column_stack([across, 280 - arch])
    points[LIPS_INNER_LOWER] = np.column_stack([across, 280 + arch])
    picture = np.empty((side, side, 3), np.float32)
    picture[:] = SKIN
    mouth = np.zeros((side, side), np.uint8)
    cv2.fillPoly(mouth, [np.round(points[LIPS_INNER]).astype(np.int32)], 1)
    picture[mouth > 0] = teeth
    return picture, points


def test_teeth_are_as_they_are_seen():
    picture, points = face(40)
    picture[:, 198:203] *= 0.1  # a gap
    picture[278:282] += 0.3  # a glint
    seen = seen_teeth(picture, points)
    assert seen.share == 1
    assert_allclose(seen.color, TEETH, atol=1e-5)
    likely = likely_teeth(picture, points)
    assert_allclose(teeth_color(picture, points, likely), TEETH, atol=1e-5)


@pytest.mark.parametrize("opening", [0, 4])
def test_closed_lips_show_none(opening):
    picture, points = face(opening)
    assert seen_teeth(picture, points) is None
    assert teeth_color(picture, points, TEETH) is TEETH


def test_a_mouth_of_gums_shows_none():
    assert seen_teeth(*face(40, GUMS)) is None


def test_an_empty_mouth_is_no_dark_teeth():
    picture, points = face(40, 0.1 * TEETH)
    likely = likely_teeth(picture, points)
    assert_allclose(teeth_color(picture, points, likely), likely)


def test_few_teeth_tell_less():
    shares = [seen_teeth(*face(opening)).share for opening in (14, 20, 26)]
    assert shares == sorted(shares)
    assert 0 < shares[0] < 1


def test_likely_teeth_follow_the_skin_down_and_its_tint():
    picture, points = face(0)
    own, dim = likely_teeth(picture, points), likely_teeth(0.25 * picture, points)
    # Half of congress/train has teeth of 1.26 to 1.61 times the skin's luminance.
    assert 1.2 < own @ LUMA / (SKIN @ LUMA) < 1.7
    # By the slope of 0.722, not as far down as the skin: dark skin in the same light has white teeth.
    assert dim @ LUMA / (own @ LUMA) == pytest.approx(0.25**0.722, rel=1e-3)
    gray = likely_teeth(np.full_like(picture, 0.3), points)
    assert own[0] / own[2] > gray[0] / gray[2] > 1
