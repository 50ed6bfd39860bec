"""Averaging pictures down."""

import numpy as np
import pytest

from bakery.geometry.shrink import shrink


def test_eighths_are_means_of_squares():
    picture = np.random.default_rng(0).random((48, 64, 3)).astype(np.float32)
    small, pixels = shrink(picture, (8, 6))
    wanted = picture.reshape(6, 8, 8, 8, 3).mean((1, 3))
    np.testing.assert_allclose(small, wanted, atol=1e-6)
    np.testing.assert_array_equal(pixels, [8, 8])


@pytest.mark.parametrize("dtype", [np.uint8, np.float32])
def test_places_are_kept_where_odd_rows_are_left_out(dtype):
    """A ramp keeps its values at the places that the scale tells of."""
    y, x = np.mgrid[:203, :301] + 0.5
    picture = (x / 2 + y / 3).astype(dtype)
    small, pixels = shrink(picture, (41, 30))
    assert small.shape == (30, 41) and small.dtype == dtype
    y, x = np.mgrid[:30, :41] + 0.5
    wanted = x * pixels[0] / 2 + y * pixels[1] / 3
    np.testing.assert_allclose(small, wanted, atol=1.5 if dtype == np.uint8 else 0.3)


def test_a_picture_of_that_size_stays():
    picture = np.random.default_rng(1).integers(0, 256, (9, 7, 3), np.uint8)
    same, pixels = shrink(picture, (7, 9))
    np.testing.assert_array_equal(same, picture)
    np.testing.assert_array_equal(pixels, [1, 1])
