"""The pieces a head is built of: subdivision, charts, eyeballs, proxies, teeth."""

import numpy as np
import pytest

from bakery.geometry.mesh import boundary_loops, face_normals
from bakery.heads import embed, eyes, proxies
from bakery.heads.build import flatten, teeth

CUBE = np.array(
    [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]]
)
CORNERS = np.array(
    [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]], float
)


def volume(points, faces):
    a, b, c = (points[faces[:, k]] for k in range(3))
    return np.einsum("nc,nc->n", a, np.cross(b, c)).sum() / 6


def area_in_chart(uv, faces):
    a, b, c = (uv[faces[:, k]] for k in range(3))
    return ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]) / 2


def test_catmull_clark_of_a_cube():
    subdivide = pytest.importorskip("bakery.heads.build.subdivide")
    level = subdivide.catmull_clark(CUBE, 8)
    out = level.matrix @ CORNERS
    np.testing.assert_allclose(out[0], 2 / 9)  # the published rule: 5/9 of the half edge
    np.testing.assert_allclose(out[8], [0.5, 0.5, 0])  # a face point
    np.testing.assert_allclose(np.asarray(level.matrix.sum(1)).ravel(), 1)


def test_levels_meet_without_cracks():
    subdivide = pytest.importorskip("bakery.heads.build.subdivide")
    matrix, faces, owner = subdivide.refine(CUBE, 8, [2, 1, 0, 1, 0, 2])
    assert boundary_loops(faces) == []
    assert set(owner) == set(range(6))
    even = subdivide.refine(CUBE, 8, [2] * 6)
    assert len(even[1]) == 6 * 32
    assert volume(matrix @ CORNERS, faces) == pytest.approx(volume(even[0] @ CORNERS, even[1]), 0.1)


def sheet(rows=7, columns=9):
    x, y = np.meshgrid(np.linspace(-1, 1, columns), np.linspace(-1, 1, rows))
    points = np.stack([x.ravel() * 40, y.ravel() * 30, 12 * np.exp(-2 * (x**2 + y**2)).ravel()], -1)
    return points, teeth.grid_faces(np.arange(rows * columns).reshape(rows, columns))


def test_a_flat_sheet_is_relaxed_to_itself():
    pytest.importorskip("scipy")
    points, faces = sheet()
    points[:, 2] = 0
    held = np.zeros((len(points), 2), bool)
    held[0] = held[8, 1] = True
    bent = points[:, :2] + 3 * np.sin(points[:, ::-1][:, :2] / 20)[:, ::-1]
    out = flatten.relax(points, faces, bent, held, np.ones(len(points)), rounds=60)
    lengths = np.linalg.norm(out[faces[:, 0]] - out[faces[:, 1]], axis=1)
    expected = np.linalg.norm(points[faces[:, 0]] - points[faces[:, 1]], axis=1)
    ratio = lengths / expected
    np.testing.assert_allclose(ratio / ratio.mean(), 1, atol=0.02)


def test_flattening_turns_nothing_over():
    pytest.importorskip("scipy")
    points, faces = sheet()
    hole = (np.abs(points[faces].mean(1)[:, :2]) < [12, 8]).all(1)
    used, open_faces = np.unique(faces[~hole], return_inverse=True)
    points, open_faces = points[used], open_faces.reshape(-1, 3)
    rim = np.array(boundary_loops(open_faces)[0])
    turn = np.linspace(0, 2 * np.pi, len(rim), endpoint=False)
    circle = np.stack([np.cos(turn), np.sin(turn)], -1) * 100
    body, mesh = flatten.fill_holes(points, open_faces, rim)
    assert len(boundary_loops(mesh)) == 1
    uv = flatten.flatten(body, mesh, rim, circle)
    signs = np.sign(area_in_chart(uv, mesh))
    assert (signs == signs[0]).all()


def test_eyeball_is_round_closed_and_centred():
    ball = eyes.Ball(np.array([30.0, 1, -2]), 12.0, 27.0, np.zeros((1, 3)), np.array([0.1]))
    patch = eyes.eyeball("left", ball)
    np.testing.assert_allclose(patch.mean.mean(0), ball.center, atol=1e-6)
    assert boundary_loops(patch.faces) == []
    assert volume(patch.mean - ball.center, patch.faces) > 0.97 * 4 / 3 * np.pi * 12**3 * 0.95
    reach = np.linalg.norm(patch.mean - ball.center, axis=1)
    assert reach.min() == pytest.approx(12) and reach.max() == pytest.approx(12 * 1.055)
    assert (np.sign(area_in_chart(patch.uv, patch.uv_faces)) == -1).all()
    grown = np.linalg.norm(patch.mean + patch.identity[0] - ball.center, axis=1)
    np.testing.assert_allclose(grown, 1.1 * reach)


def test_ball_modes_are_found():
    rng = np.random.default_rng(0)
    points = rng.normal(size=(50, 3))
    moves = np.stack([points * 0.2 + [1, 2, 3], points * 0 + [0, 0, 1]])
    centers, scales = eyes.fit_ball(points, np.zeros(3), moves)
    np.testing.assert_allclose(centers, [[1, 2, 3], [0, 0, 1]], atol=1e-9)
    np.testing.assert_allclose(scales, [0.2, 0], atol=1e-9)


def test_cap_is_part_of_a_sphere_about_the_eye():
    ball = eyes.Ball(np.zeros(3), 12.0, 27.0, np.zeros((0, 3)), np.zeros(0))
    cap = eyes.eye_proxy("right", ball, 0.3)
    np.testing.assert_allclose(np.linalg.norm(cap.mean, axis=1), 12.3)
    assert (face_normals(cap.mean, cap.faces)[:, 2] > 0).all()


def mouth():
    turn = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    ring = np.stack([20 * np.cos(turn), 3 * np.sin(turn), 5 * np.cos(turn) ** 2], -1)
    opening = np.zeros_like(ring)
    opening[ring[:, 1] < -0.1, 1] = -8
    return ring, opening


def test_mouth_proxy_follows_the_lips():
    ring, opening = mouth()
    shapes = np.zeros((52, len(ring), 3))
    shapes[7] = opening
    patch = proxies.mouth_proxy(np.arange(24), ring, np.zeros((1, 24, 3)), shapes, opening)
    columns, rows = proxies.SHEET_COLUMNS + 1, proxies.SHEET_ROWS + 1
    grid = patch.mean.reshape(rows, columns, 3)
    assert grid[0, :, 1].min() > -1e-6 and grid[-1, :, 1].max() < 1e-6, "upper lip first"
    assert (np.diff(grid[0, :, 0]) > 0).all(), "from the subject's right to the left"
    move = patch.expression[7].reshape(rows, columns, 3)
    np.testing.assert_allclose(move[0], 0, atol=1e-6)
    np.testing.assert_allclose(move[-1, columns // 2], [0, -8, 0], atol=1e-6)
    np.testing.assert_allclose(move[5, columns // 2], [0, -4, 0], atol=1e-6)
    assert patch.uv.min() == 0 and patch.uv.max() == 1
    normals = face_normals(patch.mean + 0 * patch.mean, patch.faces)
    assert np.median(normals[:, 2]) > 0


def test_twenty_eight_teeth():
    arch = teeth.Arch(17.0, 0.005, 3.2e-5, -67.0, -0.12, -1, 1.0)
    points, faces, uv = teeth.row_of_teeth(arch, teeth.UPPER)
    per_tooth = len(points) // 14
    centers = points.reshape(14, per_tooth, 3).mean(1)
    assert (np.sort(centers[0::2, 0]) == centers[0::2, 0]).all(), "one behind the other"
    np.testing.assert_allclose(centers[0::2] * [-1, 1, 1], centers[1::2])
    widths = np.ptp(points.reshape(14, per_tooth, 3)[0], axis=0)
    assert widths[0] == pytest.approx(8.5, abs=0.4), "a central incisor is 8.5 mm wide"
    assert 0 <= uv.min() and uv.max() <= 1
    signs = np.sign(area_in_chart(uv, faces))
    assert (signs == signs[0]).all()


def test_a_throat_lies_beneath_a_jaw_and_a_cheek_beneath_nothing():
    """Two millimetres a pixel: a wall, 40 mm behind below row 20, and a slope to the right of it."""
    depth = np.full((40, 60), 500.0, np.float32)
    depth[20:, :30] = 540
    depth[:, 40:] += 4 * np.arange(20)
    depth[:, 58:] = np.inf
    hidden = embed.beneath(depth, 0.5)
    expected = np.zeros((40, 60), bool)
    expected[20:27, :30] = True  # 15 mm are 7 pixels; further down nothing is near
    np.testing.assert_array_equal(hidden[:, :58], expected[:, :58])


def test_affine_carry_is_exact_for_affine_moves():
    rng = np.random.default_rng(1)
    points, targets = rng.normal(size=(30, 3)), rng.normal(size=(9, 3))
    A, b = rng.normal(size=(3, 3)), rng.normal(size=3)
    out = teeth.affine_carry(points, (points @ A + b)[None], targets)
    np.testing.assert_allclose(out[0], targets @ A + b, atol=1e-9)


def test_closest_point_on_triangles():
    triangle = np.array([[[0, 0, 0], [4, 0, 0], [0, 4, 0]]], float)
    points = np.array([[1, 1, 3], [-1, -1, 0], [2, -5, 0], [9, 9, 1]], float)
    which, weights = embed.closest(points, np.repeat(triangle[None], 4, 0))
    np.testing.assert_allclose(
        weights @ triangle[0], [[1, 1, 0], [0, 0, 0], [2, 0, 0], [2, 2, 0]], atol=1e-9
    )
    assert (which == 0).all()


def test_a_piece_moves_as_the_whole_head(head):
    kept = np.flatnonzero(head.face_part == head.face_part[0])[::7]
    piece = head.cut(kept)
    whole, used = piece.whole, piece.whole_vertices
    assert whole is head and len(piece.faces) <= len(kept) + len(head.landmark_faces)
    expression = np.random.default_rng(0).random(len(head.expression_basis)).astype(np.float32)
    moved = head.mean + np.tensordot(expression, head.expression_basis, 1)
    own = piece.mean + np.tensordot(expression, piece.expression_basis, 1)
    np.testing.assert_allclose(own, moved[used], atol=1e-4)
    np.testing.assert_allclose(piece.landmarks(own), head.landmarks(moved), atol=1e-4)
    np.testing.assert_allclose(piece.landmark_uv(), head.landmark_uv())
