"""Eyes: a painted tone over the photographed detail."""

from dataclasses import dataclass

import numpy as np
from numpy.testing import assert_allclose

from bakery.generators.eyes import EyeMaps, seen_eye, with_photographed_eyes
from bakery.generators.shade import EYES
from bakery.geometry import camera as cameras
from bakery.heads.base import PARTS
from bakery.stages.condition import condition, face_camera
from bakery.types import Camera

REST = np.zeros(52, np.float32)


@dataclass(frozen=True)
class Observation:
    """The fields of a Subject that eyes ask for."""

    head: object
    eyes: EyeMaps


@dataclass(frozen=True)
class Lens:
    """What `face_camera` asks of a fit."""

    camera: Camera


def test_a_painting_of_half_the_light_keeps_iris_and_glint(head):
    rng = np.random.default_rng(0)
    ball = rng.uniform(0.1, 0.9, (2, 64, 64, 3)).astype(np.float32)
    glint = np.zeros_like(ball)
    glint[:, 28:34, 28:34] = 0.7
    subject = Observation(head, EyeMaps(ball, glint, np.array([25.0, 25.0]), np.ones((2, 3))))
    away = np.array([0.0, 0.0, -700.0])
    lens = Camera(900.0, np.array([256.0, 256.0]), np.zeros(3), away, 512, 512)
    camera = face_camera(Lens(lens), head, head.mean, 0.0)
    texture = np.full((8, 8, 3), 0.5, np.float32)
    seen = condition(head, head.mean, texture, REST, (5.0, 0.0), camera)
    picture = np.zeros((*seen.part.shape, 3), np.float32)
    for which, name in enumerate(EYES):
        mine = seen.part == PARTS.index(name)
        picture[mine] = 0.5 * seen_eye(subject, seen, which, mine)[0]
    per_mm = camera.focal / -cameras.to_camera(np.zeros(3), camera)[2]
    color, where = with_photographed_eyes(subject, seen, picture, per_mm)
    eyes = np.isin(seen.part, [PARTS.index(name) for name in EYES])
    assert eyes.any()
    np.testing.assert_array_equal(where > 0, eyes)
    for which, name in enumerate(EYES):
        mine = seen.part == PARTS.index(name)
        iris, shine = seen_eye(subject, seen, which, mine)
        assert_allclose(color[mine], 0.5 * iris + shine, rtol=1e-4, atol=1e-5)
        assert shine.max() > 0.3
