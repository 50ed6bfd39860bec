"""Colours as bytes."""

import numpy as np

from bakery.geometry.color import to_bytes


def test_bytes_are_the_nearest_and_clipped():
    rng = np.random.default_rng(0)
    picture = rng.uniform(-0.3, 1.3, (64, 50, 3)).astype(np.float32)
    wanted = np.rint(np.clip(picture * np.float32(255), 0, 255)).astype(np.uint8)
    np.testing.assert_array_equal(to_bytes(picture), wanted)
