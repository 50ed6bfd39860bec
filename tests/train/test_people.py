"""Painted people for the detector: their points lie where they should, and faces do what is hard to see."""

import numpy as np
import pytest

from bakery.train.detector import people
from bakery.train.detector.people import random_face, random_view
from bakery.types import EXPRESSION_INDEX


@pytest.mark.parametrize("painter", ["quick", "careful"])
def test_painted_people_come_with_their_points(head, painter):
    """Every frame is another one, and its points are in it or just beside it."""
    from bakery.synth.quick import make_stage

    rng = np.random.default_rng(4)
    if painter == "quick":
        found = list(people.quick_frames(rng, make_stage(head, 128), [], 3))
    else:
        small = people.TrainingOptions(size=96, supersample=1)
        found = list(people.careful_frames(rng, head, 2, small))
    for picture, points in found:
        assert picture.dtype == np.uint8 and picture.shape[0] == picture.shape[1]
        assert points.shape == (478, 2) and picture.std() > 3
        side = len(picture)
        inside = (points > -0.2 * side) & (points < 1.2 * side)
        assert inside.all()
    first, second = (points for _, points in found[:2])
    assert np.abs(first - second).max() > 3  # another view, another expression


def test_faces_blink_open_and_press_their_lips():
    rng = np.random.default_rng(0)
    rows = np.array([random_face(rng)[0] for _ in range(400)])
    assert rows.min() >= 0 and rows.max() <= 1
    assert (rows[:, EXPRESSION_INDEX["eyeBlinkLeft"]] > 0.8).mean() > 0.1
    assert (rows[:, EXPRESSION_INDEX["jawOpen"]] > 0.4).mean() > 0.05
    for name in ("mouthPressLeft", "mouthRollLower", "mouthPucker", "mouthClose"):
        assert (rows[:, EXPRESSION_INDEX[name]] > 0.2).mean() > 0.02


def test_views_reach_far_to_both_sides():
    rng = np.random.default_rng(0)
    yaw, pitch, roll = np.array([random_view(rng) for _ in range(500)]).T
    assert yaw.min() < -38 and yaw.max() > 38 and np.abs(yaw).max() <= 42
    assert np.abs(pitch).max() <= 42 and np.abs(roll).max() <= 42
    assert (np.abs(yaw) < 15).mean() > 0.4
