"""Landmarks on plain skin say how wide a face is, and hardly how far it is turned."""

import numpy as np
import pytest

from bakery import landmarks as marks
from bakery.evaluate.fitting import landmark_error
from bakery.formats.portraits import landmarks_of
from bakery.geometry import camera as cameras
from bakery.geometry import rotation
from bakery.heads.base import weights
from bakery.heads.file import load_head
from bakery.stages.fit import FitOptions, fit
from bakery.stages.fit.landmarks import Weights
from bakery.stages.fit.sideways import SIDES, believed, share_of, twins
from bakery.types import Camera, Photo

SIZE = 600


@pytest.fixture(scope="module")
def head():
    return load_head("makehuman")


def test_twins_are_mutual_and_middle_landmarks_their_own(head):
    twin = twins(head)
    np.testing.assert_array_equal(twin[twin], np.arange(marks.FACE))
    np.testing.assert_array_equal(twin[marks.BROW_RIGHT], marks.BROW_LEFT)
    assert twin[1] == 1 and twin[152] == 152  # tip of the nose, chin


def test_a_share_of_the_common_part_is_believed_and_all_of_the_difference(head):
    twin, share = twins(head), 0.25
    move = np.random.default_rng(0).normal(size=(marks.FACE, 3))
    out = believed(move, twin, share)
    plain = marks.PLAIN
    common, kept = ((x[plain] + x[twin[plain]]) / 2 for x in (move, out))
    np.testing.assert_allclose(kept[:, 0], share * common[:, 0])
    np.testing.assert_allclose((out - out[twin])[plain], (move - move[twin])[plain])
    np.testing.assert_array_equal(out[:, 1:], move[:, 1:])
    seen = np.setdiff1d(np.arange(marks.FACE), plain)
    np.testing.assert_array_equal(out[seen], move[seen])
    np.testing.assert_allclose(believed(move, twin, 1.0), move)


def test_a_derivative_is_believed_as_its_value(head):
    twin, aside = twins(head), np.array([0.6, 0.8])
    columns = np.random.default_rng(1).normal(size=(marks.FACE, 2, 5))
    step = np.random.default_rng(2).normal(size=5)
    there = believed(columns, twin, 0.3, aside) @ step
    np.testing.assert_allclose(there, believed(columns @ step, twin, 0.3, aside))


def test_photos_from_two_sides_tell_it():
    assert share_of([8.0], 0.2) == share_of([0, SIDES[0]], 0.2) == 0.2
    assert share_of([-30, 30, 0], 0.2) == 1
    assert 0.2 < share_of([0, 30], 0.2) < 1


def seen(head, yaw, lag):
    """A head that is turned by `yaw` degrees and plain skin as if by `lag` less; in the middle of a photo."""

    def points(degrees):
        turn = rotation.vector(rotation.yaw_pitch(degrees, 0))
        away = np.array([0, 10, -600.0])
        camera = Camera(1.8 * SIZE, np.full(2, SIZE / 2), turn, away, SIZE, SIZE)
        places = head.landmarks(head.vertices(neutral, weights({})))
        return cameras.project(places.astype(np.float64), camera)

    neutral = head.neutral(np.random.default_rng(3).normal(size=30) * 0.7)
    out = points(yaw)
    out[marks.PLAIN] = points(yaw - lag)[marks.PLAIN]
    return out


@pytest.mark.parametrize("yaw", [-14.0, 10.0])
def test_a_head_turns_by_what_is_seen_and_its_nose_stays_straight(head, yaw):
    grey = Photo(np.full((SIZE, SIZE, 3), 0.5, np.float32), "")
    where = landmarks_of(seen(head, yaw, 4 * np.sign(yaw)))

    def found(share):
        by_points = FitOptions(photometric=False, weights=Weights(sideways=share))
        return fit(grey, where, head, by_points)

    shy, trusting = found(Weights.sideways), found(1.0)
    # As on portraits: turned too little where all count alike, and the warp bends the nose.
    assert abs(trusting.diagnostics["yaw"] - yaw) > 2
    assert abs(shy.diagnostics["yaw"] - yaw) < 1
    bent = [abs(each.residual[4, 0]) for each in (trusting, shy)]
    assert bent[0] > 0.5 and bent[1] < 0.25 * bent[0]
    assert landmark_error(shy, where.points)["all"] < 2.5
