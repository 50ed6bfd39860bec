"""Eyes of a photo: in shadow, and behind lenses that mirror."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from bakery.landmarks import EYES
from bakery.stages.texture.eyes import (
    FEW,
    TWO_TONES,
    WHITEST,
    _mirrored,
    alike,
    dimming,
    with_lit_eyes,
)


def test_eyes_get_the_light_that_their_lids_get(head):
    photo, points = np.full((200, 300, 3), 0.1, np.float32), np.zeros((478, 2))
    for lids, left in zip(EYES, (60, 180)):
        turn = np.linspace(0, 2 * np.pi, len(lids), endpoint=False)
        points[lids] = np.stack([left + 25 * np.cos(turn), 100 + 10 * np.sin(turn)], 1)
    lift = np.zeros((256, 256), np.float32)
    lift[:, 128:] = np.log(3)  # the left half of the face was in shadow
    marks = head.landmark_uv()
    for lids, left in zip(EYES, (60, 180)):
        if marks[lids, 0].mean() > 0.5:
            photo[:, left - 60 : left + 60] /= 3
    out = with_lit_eyes(photo, points, lift, head)
    assert_allclose(out[100, [60, 180]], 0.1, rtol=1e-5)
    assert_allclose(out[150], photo[150], err_msg="no more than the eyes")


def test_an_eye_in_shadow_gets_no_whiter_than_the_other(head):
    points, photo, lift = np.zeros((478, 2)), np.full((200, 240, 3), 0.1, np.float32), None
    for lids, left in zip(EYES, (60, 180)):
        turn = np.linspace(0, 2 * np.pi, len(lids), endpoint=False)
        points[lids] = np.stack([left + 20 * np.cos(turn), 100 + 20 * np.sin(turn)], 1)
    photo[:, :120] = 0.06  # the first eye is darker by 1.7; the skin around it was lifted by 3
    marks = head.landmark_uv()
    lift = np.zeros((64, 64), np.float32)
    first = marks[EYES[0], 0].mean() > 0.5
    lift[:, 32:] = np.log(3) * first
    lift[:, :32] = np.log(3) * (not first)
    out = with_lit_eyes(photo, points, lift, head)
    assert_allclose(out[100, [60, 180]], 0.1, rtol=1e-5)


def test_an_eye_without_anything_dark_is_behind_a_mirror():
    window = np.full(400, 0.6)
    eye = np.where(np.arange(400) % 5 == 0, 0.02, 0.6)  # pupil, iris and lashes
    assert _mirrored(window, 0.4) and not _mirrored(eye, 0.4)
    assert not _mirrored(window[:FEW], 0.4), "too few pixels to tell"
    assert not _mirrored(0.1 * window, 0.4), "an eye in shadow"


def test_a_white_is_no_whiter_than_whites_are():
    """Beside light and dark skin; one that is plausible stays as it is."""
    light, dark = np.full(3, 0.4), np.full(3, 0.05)
    assert dimming(np.full(3, 1.1), light) * 1.1 == pytest.approx(WHITEST[1] * 0.4)
    assert dimming(np.full(3, 1.1), dark) * 1.1 == pytest.approx(WHITEST[0])
    assert dimming(np.full(3, 0.4), dark) == dimming(np.full(3, 0.6), light) == 1


def test_an_iris_in_the_shade_gets_the_tone_of_the_other():
    """Pupil and white stay; irises that differ little are the person's own."""
    away = np.hypot(*(np.mgrid[:64, :64] - 31.5)) / 16
    iris = np.float32((away > 0.5) & (away < 0.95))
    light = np.where(iris[..., None] > 0, np.float32([0.10, 0.12, 0.15]), 0.01).astype(np.float32)
    light[away >= 1] = 0.5
    dark = np.where(iris[..., None] > 0, 0.35 * light, light)
    for pair in ([light, dark], [dark, light]):
        one, other = alike(pair, [iris, iris])
        tones = [np.median(t[iris > 0], 0) for t in (one, other)]
        assert abs(np.log(tones[0] / tones[1])).max() == pytest.approx(TWO_TONES, abs=0.02)
        for before, after in zip(pair, (one, other)):
            np.testing.assert_array_equal(before[iris == 0], after[iris == 0])
            assert (after >= before - 1e-6).all()
    near = [light, 0.9 * light]
    for before, after in zip(near, alike(near, [iris, iris])):
        np.testing.assert_allclose(after, before, rtol=1e-6)
