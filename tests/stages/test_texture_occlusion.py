"""Openness of skin: known answers on a ball, in a bowl, and on the ears of the built-in head."""

import numpy as np
import trimesh

from bakery.heads.file import load_head
from bakery.heads.scalp import ear_box, ear_depth, unrolled
from bakery.stages.texture.occlusion import AROUND, openness, shade_of


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
    assert openness(_Skin(ball.faces), np.asarray(ball.vertices)).everywhere.min() > 0.98


def test_light_from_above_on_a_ball():
    """A sky as bright as its height, and AROUND: 2/3 pi on the top, 2/3 on an upright wall, 0 from below."""
    ball = trimesh.creation.icosphere(subdivisions=4, radius=80.0)
    vertices = np.asarray(ball.vertices)
    found = openness(_Skin(ball.faces), vertices).above
    around = AROUND * np.pi
    wall = 2 / 3 + around
    height = vertices[:, 1] / 80
    assert abs(np.median(found[np.abs(height) < 0.02]) - 1) < 0.05  # of 64 directions, as below
    np.testing.assert_allclose(found[height.argmax()], (2 / 3 * np.pi + around) / wall, rtol=0.05)
    np.testing.assert_allclose(found[height.argmin()], around / wall, rtol=0.05)


def test_the_bottom_of_a_bowl_sees_half_of_the_light():
    """From there the rim of half a sphere stands at 45 degrees: sin(45)^2 of the cosine-weighted sky."""
    ball = trimesh.creation.icosphere(subdivisions=5, radius=80.0)
    vertices = np.asarray(ball.vertices)
    low = (vertices[ball.faces, 1] < 1e-6).all(1)
    faces = np.concatenate([ball.faces[low], ball.faces[low][:, ::-1] + len(vertices)])
    # Two shells of 4 mm thickness: the inner one is seen from within.
    both = np.concatenate([vertices, vertices * 0.95])
    bottom = len(vertices) + vertices[:, 1].argmin()
    found = openness(_Skin(faces), both).everywhere[bottom]
    np.testing.assert_allclose(found, 0.5, atol=0.06)  # 64 directions: each is worth 0.03


def test_ears_have_folds_and_the_nose_has_none():
    head = load_head("makehuman")
    found, above = openness(head, head.mean)
    skin = head.part_vertices("skin")
    ear = ear_depth(unrolled(head)(head.mean), ear_box(head)) < 1
    ear[np.setdiff1d(np.arange(len(ear)), skin)] = False
    assert np.quantile(found[ear], 0.1) < 0.5
    tip = skin[head.mean[skin, 2].argmax()]  # of the nose
    assert found[tip] > 0.9
    assert (found >= 0).all() and (found <= 1).all()
    np.testing.assert_allclose(found, openness(head, head.mean).everywhere)  # no chance in it
    below, chin = head.landmarks(head.mean)[[152, 199]]  # the jaw's edge, and the chin's front
    cheek, neck = (
        skin[np.linalg.norm(head.mean[skin] - place, axis=1).argmin()]
        for place in (chin, below - [0, 25, 15])
    )
    assert above[neck] < 0.6 * above[cheek]


def test_folds_are_redder_than_open_skin():
    red, green, blue = shade_of(np.float32(0.3))
    assert blue < green < red < 1
    np.testing.assert_allclose(shade_of(np.ones(2, np.float32)), 1)
    assert (shade_of(np.zeros(1, np.float32)) > 0).all()
