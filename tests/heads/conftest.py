"""A head of two triangles and two eyeballs, enough for the file format."""

import numpy as np
import pytest

from bakery.heads.base import FOLLOW, PARTS, HeadModel
from bakery.types import EXPRESSION_INDEX, EXPRESSIONS, LANDMARKS


@pytest.fixture
def tiny():
    mean = np.array(
        [[-10, 0, 0], [10, 0, 0], [0, 12, 0], [0, -12, 0], [5, 0, -9], [6, 0, -9], [5, 1, -9]]
        + [[-5, 0, -9], [-6, 0, -9], [-5, 1, -9]],
        np.float32,
    )
    faces = np.array([[0, 1, 2], [0, 3, 1], [4, 5, 6], [7, 9, 8]], np.int32)
    expression = np.zeros((len(EXPRESSIONS), len(mean), 3), np.float32)
    expression[EXPRESSION_INDEX["jawOpen"], 3] = [0, -2, 0]
    parts = [PARTS.index(name) for name in ("skin", "skin", "eye_left", "eye_right")]
    follow = [FOLLOW.index("skin")] * 4 + [FOLLOW.index("eye_left")] * 3
    follow += [FOLLOW.index("eye_right")] * 3
    identity = np.zeros((2, len(mean), 3), np.float32)
    identity[0, :, 1] = 0.5
    identity[1, 2, 2] = 1.5
    return HeadModel(
        name="tiny",
        licence="CC0-1.0",
        source="made for a test",
        mean=mean,
        faces=faces,
        uv=((mean[:, :2] + 12) / 24).astype(np.float32),
        uv_faces=faces,
        face_part=np.array(parts, np.uint8),
        follow=np.array(follow, np.uint8),
        identity_basis=identity,
        expression_basis=expression,
        landmark_faces=np.zeros(LANDMARKS, np.int32),
        landmark_barycentric=np.full((LANDMARKS, 3), 1 / 3, np.float32),
        uv_rectangles={"mouth_sheet": [0.1, 0.2, 0.3, 0.4]},
    )
