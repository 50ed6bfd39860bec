"""The built-in plug-ins keep to what is asked of any plug-in; wrong ones are told what is wrong."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from bakery import testing
from bakery.errors import InputError
from bakery.plugins import plug_in


def test_the_detector():
    testing.check_detector(plug_in("detectors", "network"))


@pytest.mark.parametrize("name", ["pagan", "rendered"])
def test_the_generators(name):
    testing.check_generator(plug_in("generators", name))


def test_the_head(head):
    testing.check_head(head)


@pytest.mark.parametrize("name", ["cards", "layer", "none"])
def test_the_hair(name):
    testing.check_hair(plug_in("hair", name))


def test_a_detector_that_swaps_the_irises():
    network = plug_in("detectors", "network")

    def detect(picture):
        faces = network.detect(picture)
        order = [*range(468), *range(473, 478), *range(468, 473)]
        return [replace(face, points=face.points[order]) for face in faces]

    with pytest.raises(AssertionError, match="right iris comes first"):
        testing.check_detector(SimpleNamespace(name="swapped", sha256="", detect=detect))


def test_a_generator_whose_picture_is_not_its_parts():
    rendered = plug_in("generators", "rendered")

    def generate(*args):
        made = rendered.generate(*args)
        return replace(made, image=made.image + 0.1)

    wrong = SimpleNamespace(name="wrong", sha256="", source_type="x", generate=generate)
    with pytest.raises(AssertionError, match="image: 0.1"):
        testing.check_generator(wrong)


def test_a_head_whose_jaw_does_not_open(head):
    from bakery.types import EXPRESSION_INDEX

    basis = head.expression_basis.copy()
    basis[EXPRESSION_INDEX["jawOpen"]] = 0
    with pytest.raises(AssertionError, match="jawOpen"):
        testing.check_head(replace(head, expression_basis=basis))


def test_hair_that_is_not_multiplied():
    def layer(linear, mattes, head, atlas, visibility):
        return np.concatenate(
            [np.ones((atlas.size,) * 2 + (3,)), np.zeros((atlas.size,) * 2 + (1,))], -1
        ).astype(np.float32)

    with pytest.raises(AssertionError, match="multiply"):
        testing.check_hair(SimpleNamespace(name="wrong", sha256="", layer=layer))


def test_refuses():
    def refused():
        raise InputError("photo.jpg: too dark; give another")

    testing.refuses(refused, "too dark")
    with pytest.raises(AssertionError, match="nothing was refused"):
        testing.refuses(lambda: None)
    with pytest.raises(AssertionError, match="lacks"):
        testing.refuses(refused, "too bright")
