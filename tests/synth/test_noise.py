"""Fields in space: slopes, scale, sameness."""

import numpy as np
import pytest

from bakery.synth.noise import cells, gradient_noise


@pytest.fixture
def points():
    return np.random.default_rng(0).uniform(-40, 40, (400, 3)).astype(np.float32)


def test_gradient_is_the_slope(points):
    """Central differences of the value give the gradient that is returned with it."""
    _, slope = gradient_noise(points, 20.0, 5, octaves=2)
    step = 0.02
    for axis in range(3):
        move = np.eye(3, dtype=np.float32)[axis] * step
        ahead = gradient_noise(points + move, 20.0, 5, octaves=2)[0]
        behind = gradient_noise(points - move, 20.0, 5, octaves=2)[0]
        # float32 values of about 0.5 divided by 0.04 mm: rounding alone gives 3e-6
        np.testing.assert_allclose((ahead - behind) / (2 * step), slope[:, axis], atol=2e-4)


def test_noise_is_zero_at_lattice_points():
    lattice = np.array([[0, 0, 0], [6, -3, 9], [-12, 3, 3]], np.float32)
    np.testing.assert_allclose(gradient_noise(lattice, 3.0, 1)[0], 0, atol=1e-6)


def test_noise_depends_on_the_seed_alone(points):
    same = [gradient_noise(points, 4.0, 7)[0] for _ in range(2)]
    np.testing.assert_array_equal(*same)
    assert np.abs(same[0] - gradient_noise(points, 4.0, 8)[0]).max() > 0.1


def test_cells_are_near(points):
    """The nearest of jittered points, one a cell, is never further than a cell's diagonal."""
    distance, own = cells(points, 5.0, 3)
    assert distance.min() >= 0 and distance.max() < 5 * 3**0.5
    assert 0 <= own.min() and own.max() <= 1
