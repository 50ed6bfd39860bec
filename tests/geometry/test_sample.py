"""Samples of pictures at points between pixels."""

import numpy as np

from bakery.geometry.sample import bilinear


def test_no_points_have_no_values():
    assert bilinear(np.zeros((4, 5, 3), np.float32), np.zeros((0, 2))).shape == (0, 3)


def test_points_beyond_a_row_of_the_library_keep_their_order():
    ramp = np.arange(7, dtype=np.float32)[None]
    points = np.stack([np.linspace(0.5, 6.5, 20_000), np.full(20_000, 0.5)], -1)
    # Positions are rounded to 1/32 pixel by the library.
    assert np.abs(bilinear(ramp, points) - (points[:, 0] - 0.5)).max() < 1 / 32
