"""Teeth that are painted over: their mean colour is the texture's, all else is the network's."""

import numpy as np
import pytest

from bakery.generators.interior import teeth_relief, teeth_toned
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


def test_teeth_have_the_mean_colour_of_the_texture(mouth):
    color, alpha, shaded, _ = mouth
    made = teeth_toned(*mouth)
    teeth, before = made[12:23, 12:48], color[12:23, 12:48]
    tint = teeth / (teeth @ LUMA)[..., None]
    assert np.abs(tint - before / (before @ LUMA)[..., None]).max() > 0.1
    assert tint[..., 2].min() > 0.78 and (tint[..., 0] > tint[..., 1]).all()
    weight = (before @ LUMA)[..., None]  # what is seen best says most
    mean = (weight * teeth).sum((0, 1)) / weight.sum()
    # A red lip has a small share in the mean.
    assert mean == pytest.approx(shaded[12, 12], rel=0.06)
    assert np.ptp(teeth / before, (0, 1)).max() < 1e-5  # light and shade within stay


def test_teeth_that_the_network_paints_twice_as_bright_look_the_same(mouth):
    color, *others = mouth
    bright = np.where(others[2][..., None] == PARTS.index("teeth_upper"), 2 * color, color)
    bright[24:30] = color[24:30]
    made, same = teeth_toned(bright, *others), teeth_toned(color, *others)
    np.testing.assert_allclose(made[12:23], same[12:23], rtol=0.03)


def test_lips_and_skin_stay(mouth):
    color, *_ = mouth
    made = teeth_toned(*mouth)
    assert np.array_equal(made[24:30], color[24:30]) and np.array_equal(made[:10], color[:10])


def test_without_teeth_nothing_changes(mouth):
    color, alpha, deformed, part = mouth
    skin = np.full_like(part, PARTS.index("skin"))
    assert np.array_equal(teeth_toned(color, alpha, deformed, skin), color)
    assert np.array_equal(teeth_toned(color, 0 * alpha, deformed, part), color)


@pytest.mark.parametrize("exponent", [0.0, 0.6, 1.5])
def test_relief_is_a_power_of_the_gaps_and_not_of_the_tone(exponent):
    """A gap of half the light is that much darker by the power; wide shade is left to others."""
    part = np.full((200, 300), PARTS.index("skin"), np.uint8)
    part[20:180, 20:280] = PARTS.index("teeth_upper")
    shade = np.repeat(np.linspace(0.5, 1.0, 300, dtype=np.float32)[None], 200, 0)
    gap = np.s_[40:160, 150:152]
    shade[gap] *= 0.5
    made = np.exp(exponent * teeth_relief(part, shade, 8.0))  # blurred over 20 pixels
    beside = made[100, [146, 155]].mean()
    assert made[gap].mean() / beside == pytest.approx(0.5**exponent, rel=0.03)
    assert made[60:140, [100, 200]] == pytest.approx(1, abs=0.03)
    assert (made[part == PARTS.index("skin")] == 1).all()
