"""The parts of a transferred performance whose answers are known."""

from types import SimpleNamespace

import cv2
import numpy as np
import pytest

from bakery.geometry.color import to_encoded
from bakery.perform.mouths import refined
from bakery.perform.transfer import Frames, Target, _sheet, open_frames, resting_frames
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
    made = to_encoded(refined(without, teeth))
    assert np.abs(made - without)[40:56, 30:130].mean() < 0.08


def test_the_colours_are_the_targets_whatever_is_shown(teeth):
    """A performer in blue light, with half of the target's poses turned about: the tone is the light's."""
    light = np.array([0.6, 0.8, 1.0], np.float32)
    own = {0: teeth, 1: teeth * 0.5}
    texture = {k: np.zeros((SIZE, SIZE, 3), np.float32) for k in own}
    left, top, width, height = (round(SIZE * share) for share in PLACES["mouth_sheet"])
    for k, picture in own.items():
        acted = cv2.resize(to_encoded(picture).astype(np.float32) * light, (width, height))
        texture[k][top : top + height, left : left + width] = acted
    poses = np.zeros((2, 52), np.float32)
    poses[:, 0] = 0, 1
    performer = SimpleNamespace(fits=SimpleNamespace(expression=poses), talk=tuple(texture.items()))
    target = SimpleNamespace(own_mouth=lambda pose: own[int(pose[0])])
    assert Target.tone(target, performer) == pytest.approx(1 / light, rel=0.08)


def test_open_mouths_tell_of_colours():
    effort = np.linspace(0, 1, 21)
    assert open_frames(fits(effort), 3).tolist() == [11, 16, 20]
    assert open_frames(fits([0.3]), 6).tolist() == [0]
    assert open_frames(fits([0.9, 0.1], [False, True]), 6).tolist() == [1]
