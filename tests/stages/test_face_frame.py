"""A photo cut to the face, as the generator looks at it."""

import numpy as np
import pytest

from bakery.landmarks import LIPS_INNER
from bakery.stages import face_frame


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
