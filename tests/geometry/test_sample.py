"""Samples of pictures at points between pixels."""

import numpy as np

from bakery.geometry.sample import at_corners, at_corners_reference, bilinear


def test_no_points_have_no_values():
    assert bilinear(np.zeros((4, 5, 3), np.float32), np.zeros((0, 2))).shape == (0, 3)


def test_points_beyond_a_row_of_the_library_keep_their_order():
    ramp = np.arange(7, dtype=np.float32)[None]
    points = np.stack([np.linspace(0.5, 6.5, 20_000), np.full(20_000, 0.5)], -1)
    # Positions are rounded to 1/32 pixel by the library.
    assert np.abs(bilinear(ramp, points) - (points[:, 0] - 0.5)).max() < 1 / 32


def test_values_at_corners_are_those_of_the_reference():
    """To the bit, of single and of double precision."""
    rng = np.random.default_rng(2)
    corners = rng.integers(0, 50, (400, 3)).astype(np.int32)
    weights = rng.dirichlet(np.ones(3), 400).astype(np.float32)
    for values in (rng.normal(size=(50, 3)), rng.normal(size=(50, 1)).astype(np.float32)):
        found = at_corners(values, corners, weights)
        assert found.dtype == np.float32
        np.testing.assert_array_equal(found, at_corners_reference(values, corners, weights))
