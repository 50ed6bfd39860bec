"""Delaunay triangles: they cover the hull once and hold no other point in their circles."""

import cv2
import numpy as np
from numpy.testing import assert_allclose

from bakery.geometry.delaunay import delaunay


def test_a_square_with_its_middle():
    points = np.array([[0, 0], [10, 0], [10, 10], [0, 10], [5, 5]], float)
    faces = delaunay(points)
    assert len(faces) == 4 and (faces == 4).any(1).all()


def test_hull_is_covered_once():
    points = np.random.default_rng(0).uniform(0, 100, (60, 2))
    a, b, c = points[delaunay(points)].transpose(1, 0, 2)
    (ux, uy), (vx, vy) = (b - a).T, (c - a).T
    area = np.abs(ux * vy - uy * vx).sum() / 2
    assert_allclose(area, cv2.contourArea(cv2.convexHull(points.astype(np.float32))), rtol=0.02)


def test_points_that_coincide_are_taken_once():
    points = np.array([[0, 0], [10, 0], [0, 10], [0, 0]], float)
    assert sorted(delaunay(points)[0]) == [0, 1, 2]
