"""Reliefs: a photo on a mesh, painted anew."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from bakery.train import relief


def face_points(size=120.0):
    """478 points in depth: a dome with level eye corners, pixels of a picture of `size`."""
    rng = np.random.default_rng(3)
    flat = rng.uniform(-0.9, 0.9, (478, 2))
    flat[33], flat[263] = (-0.5, -0.3), (0.5, -0.3)
    depth = (flat**2).sum(1) * 0.2
    points = np.concatenate([flat, depth[:, None]], 1) * size * 0.22
    return (points + (size / 2, size / 2, 0)).astype(np.float32)


@pytest.fixture(scope="module")
def dome():
    y, x = np.mgrid[:120, :120]
    image = np.stack([x, y, 0 * x], -1).astype(np.uint8) * 2
    return relief.make_relief(image, np.full((120, 120), 255, np.uint8), face_points())


def test_unmoved_relief_is_the_photo(dome):
    image, mask, inside = relief.render(dome, dome.vertices, 120, 120, 1.0)
    assert inside.mean() > 0.99
    assert_allclose(image[5:-5, 5:-5], dome.images[0][5:-5, 5:-5], atol=1)
    assert_allclose(mask[5:-5, 5:-5], 1)


def test_points_carry_their_colour(dome):
    """The picture says its own place, so at a moved point it must say where the point was."""
    vertices = relief.reshape(dome, dome.points + (7, -4, 0))
    image, _, _ = relief.render(dome, vertices, 120, 120, 1.0)
    at = (vertices[:478, :2] - 0.5).round().astype(int)
    told = image[at[:, 1], at[:, 0], :2] / 2 + 0.5
    assert np.abs(told - dome.points[:, :2]).max() < 1.5  # half a pixel each way and rounding


def test_reshape_drags_the_surroundings(dome):
    moved = relief.reshape(dome, dome.points + (7, -4, 2)) - dome.vertices
    assert_allclose(moved, np.broadcast_to((7, -4, 2), moved.shape), atol=1e-3)


def test_pose_without_a_turn_only_scales(dome):
    posed = relief.pose(dome.vertices, dome.center, dome.size, 0, 0, 0)
    assert_allclose(posed[:, :2] * dome.size + dome.center, dome.vertices[:, :2], atol=1e-3)


def test_turned_head_moves_the_near_points_more(dome):
    """Turning about the middle of the head by yaw moves a point by depth * sin(yaw)."""
    posed = relief.pose(dome.vertices, dome.center, dome.size, 0.2, 0, 0)
    flat = relief.pose(dome.vertices, dome.center, dome.size, 0, 0, 0)
    assert_allclose(posed[:, 0], flat[:, 0] * np.cos(0.2) + flat[:, 2] * np.sin(0.2), atol=1e-6)


def test_nearness_enlarges_what_is_near(dome):
    flat = relief.pose(dome.vertices, dome.center, dome.size, 0, 0, 0)
    near = relief.pose(dome.vertices, dome.center, dome.size, 0, 0, 0.5)
    assert_allclose(near[:, :2], flat[:, :2] / (1 + 0.5 * (flat[:, 2:] + 0.3)), rtol=1e-5)


def test_triangles_cover_a_square_once():
    inner = np.random.default_rng(0).uniform(1, 9, (50, 2))
    rim = np.linspace(0, 10, 6)
    sides = [[(t, 0), (10, t), (10 - t, 10), (0, 10 - t)] for t in rim[:-1]]
    points = np.concatenate([inner, np.reshape(sides, (-1, 2))]).astype(np.float32)
    corners = points[relief.triangulate(points)]
    edges = corners[:, 1:] - corners[:, :1]
    areas = np.abs(edges[:, 0, 0] * edges[:, 1, 1] - edges[:, 0, 1] * edges[:, 1, 0]) / 2
    assert_allclose(areas.sum(), 100, rtol=1e-4)
