"""The conventions of bakery.geometry, each with a known answer."""

import numpy as np
import pytest

from bakery.geometry import camera as cameras
from bakery.geometry import harmonics, rotation
from bakery.geometry.color import to_encoded, to_linear
from bakery.geometry.mesh import (
    boundary_loops,
    edges,
    face_normals,
    scatter_add,
    vertex_normals,
)
from bakery.types import Camera

FRONT = Camera(1000.0, np.array([100.0, 80.0]), np.zeros(3), np.array([0.0, 0.0, -500.0]), 200, 160)


def test_subjects_left_and_up_in_the_picture():
    """+x (the subject's left) is to the right of a frontal picture, +y is up: 10 mm are 20 pixels."""
    pixels = cameras.project(np.array([[0.0, 0, 0], [10, 0, 0], [0, 10, 0]]), FRONT)
    np.testing.assert_allclose(pixels, [[100, 80], [120, 80], [100, 60]])


def test_nearer_points_have_positive_z():
    assert cameras.to_camera(np.array([0.0, 0, 10]), FRONT)[2] == -490


def test_yaw_turns_the_face_to_the_subjects_left():
    np.testing.assert_allclose(rotation.yaw_pitch(90, 0) @ [0, 0, 1], [1, 0, 0], atol=1e-12)
    np.testing.assert_allclose(rotation.yaw_pitch(0, 90) @ [0, 0, 1], [0, 1, 0], atol=1e-12)


def test_rotation_vector_round_trip():
    vector = np.array([0.3, -0.2, 0.7])
    np.testing.assert_allclose(rotation.vector(rotation.matrix(vector)), vector, atol=1e-12)


def test_view_keeps_its_pivot_in_place():
    pivot = np.array([3.0, -20.0, 40.0])
    turned = cameras.view(FRONT, 40, 10, pivot)
    np.testing.assert_allclose(
        cameras.project(pivot, turned), cameras.project(pivot, FRONT), atol=1e-9
    )


def test_crop_moves_and_scales_pixels():
    point = np.array([5.0, 7.0, 11.0])
    cut = cameras.crop(FRONT, 30, 20, 50, 40, 2.0)
    want = (cameras.project(point, FRONT) - [30, 20]) * 2
    np.testing.assert_allclose(cameras.project(point, cut), want)


def test_projection_jacobian_against_differences():
    points = np.array([[10.0, -5.0, -400.0], [-30.0, 22.0, -610.0]])
    exact = cameras.projection_jacobian(points, FRONT)
    for axis in range(3):
        step = np.zeros(3)
        step[axis] = 1e-4
        up = cameras.project_camera(points + step, FRONT)
        down = cameras.project_camera(points - step, FRONT)
        # Central differences of a smooth function: the error is of the order of step squared.
        np.testing.assert_allclose(exact[..., axis], (up - down) / 2e-4, atol=1e-6)


def test_harmonics_are_orthonormal():
    """The nine functions integrate to the identity over the sphere."""
    rng = np.random.default_rng(0)
    normals = rng.normal(size=(400_000, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    values = harmonics.basis(normals)
    # Monte Carlo: 4 pi / sqrt(400,000) is 0.02, three times that covers all 81 entries.
    np.testing.assert_allclose(4 * np.pi * values.T @ values / len(values), np.eye(9), atol=0.06)


def test_harmonics_jacobian_against_differences():
    normal = np.array([0.3, -0.5, 0.81])
    exact = harmonics.basis_jacobian(normal)
    for axis in range(3):
        step = np.zeros(3)
        step[axis] = 1e-5
        slope = (harmonics.basis(normal + step) - harmonics.basis(normal - step)) / 2e-5
        np.testing.assert_allclose(exact[:, axis], slope, atol=1e-8)


def test_srgb_known_values_and_round_trip():
    # 0.5 encoded is 0.214041 linear (IEC 61966-2-1).
    assert to_linear(0.5) == pytest.approx(0.2140411, abs=1e-6)
    values = np.linspace(0, 1, 1001, dtype=np.float32)
    np.testing.assert_allclose(to_encoded(to_linear(values)), values, atol=2e-6)


def test_mesh_of_a_square():
    """Two triangles: normals point at the viewer, five edges, one border of four."""
    vertices = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    np.testing.assert_allclose(vertex_normals(vertices, faces), [[0, 0, 1]] * 4)
    assert len(edges(faces)) == 5
    assert [len(loop) for loop in boundary_loops(faces)] == [4]


@pytest.mark.parametrize("kind", [np.float32, np.float64])
def test_normals_are_summed_as_in_plain_numpy(kind):
    """To the bit; the last vertex has no face."""
    rng = np.random.default_rng(0)
    vertices, faces = rng.normal(size=(201, 3)).astype(kind), rng.integers(0, 200, (900, 3))
    normals = face_normals(vertices, faces)
    total = sum(scatter_add(normals, faces[:, corner], 201) for corner in range(3))
    wanted = total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-20)
    np.testing.assert_array_equal(vertex_normals(vertices, faces)[:-1], wanted[:-1])
    np.testing.assert_array_equal(vertex_normals(vertices, faces)[-1], [0, 0, 1])
