"""How bright teeth are painted."""

import numpy as np
import pytest

from bakery.stages.texture.interior import teeth_luminance

GRAY = np.ones(3, np.float32)


def test_teeth_follow_the_white_of_the_eye():
    assert teeth_luminance(0.3 * GRAY, 0.3 * GRAY) == pytest.approx(0.51, abs=1e-3)


def test_teeth_never_glare():
    assert teeth_luminance(0.9 * GRAY, 0.5 * GRAY) == pytest.approx(0.75)


def test_a_sclera_that_was_not_seen_does_not_blacken_teeth():
    assert teeth_luminance(0.01 * GRAY, 0.3 * GRAY) == pytest.approx(0.30)


def test_teeth_stay_dim_in_a_dark_photo():
    assert teeth_luminance(0.03 * GRAY, 0.05 * GRAY) == pytest.approx(0.11, abs=1e-3)
