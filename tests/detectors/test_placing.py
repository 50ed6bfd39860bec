"""Detectors that only detect, made to follow faces."""

import warnings

import numpy as np
import pytest

from bakery.detectors import frames, network
from bakery.detectors.base import PlacingDetector
from bakery.detectors.frames import FaceFrame, frame_of_points
from bakery.detectors.placing import NearestFace, placing
from bakery.motion.follow import follow
from bakery.types import Landmarks

SHAPE = np.random.default_rng(0).uniform(-0.5, 0.5, (frames.POINTS, 2))
SHAPE[:4] = [[-0.5, -0.5], [0.5, 0.5], [-0.5, 0.5], [0.5, -0.5]]
SHAPE[33], SHAPE[263] = (-0.25, -0.1), (0.25, -0.1)
PICTURE = np.zeros((400, 600, 3), np.uint8)


def face(center, size=80.0, score=0.9):
    points = SHAPE * size + center
    box = np.r_[points.min(0), np.ptp(points, axis=0)]
    return Landmarks(box, score, points, np.full(frames.POINTS, 0.4))


class Plain:
    """A detector that gives one list after the other, the last of them for ever."""

    name, sha256 = "plain", "abc"

    def __init__(self, *answers):
        self.answers = list(answers)

    def detect(self, image):
        return self.answers.pop(0) if len(self.answers) > 1 else self.answers[0]


def test_who_can_follow_is_left_alone():
    detector = network.NetworkDetector(None, None)
    assert isinstance(detector, PlacingDetector) and placing(detector) is detector
    plain = Plain([])
    wrapped = placing(plain)
    assert isinstance(wrapped, NearestFace) and isinstance(wrapped, PlacingDetector)
    assert (wrapped.name, wrapped.sha256) == ("plain", "abc") and wrapped.detect(PICTURE) == []
    assert placing(wrapped) is wrapped


def test_the_nearest_face_is_taken_at_each_place():
    left, right = face((100, 100)), face((300, 200), score=0.7)
    looked = [FaceFrame(np.array(center), 80.0, 0.0) for center in ((310.0, 190), (90.0, 110))]
    points, errors, presence = placing(Plain([left, right])).place(PICTURE, looked)
    np.testing.assert_allclose(points, [right.points, left.points])
    np.testing.assert_allclose(presence, [0.7, 0.9])
    assert errors.shape == (2, frames.POINTS) and (errors == 0).all()


@pytest.mark.parametrize("faces", [[], [face((100, 100))]])
@pytest.mark.parametrize("roll", [0.0, 0.5])
def test_no_face_where_none_is_near(faces, roll):
    """The points then mark the place that was looked at: nothing that follows divides by 0."""
    wanted = FaceFrame(np.array([400.0, 300.0]), 80.0, roll)
    points, _, presence = placing(Plain(faces)).place(PICTURE, [wanted])
    there = frame_of_points(points[0])
    assert presence[0] == 0 and np.isfinite(points).all()
    np.testing.assert_allclose(there.center, wanted.center, atol=1e-9)
    np.testing.assert_allclose((there.size, there.roll), (80, roll), atol=1e-9)


def test_a_clip_is_followed_by_any_detector():
    """The largest face at first, then the nearest, though another one is larger; gaps are gaps."""
    here = [np.array([150.0 + 5 * n, 200]) for n in range(6)]
    answers = {n: [face(here[n]), face((480, 200), 60.0 if n == 0 else 120.0)] for n in range(6)}
    answers[3] = answers[3][1:]  # only the other one is seen

    class Numbered(Plain):
        def detect(self, image):
            return answers[int(image[0, 0, 0])] if image.shape == PICTURE.shape else []

    clip = [(n / 25, PICTURE + np.uint8(n)) for n in range(6)]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        out = follow(clip, Numbered([]))
    assert out.found.tolist() == [True, True, True, False, True, True]
    for n in (0, 1, 2, 4, 5):
        np.testing.assert_allclose(out.points[n], answers[n][0].points, atol=1e-4)
    assert out.doubt == 0
