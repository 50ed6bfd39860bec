"""The rendered generator's parts, against what must be so."""

import numpy as np

from bakery.generators.eyes import EyeMaps, directions_of_map, look_up, to_map
from bakery.generators.shade import lip_occlusion, relative_irradiance
from bakery.generators.wrinkles import wrinkle_map, wrinkle_shading
from bakery.geometry import rotation
from bakery.heads.base import PARTS, weights


def test_map_directions_round_trip():
    directions = directions_of_map(64)
    row, column = np.mgrid[:64, :64] + 0.5
    inside = np.hypot(row - 32, column - 32) < 31
    pixels = to_map(directions, 64)
    np.testing.assert_allclose(pixels[inside], np.stack([column, row], -1)[inside], atol=1e-6)


def test_the_iris_turns_and_the_highlight_stays():
    directions = directions_of_map(128)
    iris = np.where(directions[..., 2:] > np.cos(np.radians(25)), 0.1, 0.8)
    ball = np.repeat(iris, 3, 2).astype(np.float32)
    glint = np.zeros_like(ball)
    glint[60:68, 60:68] = 0.5
    eyes = EyeMaps(
        np.stack([ball] * 2), np.stack([glint] * 2), np.array([25.0, 25.0]), np.ones((2, 3))
    )
    aside = rotation.yaw_pitch(30, 10) @ [0, 0, 1.0]
    ahead = np.array([0, 0, 1.0])
    colour, light = look_up(eyes, 0, np.stack([aside, ahead]), (30, 10))
    np.testing.assert_allclose(colour[0], 0.1, atol=1e-3)  # the iris went where the eye looks
    np.testing.assert_allclose(colour[1], 0.8, atol=1e-3)
    np.testing.assert_allclose(light[1], 0.5, atol=1e-3)  # the highlight did not
    np.testing.assert_allclose(light[0], 0, atol=1e-3)


def test_folds_come_with_compression_only(head):
    neutral = head.neutral(np.zeros(1))
    folds = wrinkle_map(head, neutral, head.landmarks(neutral)[:468])
    np.testing.assert_array_equal(wrinkle_shading(folds, neutral), 0)
    raised = head.vertices(neutral, weights({"browInnerUp": 1}), (0, 0))
    shading = wrinkle_shading(folds, raised)
    assert shading.min() < -0.02, "a raised brow folds the forehead"
    chin = [152, 175, 199, 200]
    np.testing.assert_allclose(shading[chin], 0, atol=0.02)


def test_depth_and_lips_darken_the_mouth():
    part = np.full((60, 60), PARTS.index("skin"), np.uint8)
    part[20:40, 10:50] = PARTS.index("teeth_upper")
    depth = np.full((60, 60), 500.0, np.float32)
    depth[20:40, 30:50] = 530.0
    light = lip_occlusion(part, depth, 1000.0, 500.0)  # 2 pixels per mm
    assert (light[part == PARTS.index("skin")] == 1).all()
    assert light[30, 20] > light[20, 20], "nearer to the lip is darker"
    assert light[30, 40] < 0.5 * light[30, 20], "3 cm deep is dark"


def test_light_is_relative_to_the_front():
    light = np.zeros((9, 3))
    light[0], light[1] = 2.0, 0.5  # ambient, and more from above
    normals = np.array([[0, 0, 1.0], [0, 1, 0], [0, -1, 0]])
    front, up, down = relative_irradiance(normals, light)
    assert front == 1 and up > 1 > down
