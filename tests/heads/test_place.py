"""Landmark fits give back what the points were made of."""

import numpy as np

from bakery.geometry.camera import project
from bakery.heads.file import load_head
from bakery.heads.place import place_head
from bakery.landmarks import FACE
from bakery.types import EXPRESSION_INDEX, Camera


def test_a_made_up_face_is_found_again():
    head = load_head()
    rng = np.random.default_rng(2)
    identity = np.zeros(len(head.identity_basis))
    identity[:8] = rng.normal(size=8)
    expression = np.zeros(52)
    expression[EXPRESSION_INDEX["jawOpen"]] = 0.4
    camera = Camera(
        2000.0, np.array([500.0, 500]), np.array([0.05, 0.3, 0.02]), np.array([3, 5, -700.0]),
        1000, 1000,
    )  # fmt: skip
    shape = head.vertices(head.neutral(identity), expression)
    points = project(head.landmarks(shape), camera)
    found = place_head(head, points, (1000, 1000))
    assert found.error.mean() < 0.002  # outer-eye-corner distances
    assert abs(found.expression[EXPRESSION_INDEX["jawOpen"]] - 0.4) < 0.12
    np.testing.assert_allclose(found.camera.rotation, camera.rotation, atol=0.04)
    assert len(found.error) == FACE
