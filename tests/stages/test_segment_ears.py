"""Hair that was taken for an ear is told by its colours; ears in any light stay ears."""

import numpy as np
import pytest

from bakery.detectors import portrait
from bakery.stages.segment import prior
from bakery.stages.segment.ears import covered

SKIN, SHADE = (0.85, 0.62, 0.52), (0.45, 0.3, 0.24)
GREY, BLACK, BLONDE, PEARL = (0.6, 0.58, 0.56), (0.08, 0.07, 0.07), (0.75, 0.6, 0.38), (1, 1, 0.97)
FACE, HAIR = np.s_[70:200, 70:186], np.s_[30:150, 40:70]
EAR = np.s_[110:150, 50:70]  # the hair goes on above it and outside of it


def scene(hair, ear):
    """Labels and a picture of a face with hair to its right, and a would-be ear of some colour."""
    top = np.full((prior.SIZE, prior.SIZE), portrait.BACKGROUND, np.uint8)
    picture = np.full((prior.SIZE, prior.SIZE, 3), (0.4, 0.5, 0.6), np.float32)
    for where, label, color in (
        (FACE, portrait.SKIN, SKIN), (HAIR, portrait.HAIR, hair), (EAR, portrait.EARS, ear),
    ):  # fmt: skip
        top[where], picture[where] = label, color
    noise = np.random.default_rng(0).normal(0, 0.02, picture.shape)
    return top, np.clip(picture + noise, 0, 1).astype(np.float32)


@pytest.mark.parametrize("hair", [GREY, BLONDE])
def test_hair_over_an_ear_is_hair(hair):
    top, picture = scene(hair, hair)
    found = covered(top, picture)
    ear = top == portrait.EARS
    assert found[ear].mean() > 0.9 and not found[~ear].any()
    mirrored = covered(top[:, ::-1], picture[:, ::-1])
    assert (mirrored[:, ::-1] == found).all()


@pytest.mark.parametrize(
    "hair, ear", [(GREY, SKIN), (BLONDE, SKIN), (BLACK, SHADE), (GREY, SHADE), (GREY, PEARL)]
)
def test_ears_and_what_hangs_from_them_are_left_alone(hair, ear):
    assert not covered(*scene(hair, ear)).any()


def test_an_ear_that_hair_hardly_touches_is_one_in_any_colour():
    top, picture = scene(GREY, GREY)
    top[HAIR] = np.where(top[HAIR] == portrait.HAIR, portrait.BACKGROUND, top[HAIR])
    assert not covered(top, picture).any(), "there is no hair"
    top[60:105, 40:70] = portrait.HAIR  # ends above
    assert not covered(top, picture).any()


def test_a_few_pixels_tell_nothing():
    top, picture = scene(GREY, GREY)
    top[EAR] = portrait.HAIR
    top[110:115, 50:60] = portrait.EARS
    assert not covered(top, picture).any()
    assert not covered(np.full_like(top, portrait.SKIN), picture).any()
