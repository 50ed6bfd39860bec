"""Lids close on everybody's eyes."""

import numpy as np
import pytest

from bakery.geometry.raster import rasterize
from bakery.heads.base import PROXIES, weights
from bakery.stages.fit.lids import LOWER, UPPER, close_lids

BLINK = weights({"eyeBlinkLeft": 1, "eyeBlinkRight": 1})


@pytest.mark.parametrize("seed", range(6))
def test_no_eye_shows_through_a_blink(head, seed):
    rng = np.random.default_rng(seed)
    neutral = head.neutral(rng.normal(size=len(head.identity_basis)))
    own = close_lids(head, neutral)
    shut = own.vertices(neutral, BLINK, (0, 0)).astype(float)
    hidden = head.part_faces(*PROXIES, "lashes", "tear")
    shown = np.setdiff1d(np.arange(len(head.faces)), hidden)
    for yaw in (-40, 0, 40):
        c, s = np.cos(np.radians(yaw)), np.sin(np.radians(yaw))
        turned = shut @ np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]).T
        pixels = np.stack([300 + 5 * turned[:, 0], 200 - 5 * turned[:, 1]], 1)
        found = rasterize(pixels, 600 - turned[:, 2], head.faces[shown], (400, 600), cull=True)
        part = head.face_part[shown[np.maximum(found.face, 0)]]
        eyes = (found.face >= 0) & np.isin(part, [3, 4])
        assert eyes.sum() == 0, f"yaw {yaw}: {eyes.sum()} pixels of eyeball"


@pytest.mark.parametrize("seed", range(4))
def test_every_column_overlaps_a_little(head, seed):
    neutral = head.neutral(np.random.default_rng(seed).normal(size=len(head.identity_basis)))
    own = close_lids(head, neutral)
    shut = own.landmarks(own.vertices(neutral, BLINK, (0, 0)))
    rest = own.landmarks(neutral)
    for upper, lower in zip(UPPER, LOWER):
        opening = (rest[upper, 1] - rest[lower, 1]).max()
        overlap = (shut[lower, 1] - shut[upper, 1]) / opening
        assert overlap.min() > 0.02 and overlap.max() < 0.08
        # A spike would be one column that stands out from its neighbours.
        assert np.abs(np.diff(overlap)).max() < 0.03


def test_the_head_given_is_left_alone(head):
    before = head.expression_basis.copy()
    close_lids(head, head.neutral(np.zeros(1)))
    np.testing.assert_array_equal(head.expression_basis, before)
