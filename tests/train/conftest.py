"""Fixtures of the training's tests."""

import numpy as np
import pytest

from bakery.train.closeups.crops import MARGIN, WIDE


@pytest.fixture(scope="session")
def spots():
    """A function of a count and a seed: crops with one bright spot each, and where it is."""

    def paint(count, seed=0):
        rng = np.random.default_rng(seed)
        places = rng.uniform(-0.3, 0.3, (count, 1, 2)).astype(np.float32)
        y, x = np.mgrid[:WIDE, :WIDE] + 0.5
        pixels = (places / MARGIN + 0.5) * WIDE
        value = np.exp(-((x - pixels[..., :1]) ** 2 + (y - pixels[..., 1:]) ** 2) / (2 * 4.0**2))
        return (30 + 200 * value).astype(np.uint8), places

    return paint
