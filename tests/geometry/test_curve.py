"""Curves: the nearest point of a polyline."""

import numpy as np
from numpy.testing import assert_allclose

from bakery.geometry.curve import nearest_on


def test_the_nearest_point_of_a_polyline():
    corner = np.array([[0.0, 0], [2, 0], [2, 1]])
    found, along = nearest_on(np.array([[1.0, 1], [3, 0.5], [-1, -1], [5, 5], [2, 0]]), corner)
    assert_allclose(found, [[1, 0], [2, 0.5], [0, 0], [2, 1], [2, 0]])
    assert_allclose(along, [1 / 3, 2.5 / 3, 0, 1, 2 / 3])


def test_points_that_coincide_do_no_harm():
    line = np.array([[0.0, 0, 0], [0, 0, 0], [1, 0, 0]])
    found, along = nearest_on(np.array([[0.25, 1, 0]]), line)
    assert_allclose(found, [[0.25, 0, 0]])
    assert_allclose(along, [0.25])
