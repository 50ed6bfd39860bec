"""The camera of a whole head: nothing of it is outside, from whatever side."""

from dataclasses import replace

import numpy as np
import pytest

from bakery.geometry import camera as cameras
from bakery.heads.base import weights
from bakery.runtime.framing import head_ball, head_camera

SIDE = 200


def head_points(avatar, expression):
    """The skin of the head without its neck, [n, 3] mm."""
    skin = avatar.head.part_vertices("skin")
    chin = avatar.head.landmarks(avatar.neutral)[152, 1]
    above = skin[avatar.neutral[skin, 1] > chin]
    return avatar.head.vertices(avatar.neutral, weights(expression))[above]


@pytest.mark.parametrize("yaw", range(-180, 180, 45))
@pytest.mark.parametrize("pitch", [-90, -40, 0, 40, 90])
def test_the_whole_head_is_in_the_picture(noise_avatar, yaw, pitch):
    camera = head_camera(
        noise_avatar.fit, noise_avatar.head, noise_avatar.neutral, yaw, pitch, SIDE
    )
    assert (camera.width, camera.height) == (SIDE, SIDE)
    for expression in ({}, {"jawOpen": 1.0, "browInnerUp": 1.0}):
        pixels = cameras.project(head_points(noise_avatar, expression), camera)
        low, high = pixels.min(0), pixels.max(0)
        assert low.min() > 0.01 * SIDE and high.max() < 0.99 * SIDE
        # A head is a fifth longer than it is wide: the ball is not much larger than any view of it.
        assert (high - low).max() > 0.6 * SIDE


def test_a_head_at_the_photos_edge_is_held_too(noise_avatar):
    """Wide lenses draw what is far from the middle longer."""
    camera = noise_avatar.fit.camera
    wide = replace(camera, focal=300.0, translation=np.array([260.0, -150.0, -450.0]))
    fit = replace(noise_avatar.fit, camera=wide)
    for yaw in (-90, 0, 90):
        seen = head_camera(fit, noise_avatar.head, noise_avatar.neutral, yaw, 0.0, SIDE)
        pixels = cameras.project(head_points(noise_avatar, {}), seen)
        assert pixels.min() > 0 and pixels.max() < SIDE


def test_all_views_have_one_scale_and_one_middle(noise_avatar):
    center, radius = head_ball(noise_avatar.head, noise_avatar.neutral)
    assert 100 < radius < 150  # mm; a head is 230 long
    views = [
        head_camera(noise_avatar.fit, noise_avatar.head, noise_avatar.neutral, yaw, pitch, SIDE)
        for yaw, pitch in ((0, 0), (77, 0), (180, 0), (0, 60))
    ]
    assert len({float(view.focal) for view in views}) == 1
    middles = np.array([cameras.project(center, view) for view in views])
    np.testing.assert_allclose(middles - middles[0], 0, atol=1e-6)


def test_the_head_turns_to_its_left_and_up(noise_avatar):
    """Its left is the picture's right, and rows count downwards."""
    nose = noise_avatar.head.landmarks(noise_avatar.neutral)[1]
    rest, left, right, up, down = (
        cameras.project(
            nose[None],
            head_camera(noise_avatar.fit, noise_avatar.head, noise_avatar.neutral, *turn, SIDE),
        )[0]
        for turn in ((0, 0), (20, 0), (-20, 0), (0, 20), (0, -20))
    )
    assert left[0] > rest[0] + 5 > rest[0] - 5 > right[0]
    assert up[1] < rest[1] - 5 < rest[1] + 5 < down[1]


@pytest.mark.parametrize("style", ["bob", "crop"])
def test_hair_is_in_the_picture(noise_avatar, hairdo, style):
    """From every side, and the head stays in the middle and about as large as it can be."""
    head, neutral = noise_avatar.head, noise_avatar.neutral
    hair = hairdo(head, neutral, style)
    (center, radius), (_, bare) = head_ball(head, neutral, hair), head_ball(head, neutral)
    apart = np.linalg.norm(hair.vertices - center, axis=1)
    assert center[0] == pytest.approx(head_ball(head, neutral)[0][0]) and bare < radius
    sides = [
        (apart * (np.sign(hair.vertices[:, k] - center[k]) == s)).max()
        for k in (1, 2)
        for s in (-1, 1)
    ]
    assert min(sides) > 0.8 * radius  # a ball that could be moved would be too large
    for yaw in range(-180, 180, 60):
        for pitch in (-60, 0, 60):
            camera = head_camera(noise_avatar.fit, head, neutral, yaw, pitch, SIDE, hair)
            pixels = cameras.project(hair.vertices, camera)
            assert pixels.min() > 0 and pixels.max() < SIDE
            skin = cameras.project(head_points(noise_avatar, {}), camera)
            assert skin.min() > 0 and skin.max() < SIDE
