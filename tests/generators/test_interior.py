"""Teeth that are painted over: their tint is the texture's, all else is the network's."""

import numpy as np
import pytest

from bakery.generators.interior import teeth_tinted
from bakery.geometry.color import LUMA
from bakery.heads.base import PARTS

TINT = np.array([1.12, 0.975, 0.89], np.float32)


@pytest.fixture
def mouth():
    """Greenish teeth with shade and a red lip before their lower half; skin around: colour, alpha,
    deformed neutral, part."""
    part = np.full((40, 60), PARTS.index("skin"), np.uint8)
    part[10:30, 10:50] = PARTS.index("teeth_upper")
    shade = np.linspace(0.2, 1, 40, dtype=np.float32)[None, :, None]
    color = np.full((40, 60, 3), (0.3, 0.2, 0.15), np.float32)
    color[10:30, 10:50] = np.float32([0.50, 0.55, 0.38]) * shade
    color[24:30, 10:50] = (0.4, 0.1, 0.1)
    deformed = np.full((40, 60, 3), 0.3, np.float32)
    deformed[10:30, 10:50] = 0.6 * TINT
    return color, np.ones((40, 60), np.float32), deformed, part


def test_teeth_have_the_tint_of_the_texture(mouth):
    color, alpha, _, _ = mouth
    made = teeth_tinted(*mouth)
    teeth, before = made[12:23, 12:48], color[12:23, 12:48]
    tint = teeth / (teeth @ LUMA)[..., None]
    assert np.abs(tint - before / (before @ LUMA)[..., None]).max() > 0.1
    assert tint[..., 2].min() > 0.78 and (tint[..., 0] > tint[..., 1]).all()
    assert teeth @ LUMA == pytest.approx(before @ LUMA, rel=0.06)  # light and shade stay
    assert np.ptp((teeth / before)[..., 1]) < 1e-5  # and are not moved about


def test_lips_and_skin_stay(mouth):
    color, *_ = mouth
    made = teeth_tinted(*mouth)
    assert np.array_equal(made[24:30], color[24:30]) and np.array_equal(made[:10], color[:10])


def test_without_teeth_nothing_changes(mouth):
    color, alpha, deformed, part = mouth
    skin = np.full_like(part, PARTS.index("skin"))
    assert np.array_equal(teeth_tinted(color, alpha, deformed, skin), color)
    assert np.array_equal(teeth_tinted(color, 0 * alpha, deformed, part), color)
