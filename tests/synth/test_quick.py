"""The quick painter's parts against plain numpy and known answers."""

import numpy as np
import pytest

from bakery.geometry import harmonics, rotation
from bakery.geometry.mesh import face_normals
from bakery.synth import quick
from bakery.synth import quick_kernels as kernels
from bakery.synth.scene import studio_light


def test_gather_blends_as_numpy_does():
    rng = np.random.default_rng(0)
    faces = rng.integers(0, 20, (9, 3)).astype(np.int32)
    face = rng.integers(0, 9, 50).astype(np.int32)
    weight = rng.random((50, 3)).astype(np.float32)
    values = rng.random((20, 5)).astype(np.float32)
    wanted = np.einsum("nk,nkc->nc", weight, values[faces[face]])
    np.testing.assert_allclose(kernels.gather(face, weight, faces, values), wanted, rtol=1e-5)


def test_swell_is_the_share_of_area_lost():
    points = np.array([[0, 0, 0], [4, 0, 0], [0, 4, 0], [4, 4, 0]], np.float32)
    faces = np.array([[0, 1, 2], [1, 3, 2]], np.int32)
    np.testing.assert_allclose(kernels.swell(faces, points, points), 0, atol=1e-6)
    pressed = points * np.float32([0.8, 1, 1])
    np.testing.assert_allclose(kernels.swell(faces, pressed, points), 0.2, rtol=1e-4)
    stretched = points * np.float32([1.25, 1, 1])
    np.testing.assert_allclose(kernels.swell(faces, stretched, points), -0.25, rtol=1e-4)


def test_tilt_of_a_ramp_has_the_ramps_slope():
    """A plane whose height grows by 0.3 mm a mm along x leans back by atan 0.3, on any face."""
    points = np.array([[0, 0, 0], [2, 0, 0], [0, 3, 0], [2, 3, 0]], np.float32)
    faces = np.array([[0, 1, 2], [1, 3, 2]], np.int32)
    uv = points[:, :2] * np.float32([5, -5])  # texels: 5 a mm, v runs down
    corner = uv[faces]
    steps = np.stack([corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]], 1)
    slope = np.tile(np.float32([0.3 / 5, 0]), (2, 1))  # mm a texel
    smooth = np.tile(np.float32([0, 0, 1]), (2, 1))
    out = kernels.tilt(np.array([0, 1], np.int32), faces, points, steps, slope, smooth, 5.0)
    wanted = np.array([-0.3, 0, 1]) / np.hypot(0.3, 1)
    np.testing.assert_allclose(out, [wanted, wanted], atol=1e-5)
    held = kernels.tilt(
        np.array([0], np.int32), faces, points, steps[:1], slope[:1] * 100, smooth[:1], 1.0
    )
    np.testing.assert_allclose(-held[0, 0] / held[0, 2], 1.0, atol=1e-5)  # never steeper than asked


def test_turned_light_shines_alike_on_turned_normals():
    light = studio_light(azimuth=40, rim=0.5, seed=3)
    turn = rotation.yaw_pitch(35.0, -10.0)
    other = quick.turned(light, turn)
    normals = face_normals(
        np.random.default_rng(1).normal(size=(30, 3)), np.arange(30).reshape(-1, 3)
    )
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    before = harmonics.irradiance(normals, light.irradiance())
    after = harmonics.irradiance(normals @ turn.T, other.irradiance())
    np.testing.assert_allclose(after, before, atol=1e-6)


def test_light_between_the_lips_falls_with_depth():
    """A slit of teeth in a plane of skin, half of it 20 mm deeper than the other."""
    kind = np.zeros((60, 60), np.int16)
    kind[20:40, 10:50] = 5
    depth = np.full((60, 60), 500.0, np.float32)
    depth[20:40, 10:30] += 5
    depth[20:40, 30:50] += 25
    reach = quick._reach(kind, depth, [5], 0.5)
    assert 0.7 < reach[30, 20] <= 1
    assert reach[30, 40] < 0.5 * reach[30, 20]
    assert reach[20, 20] < reach[30, 20]  # under the lip's edge


def test_a_gaping_mouth_is_not_black_in_its_middle():
    """No lip is within reach of the blur there; the light falls as it does a little further out."""
    kind = np.zeros((200, 200), np.int16)
    kind[20:180, 20:180] = 5
    depth = np.full((200, 200), 500.0, np.float32)
    depth[kind == 5] += 10
    reach = quick._reach(kind, depth, [5], 0.5)
    assert reach[100, 100] == pytest.approx(reach[60, 100], rel=0.05) and reach[100, 100] > 0.5
