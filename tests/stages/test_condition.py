"""What a generator is shown of a target: each eye's iris lies where that eye looks."""

from types import SimpleNamespace

import numpy as np
import pytest

from bakery.geometry import camera as cameras
from bakery.geometry import rotation
from bakery.geometry.mesh import vertex_normals
from bakery.geometry.sample import interpolate_reference
from bakery.heads.base import PARTS
from bakery.stages.condition import condition, face_camera
from bakery.types import EXPRESSION_INDEX, Camera

RADIUS = 12.0  # mm, of an eyeball, nearly


@pytest.fixture(scope="module")
def open_eyes(head):
    """Weights that open both eyes wide, and the camera of a close look at them."""
    weights = np.zeros(len(EXPRESSION_INDEX), np.float32)
    weights[[EXPRESSION_INDEX[f"eyeWide{side}"] for side in ("Left", "Right")]] = 1
    middle = head.eye_centers(head.mean).mean(0)
    far = np.array([0, 0, -600.0])
    camera = Camera(2400.0, np.array([200.0, 100]), np.zeros(3), far - middle, 400, 200)
    return weights, camera


@pytest.mark.parametrize("gaze", [(0.0, 0.0), (20.0, 0.0), (-15.0, 10.0), (8.0, -12.0)])
def test_each_iris_is_where_its_own_eye_looks(head, open_eyes, gaze):
    """The middle of each iris mask against the point where the line of sight leaves that eyeball."""
    weights, camera = open_eyes
    texture = np.full((8, 8, 3), 0.5, np.float32)
    seen = condition(head, head.mean, texture, weights, gaze, camera)
    sight = rotation.yaw_pitch(*gaze) @ [0.0, 0.0, 1.0]
    for eye, center in zip(("left", "right"), head.eye_centers(head.mean)):
        mine = seen.part == PARTS.index(f"eye_{eye}")
        iris = np.where(mine, seen.gaze_mask[..., 0], 0)
        assert mine.sum() > 300 and iris.max() > 0.99
        y, x = np.indices(iris.shape) + 0.5
        found = np.array([(iris * x).sum(), (iris * y).sum()]) / iris.sum()
        wanted = cameras.project(center + RADIUS * sight, camera)
        # Lids cut the iris above and below; 4 pixels are a millimetre, the eyes lie 250 apart.
        np.testing.assert_allclose(found[0], wanted[0], atol=4)
        np.testing.assert_allclose(found[1], wanted[1], atol=12)
        share = seen.gaze_mask[mine].sum(1)
        np.testing.assert_allclose(share, 1, atol=1e-6)  # what is no iris is white


def test_the_head_turns_to_its_left_and_up(head):
    """Its left is the picture's right, and rows count downwards."""
    camera = Camera(1200.0, np.array([256.0, 256]), np.zeros(3), np.array([0, 0, -900.0]), 512, 512)
    fit = SimpleNamespace(camera=camera)
    nose = head.landmarks(head.mean)[1:2]
    rest, left, up = (
        cameras.project(nose, face_camera(fit, head, head.mean, *turn))[0]
        for turn in ((0, 0), (20, 0), (0, 20))
    )
    assert left[0] > rest[0] + 5
    assert up[1] < rest[1] - 5


def test_faces_parts_and_normals_go_together(head, open_eyes):
    weights, _ = open_eyes
    camera = Camera(600.0, np.full(2, 128.0), np.zeros(3), np.array([0, 0, -700.0]), 256, 256)
    texture = np.full((8, 8, 3), 0.5, np.float32)
    seen = condition(head, head.mean, texture, weights, (0.0, 0.0), camera)
    drawn = seen.fragments.face >= 0
    assert 0 < drawn.mean() < 1
    np.testing.assert_array_equal(
        seen.part, np.where(drawn, head.face_part[seen.fragments.face], 255)
    )
    points = cameras.to_camera(seen.vertices, camera)
    normals = interpolate_reference(
        seen.fragments, vertex_normals(points, head.faces)[head.faces].astype(np.float32)
    )
    length = np.linalg.norm(normals, axis=-1, keepdims=True)
    # The reference adds in another order.
    np.testing.assert_allclose(seen.normals, normals / np.maximum(length, 1e-6), atol=1e-6)
    assert not seen.normals[~drawn].any() and not seen.deformed_neutral[~drawn].any()
