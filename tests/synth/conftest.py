"""The built-in head, and one small painted picture that the tests share."""

import numpy as np
import pytest

from bakery.heads.base import look, weights
from bakery.heads.file import load_head
from bakery.synth.render import dress, paint
from bakery.synth.scene import Scene, portrait_camera, studio_light
from bakery.synth.subject import Subject


@pytest.fixture(scope="session")
def head():
    return load_head("makehuman")


@pytest.fixture(scope="session")
def subject():
    return Subject(seed=4, identity=np.zeros(10, np.float32), hair="crop", hair_color="black")


@pytest.fixture(scope="session")
def wardrobe(head, subject):
    return dress(head, subject, detail=1.2, share=0.15)


@pytest.fixture(scope="session")
def scene():
    return Scene(
        portrait_camera(200, 250),
        studio_light(azimuth=-60, key=1.0, fill=0.0, ambient=0.15),
        look(weights({}), (0, 0)),
        background="studio",
        background_color=np.array([0.1, 0.1, 0.9]),
        grain=0.0,
        quality=None,
    )


@pytest.fixture(scope="session")
def picture(wardrobe, scene):
    return paint(wardrobe, scene, supersample=2, quality=0.3)
