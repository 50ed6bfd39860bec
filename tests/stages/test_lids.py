"""Lids close on everybody's eyes."""

import numpy as np
import pytest

from bakery.geometry.raster import rasterize
from bakery.heads.base import CARRIERS, weights
from bakery.stages.lids import LOWER, UPPER, close_lids

BLINK = weights({"eyeBlinkLeft": 1, "eyeBlinkRight": 1})


@pytest.mark.parametrize("seed", range(6))
def test_no_eye_shows_through_a_blink(head, seed):
    rng = np.random.default_rng(seed)
    modes = min(20, len(head.identity_basis))
    neutral = head.neutral(rng.normal(size=modes) * 0.8)
    own = close_lids(head, neutral)
    shut = own.vertices(neutral, BLINK, (0, 0)).astype(float)
    hidden = head.part_faces(*CARRIERS, "lashes", "tear")
    shown = np.setdiff1d(np.arange(len(head.faces)), hidden)
    for yaw in (-40, 0, 40):
        c, s = np.cos(np.radians(yaw)), np.sin(np.radians(yaw))
        turned = shut @ np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]).T
        pixels = np.stack([200 + 2.5 * turned[:, 0], 200 - 2.5 * turned[:, 1]], 1)
        found = rasterize(pixels, 600 - turned[:, 2], head.faces[shown], (400, 400), cull=True)
        part = head.face_part[shown[np.maximum(found.face, 0)]]
        eyes = (found.face >= 0) & np.isin(part, [3, 4])
        open_eyes = 2 * 60 * 25  # pixels of two open eyes at this scale, roughly
        # A few pixels at the corners are the caruncle's edge; one in a hundred is not seen.
        assert eyes.sum() < 0.01 * open_eyes, f"yaw {yaw}: {eyes.sum()} pixels of eyeball"


def test_overlap_is_small(head):
    neutral = head.neutral(np.zeros(1))
    own = close_lids(head, neutral)
    shut = own.landmarks(own.vertices(neutral, BLINK, (0, 0)))
    rest = own.landmarks(neutral)
    for upper, lower in zip(UPPER, LOWER):
        opening = (rest[list(upper), 1] - rest[list(lower), 1]).max()
        overlap = (shut[list(lower), 1] - shut[list(upper), 1])[2:-2] / opening
        # 8% is aimed at; lying on the ball and smoothing along the lid move single columns.
        assert 0.02 < overlap.mean() < 0.15


def test_the_head_given_is_left_alone(head):
    before = head.expression_basis.copy()
    close_lids(head, head.neutral(np.zeros(1)))
    np.testing.assert_array_equal(head.expression_basis, before)
