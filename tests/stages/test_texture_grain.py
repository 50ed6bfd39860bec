"""Grain is as wide as it is long on the skin, however the texture lies on it."""

import cv2
import numpy as np
import pytest

from bakery.stages.texture.grain import rounded

SIDE = 256
NOISE = np.random.default_rng(0).normal(size=(SIDE, SIDE, 3)).astype(np.float32)


def shapes(wide, lean, high):
    out = np.empty((SIDE, SIDE, 3), np.float32)
    out[:] = wide, lean, high
    return out


def length_over_width(grain, wide, lean, high):
    """Of the grain of a texture on the skin: by the mean of squares of its slopes there."""
    step = 0.2  # mm
    middle = SIDE / 2
    across, along = np.meshgrid(*[np.arange(-150, 150) * step] * 2)
    v = along / high
    u = (across - lean * v) / wide
    skin = cv2.remap(
        grain, np.float32(u + middle), np.float32(v + middle), cv2.INTER_LINEAR
    )[..., 0]  # fmt: skip
    dx = (skin[1:-1, 2:] - skin[1:-1, :-2]).ravel()
    dy = (skin[2:, 1:-1] - skin[:-2, 1:-1]).ravel()
    low, high = np.linalg.eigvalsh(np.cov(dx, dy))
    return np.sqrt(high / low)


@pytest.mark.parametrize(
    "shape", [(1, 0, 3), (0.5, 0.5, 3.3), (0.92, 0.98, 0.99), (0.9, -1, 1), (2, 0, 1)]
)
def test_stretched_texels_show_no_streaks(shape):
    before = length_over_width(NOISE, *shape)
    after = length_over_width(rounded(NOISE, shapes(*shape)), *shape)
    # 1.05 to 1.12, and 1.57 where texels lean by 45 degrees: their tents are no ellipses there.
    assert before > 1.8 and after < 1.65


def test_square_texels_stay_as_they_are():
    np.testing.assert_allclose(rounded(NOISE, shapes(0.3, 0, 0.3)), NOISE, atol=1e-5)
    np.testing.assert_allclose(rounded(NOISE, shapes(0, 0, 0)), NOISE, atol=1e-5)  # off the charts


def test_tone_stays():
    plain = np.full((SIDE, SIDE, 3), 0.25, np.float32)
    np.testing.assert_allclose(rounded(plain, shapes(0.5, 0.5, 3.3)), plain, atol=1e-5)
