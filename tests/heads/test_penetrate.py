"""What reaches into what: known answers, and the built-in head in every shape and in speech."""

import numpy as np
import pytest

from bakery.heads.base import weights
from bakery.heads.report import penetrate
from bakery.types import EXPRESSION_INDEX


@pytest.fixture(scope="module")
def contacts(head):
    return penetrate.Contacts(head)


def test_depth_under_a_plane():
    x, y = np.meshgrid(np.arange(6.0), np.arange(6.0))
    plane = np.stack([x, y, 0 * x], -1).reshape(-1, 3)
    corner = np.arange(5)[:, None] * 6 + np.arange(5)
    faces = np.concatenate(
        [
            np.stack([corner, corner + 1, corner + 7], -1).reshape(-1, 3),
            np.stack([corner, corner + 7, corner + 6], -1).reshape(-1, 3),
        ]
    )
    vertices = np.concatenate([plane, [[2.0, 3.0, -0.7], [2.0, 3.0, 0.4], [2, 2, -50]]])
    surface = np.arange(36)
    depth = penetrate._inside(vertices, np.array([36, 37, 38]), faces, surface)
    np.testing.assert_allclose(depth, [0.7])  # above the plane and far below it do not count
    open_ = penetrate._inside(vertices, np.array([36]), faces, surface, np.zeros(36, bool))
    assert len(open_) == 0


def test_a_pushed_lid_is_found(head, contacts):
    neutral = head.mean.astype(float)
    center = head.eye_centers(neutral)[0]
    lid = head.landmark_vertices[386][0]
    pushed = neutral.copy()
    outward = (neutral[lid] - center) / np.linalg.norm(neutral[lid] - center)
    pushed[lid] = center + 12 * outward  # mm; the ball has 14
    before = contacts.depths(neutral, np.zeros(52))["skin in eye"].max(initial=0)
    after = contacts.depths(pushed, np.zeros(52))["skin in eye"].max(initial=0)
    assert before <= penetrate.DEEP
    assert after > 1.5


@pytest.mark.parametrize("name", penetrate.singles())
def test_no_shape_pushes_parts_into_each_other(head, contacts, name):
    expression = penetrate.singles()[name]
    found = contacts.depths(head.vertices(head.mean, expression), expression)
    assert {pair: depth.max(initial=0) <= penetrate.DEEP for pair, depth in found.items()} == {
        pair: True for pair in penetrate.PAIRS
    }


def test_nor_does_speech(head, contacts):
    for expression in penetrate.mixes(np.random.default_rng(2), 150):
        found = contacts.depths(head.vertices(head.mean, expression), expression)
        for pair, depth in found.items():
            assert depth.max(initial=0) <= penetrate.DEEP, (pair, expression)


def test_mixes_speak_and_feel():
    drawn = penetrate.mixes(np.random.default_rng(0), 20)
    assert ((drawn > 0).sum(1) == 7).all()
    assert drawn[:, EXPRESSION_INDEX["mouthClose"]].max() == 0
    assert penetrate.singles()["mouthClose"][EXPRESSION_INDEX["jawOpen"]] == 1
    np.testing.assert_array_equal(penetrate.singles()["jawOpen"], weights({"jawOpen": 1}))
