"""L-BFGS finds known minima."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from bakery.geometry.lbfgs import minimize


@pytest.fixture()
def rng():
    return np.random.default_rng(0)


def rosenbrock(x):
    a, b = x
    value = (1 - a) ** 2 + 100 * (b - a * a) ** 2
    return value, np.array([-2 * (1 - a) - 400 * a * (b - a * a), 200 * (b - a * a)])


def test_rosenbrock():
    assert_allclose(minimize(rosenbrock, np.array([-1.2, 1.0]), 100), 1, atol=1e-5)


def test_a_quadratic_of_bad_condition(rng):
    rotation = np.linalg.qr(rng.normal(size=(40, 40)))[0]
    hessian = rotation * np.geomspace(0.1, 10, 40) @ rotation.T
    wanted = rng.normal(size=40)

    def value(x):
        slope = hessian @ (x - wanted)
        return float(slope @ (x - wanted)) / 2, slope

    # It stops where the gradient is below 1e-8: over the least curvature an error below 1e-6.
    assert_allclose(minimize(value, np.zeros(40), 500), wanted, atol=1e-6)


def test_it_never_rises_and_keeps_the_kind_of_number(rng):
    """Kinks, as in |x|, must not throw it: each further step is at least as good."""

    def value(x):
        return float(np.abs(x).sum() + (x**2).sum()), np.sign(x) + 2 * x

    start = rng.normal(size=20).astype(np.float32)
    values = [value(minimize(value, start, steps))[0] for steps in range(8)]
    assert all(after <= before for before, after in zip(values, values[1:]))
    assert values[-1] < 0.5 * values[0]
    assert minimize(value, start, 5).dtype == np.float32


def test_nothing_to_do():
    """At a minimum the start comes back, as does an argument without elements."""
    assert_allclose(minimize(rosenbrock, np.ones(2), 10), 1)
    assert minimize(lambda x: (0.0, x), np.zeros(0), 10).shape == (0,)
