"""A photo cut to the face, as the generator looks at it."""

from dataclasses import replace

import numpy as np
import pytest

from bakery.geometry import camera as cameras
from bakery.geometry.color import to_encoded
from bakery.landmarks import LIPS_INNER
from bakery.stages import face_frame
from bakery.types import EXPRESSION_INDEX, Camera, Fit


def test_a_blot_lies_between_the_lips():
    points = np.zeros((478, 2))
    angle = np.linspace(0, 2 * np.pi, len(LIPS_INNER), endpoint=False)
    points[LIPS_INNER] = 32 + 12 * np.stack([np.cos(angle), np.sin(angle)], 1)
    for photo in (np.full((64, 64, 3), 200, np.uint8), np.full((64, 64, 3), 0.8, np.float32)):
        made = face_frame.blotted(photo, points)
        changed = (made != photo).any(-1)
        assert made.dtype == photo.dtype and changed[32, 32] and not changed[:18].any()
        assert changed.sum() == pytest.approx(np.pi * 12**2, rel=0.1)
        red = made[32, 32] / photo.max()
        assert red[0] > red[1] and red[0] < 0.5
        assert made[32, 32].max() < 0.4 * (255 if made.dtype == np.uint8 else 1)


@pytest.mark.parametrize("opened", [0.0, 0.7])
def test_the_neutral_face_of_a_photo(head, opened):
    """Closed lips: the photo, cut to the head. An open mouth: the texture, drawn at rest in its place."""
    camera = Camera(
        3100.0, np.array([611.0, 583.0]), np.array([0.0, 0.3, 0.0]), np.array([0, 0, -700.0]), 1200, 1200
    )  # fmt: skip
    expression = np.zeros(52, np.float32)
    expression[EXPRESSION_INDEX["jawOpen"]] = opened
    marks = cameras.project(head.landmarks(head.vertices(head.mean, expression, (0, 0))), camera)
    fit = Fit(
        head.name, camera, np.zeros(1), expression, np.zeros(2), np.zeros((9, 3)), np.zeros(0),
        np.zeros((468, 3)), marks,
    )  # fmt: skip
    photo, texture = (
        np.full((n, n, 3), c, np.float32) for n, c in ((1200, 0.25), (64, [0.5, 0.3, 0.2]))
    )
    made = face_frame.neutral_picture(photo, marks, fit, head, head.mean, texture, 128)
    rest = cameras.project(head.landmarks(head.mean), camera)
    affine = face_frame.face_frame(fit, marks, 128)[1]
    nose, lip = (rest[[4, 0]] @ affine[:, :2].T + affine[:, 2]).astype(int)
    wanted = to_encoded(texture[0, 0]) if opened else photo[0, 0]
    assert made.shape == (128, 128, 3) and not made[0, 0].any()
    for x, y in (nose, lip - [0, 2]):
        np.testing.assert_allclose(made[y, x], wanted * 255, atol=1)
    if opened:  # whatever the expression is
        other = replace(fit, expression=0.5 * expression)
        again = face_frame.neutral_picture(photo, marks, other, head, head.mean, texture, 128)
        np.testing.assert_array_equal(again, made)
