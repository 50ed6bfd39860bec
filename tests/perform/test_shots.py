"""Cuts of a clip: known ones are found, and what moves within a shot is none."""

import numpy as np
import pytest

from bakery.motion.follow import Followed
from bakery.perform.performance import sure
from bakery.perform.shots import shots


def picture(seed, shift=0):
    """A smooth random picture [64, 96, 3], moved to the right by some pixels."""
    coarse = np.random.default_rng(seed).integers(0, 255, (4, 6, 3))
    return np.roll(np.repeat(np.repeat(coarse, 16, 0), 16, 1), shift, 1).astype(np.uint8)


def lengths(pictures):
    return [len(list(shot)) for shot in shots(enumerate(pictures))]


def test_a_clip_without_a_cut_is_one_shot():
    assert lengths([picture(1)] * 5) == [5]
    assert lengths([]) == []


def test_every_cut_begins_a_shot():
    assert lengths([picture(1)] * 4 + [picture(2)] * 3 + [picture(1)] * 2) == [4, 3, 2]
    assert lengths([picture(1), picture(2), picture(2)]) == [1, 2]


@pytest.mark.parametrize("speed", [1, 2, 3])
def test_a_camera_that_moves_does_not_cut(speed):
    assert lengths([picture(1, speed * k) for k in range(20)]) == [20]


def test_light_that_changes_does_not_cut():
    assert lengths([picture(1) // 4 + 8 * k for k in range(12)]) == [12]


def test_points_of_blurred_frames_are_left_out():
    doubts = np.array([0.02, 0.02, 0.2, 0.021, np.nan])
    points = np.ones((5, 478, 2), np.float32)
    points[4] = np.nan
    found = sure(Followed(np.arange(5.0), points, 96, 64, doubts)).found
    assert found.tolist() == [True, True, False, True, False]


def test_a_clip_as_doubtful_as_ever_keeps_its_points():
    """What is hard to see throughout has no better neighbours."""
    followed = Followed(np.arange(3.0), np.ones((3, 478, 2), np.float32), 96, 64, np.full(3, 0.3))
    assert sure(followed) is followed
