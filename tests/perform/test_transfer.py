"""The parts of a transferred performance whose answers are known."""

from types import SimpleNamespace

import cv2
import numpy as np
import pytest

from bakery.geometry.color import to_encoded
from bakery.perform.mouths import refined
from bakery.perform.transfer import Frames, _sheet, resting_frames
from bakery.stages.texture.expression import PLACES, SIZE
from bakery.types import EXPRESSION_INDEX


def fits(effort, found=None, turned=None):
    """The fits of a clip whose jaw opens by `effort` [N] and whose head turns by degrees."""
    count = len(effort)
    expression, rotation = np.zeros((count, 52)), np.zeros((count, 3))
    expression[:, EXPRESSION_INDEX["jawOpen"]] = effort
    rotation[:, 1] = np.radians(0 if turned is None else turned)
    found = np.ones(count, bool) if found is None else np.array(found)
    return SimpleNamespace(expression=expression, rotation=rotation, found=found)


def test_the_frames_of_rest_are_those_in_which_least_is_done():
    assert resting_frames(fits([0.5, 0.1, 0.4, 0.0, 0.2]), 2).tolist() == [1, 3]
    unseen = [True, False, True, True, True]
    assert resting_frames(fits([0.5, 0.1, 0.4, 0.0, 0.2], unseen), 2).tolist() == [3, 4]
    assert resting_frames(fits([0.1] * 5, turned=[0, 30, 0, 0, -30]), 3).tolist() == [0, 2, 3]
    assert resting_frames(fits([0.1, 0.2], [False, True]), 5).tolist() == [1]


def test_where_one_looks_is_no_effort():
    looking = fits([0.1, 0.2])
    looking.expression[0, EXPRESSION_INDEX["eyeLookUpLeft"]] = 1
    assert resting_frames(looking, 1).tolist() == [0]


def test_pictures_come_by_number_in_any_order():
    opened = []

    def reopen():
        opened.append(1)
        return SimpleNamespace(frames=lambda: ((k / 25, np.full(1, k)) for k in range(9)))

    frames = Frames(reopen)
    assert [int(frames.picture(k)[0]) for k in (0, 2, 7, 3, 4, 0)] == [0, 2, 7, 3, 4, 0]
    assert len(opened) == 3  # once, and for each step back


def test_the_mouth_sheet_is_where_the_layout_says():
    texture = np.zeros((SIZE, SIZE, 3), np.float32)
    left, top, width, height = PLACES["mouth_sheet"]
    column, row = (left + 0.25 * width) * SIZE, (top + 0.5 * height) * SIZE
    cv2.circle(texture, (round(column - 0.5), round(row - 0.5)), 6, (1, 1, 1), cv2.FILLED)
    sheet = _sheet(texture, (120, 200))[..., 0]
    place = np.argwhere(sheet > 0.5).mean(0) + 0.5
    assert place == pytest.approx([60, 50], abs=1.5)  # half a texel of 256


@pytest.fixture(scope="module")
def teeth():
    """A mouth [96, 160, 3] linear: red round a row of teeth with dark gaps."""
    picture = np.full((96, 160, 3), (0.45, 0.1, 0.1), np.float32)
    picture[38:62, 20:140] = 0.8
    picture[38:62, 20:140:12] = 0.1
    return cv2.GaussianBlur(picture, (0, 0), 0.8)


def test_a_soft_copy_of_the_own_mouth_becomes_sharp(teeth):
    sharp = to_encoded(teeth).astype(np.float32)
    for shift in (0, 4):
        want = np.roll(sharp, shift, 0)
        made = refined(cv2.GaussianBlur(want, (0, 0), 2.5), teeth)
        inner = np.s_[20:80, 16:144]
        soft = cv2.GaussianBlur(want, (0, 0), 2.5)
        before = np.abs(soft - want)[inner].mean()
        after = np.abs(to_encoded(made) - want)[inner].mean()
        assert after < 0.6 * before, (shift, before, after)


def test_a_mouth_that_shows_something_else_is_the_performers(teeth):
    """Where the own mouth has teeth and the performer's none, none are shown."""
    without = np.full_like(teeth, (0.6, 0.3, 0.3))
    without[60:] = 0.9
    gain = (to_encoded(teeth).mean((0, 1)) + 0.02) / (without.mean((0, 1)) + 0.02)
    made = to_encoded(refined(without, teeth))
    want = np.clip(without * gain, 0, 1)
    assert np.abs(made - want)[40:56, 30:130].mean() < 0.08


def test_the_colour_is_the_targets(teeth):
    """A performer in blue light plays a mouth in warm colours: it stays warm."""
    blue = np.clip(to_encoded(teeth) * [0.6, 0.8, 1.0], 0, 1).astype(np.float32)
    made = refined(cv2.GaussianBlur(blue, (0, 0), 2.5), teeth)
    means = [to_encoded(x).mean((0, 1)) for x in (made, teeth)]
    assert means[0] == pytest.approx(means[1], rel=0.06)
