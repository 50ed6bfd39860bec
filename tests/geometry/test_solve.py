import numpy as np

from bakery.geometry.solve import minimize_box, minimize_partly_bounded


def problem(seed, count):
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(count + 5, count))
    return root.T @ root + 0.1 * np.eye(count), rng.normal(size=count) * 5


def test_bounds_of_a_diagonal_problem_clip():
    x = minimize_box(np.diag([1.0, 2, 4]), np.array([-3.0, -1, 4]), np.zeros(3), np.ones(3))
    np.testing.assert_allclose(x, [1, 0.5, 0])


def test_no_other_point_in_the_box_is_lower():
    for seed in range(20):
        hessian, gradient = problem(seed, 12)
        low, high = -np.ones(12) * 0.1, np.ones(12) * 0.3
        x = minimize_box(hessian, gradient, low, high)
        slope = hessian @ x + gradient
        assert (slope[x > low + 1e-9] <= 1e-6).all()  # only the low bound may push back up
        assert (slope[x < high - 1e-9] >= -1e-6).all()


def test_free_unknowns_reach_their_minimum():
    hessian, gradient = problem(1, 9)
    bounded = np.array([2, 5, 7])
    x = minimize_partly_bounded(hessian, gradient, bounded, np.zeros(3), np.ones(3))
    slope = hessian @ x + gradient
    free = np.setdiff1d(np.arange(9), bounded)
    np.testing.assert_allclose(slope[free], 0, atol=1e-8)
    assert (x[bounded] >= 0).all() and (x[bounded] <= 1).all()


def test_rivals_exclude_each_other():
    hessian = np.eye(4)
    gradient = np.array([-0.5, -0.4, -0.3, 0.2])
    x = minimize_partly_bounded(
        hessian, gradient, np.arange(3), np.zeros(3), np.ones(3), rivals=[(0, 1)]
    )
    np.testing.assert_allclose(x, [0.5, 0, 0.3, -0.2])
