"""Openness of skin: known answers on a ball, in a bowl, and on the ears of the built-in head."""

import numpy as np
import trimesh

from bakery.heads.file import load_head
from bakery.heads.scalp import ear_box, ear_depth, unrolled
from bakery.stages.texture.occlusion import openness, shade_of


class _Skin:
    """What `openness` reads of a head."""

    def __init__(self, faces):
        self.faces = np.asarray(faces, np.int32)

    def part_vertices(self, part):
        return np.unique(self.faces)

    def part_faces(self, part):
        return np.arange(len(self.faces))


def test_a_ball_is_open_all_over():
    ball = trimesh.creation.icosphere(subdivisions=4, radius=80.0)
    assert openness(_Skin(ball.faces), np.asarray(ball.vertices)).min() > 0.98


def test_the_bottom_of_a_bowl_sees_half_of_the_light():
    """From there the rim of half a sphere stands at 45 degrees: sin(45)^2 of the cosine-weighted sky."""
    ball = trimesh.creation.icosphere(subdivisions=5, radius=80.0)
    vertices = np.asarray(ball.vertices)
    low = (vertices[ball.faces, 1] < 1e-6).all(1)
    faces = np.concatenate([ball.faces[low], ball.faces[low][:, ::-1] + len(vertices)])
    # Two shells of 4 mm thickness: the inner one is seen from within.
    both = np.concatenate([vertices, vertices * 0.95])
    bottom = len(vertices) + vertices[:, 1].argmin()
    found = openness(_Skin(faces), both)[bottom]
    np.testing.assert_allclose(found, 0.5, atol=0.06)  # 64 directions: each is worth 0.03


def test_ears_have_folds_and_the_nose_has_none():
    head = load_head("makehuman")
    found = openness(head, head.mean)
    skin = head.part_vertices("skin")
    ear = ear_depth(unrolled(head)(head.mean), ear_box(head)) < 1
    ear[np.setdiff1d(np.arange(len(ear)), skin)] = False
    assert np.quantile(found[ear], 0.1) < 0.5
    tip = skin[head.mean[skin, 2].argmax()]  # of the nose
    assert found[tip] > 0.9
    assert (found >= 0).all() and (found <= 1).all()
    np.testing.assert_allclose(found, openness(head, head.mean))  # no chance in it


def test_folds_are_redder_than_open_skin():
    red, green, blue = shade_of(np.float32(0.3))
    assert blue < green < red < 1
    np.testing.assert_allclose(shade_of(np.ones(2, np.float32)), 1)
    assert (shade_of(np.zeros(1, np.float32)) > 0).all()
