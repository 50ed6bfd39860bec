"""A face followed through a clip: crops that stay and move, a face that is lost, found again, gone."""

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from bakery.detectors import frames
from bakery.errors import InputError
from bakery.landmarks import face_size
from bakery.motion import follow as follows
from bakery.motion.follow import FollowOptions, follow
from bakery.motion.gaps import filled, gaps_of, told
from bakery.plugins import plug_in
from bakery.types import Landmarks

SIZE, FACE = 384, 100.0
SAMPLES = Path(__file__).resolve().parents[2] / "samples"
SHAPE = np.random.default_rng(0).uniform(-0.5, 0.5, (frames.POINTS, 2))
SHAPE[:4] = [[-0.5, -0.5], [0.5, 0.5], [-0.5, 0.5], [0.5, -0.5]]
SHAPE[33], SHAPE[263] = (-0.25, -0.1), (0.25, -0.1)


def face(points):
    box = np.r_[points.min(0), np.ptp(points, axis=0)]
    return Landmarks(box, 0.9, points, np.ones(frames.POINTS))


class Scripted:
    """A detector whose answers are known; pictures carry their number in every pixel.

    Beside the face stands a smaller one.
    """

    name, sha256 = "scripted", ""

    def __init__(self, present, centers=None):
        """
        Args:
            present: of each frame, what the points network says of any crop; None: nobody is found.
            centers: [N, 2] of the face.
        """
        self.present, self.detected, self.crops = present, [], []
        centers = [(180.0, 200.0)] * len(present) if centers is None else centers
        self.points = [SHAPE * FACE + center for center in centers]

    def detect(self, picture):
        number = int(picture[0, 0, 0])
        self.detected.append((number, picture.shape[0] == SIZE))
        if self.present[number] is None or picture.shape[0] != SIZE:
            return []
        return [face(SHAPE * 40.0 + (320, 60)), face(self.points[number])]

    def place(self, picture, found):
        number = int(picture[0, 0, 0])
        self.crops.append((number, found[0]))
        unsure = np.full((1, frames.POINTS), 3.0)  # pixels
        return self.points[number][None], unsure, np.array([self.present[number] or 0.0])

    def closer(self, picture, points, errors):
        return points, errors


def clip(count):
    for number in range(count):
        yield number / 30, np.full((SIZE, SIZE, 3), number, np.uint8)


def test_the_face_is_found_once_and_again_when_lost():
    """The largest face is taken; a frame in which nobody is found is a hole."""
    detector = Scripted([1, 1, 1, 0.2, 1, 1, None, None, 1, 1, 1, 1])
    done = []
    out = follow(clip(12), detector, progress=done.append)
    # Around its last place before the whole picture; at frame 8 its old crop shows it again.
    assert [number for number, whole in detector.detected if whole] == [0, 3, 6, 7]
    assert detector.detected[1][1] is False and done == list(range(1, 13))
    assert np.flatnonzero(~out.found).tolist() == [6, 7]
    np.testing.assert_allclose(out.points[1], detector.points[1], atol=1e-4)
    assert (out.width, out.height) == (SIZE, SIZE)
    assert out.doubt == pytest.approx(3 / float(face_size(detector.points[0])), rel=1e-4)


def test_the_crop_stays_until_the_face_has_moved():
    centers = np.tile([180.0, 200.0], (12, 1)) + [[0.03 * FACE * (n % 2), 0] for n in range(12)]
    centers[8:] += [0.1 * FACE, 0]
    detector = Scripted([1] * 12, centers)
    follow(clip(12), detector)
    crops = [crop.center[0] for _, crop in detector.crops]
    assert len(crops) == 12, "one look a frame: it never moves far"
    assert len(set(crops[:9])) == 1 and crops[-1] == pytest.approx(crops[0] + 0.1 * FACE, abs=4)


def test_a_face_that_moved_far_is_looked_at_again():
    """At once, in a crop that has followed it, not at the next frame."""
    centers = np.tile([180.0, 200.0], (4, 1))
    centers[2:] += [0.4 * FACE, 0]
    detector = Scripted([1] * 4, centers)
    follow(clip(4), detector)
    assert [number for number, _ in detector.crops] == [0, 1, 2, 2, 3]
    assert detector.crops[3][1].center[0] == pytest.approx(180 + 0.4 * FACE, abs=3)


def test_nobody_else_is_followed_after_a_short_gap():
    """In the gap the smaller one behind stays; the person is the nearest one to where it was."""
    present = [1, 1, *[0.0] * 3, 1, 1]

    class Beside(Scripted):
        def detect(self, picture):
            found = super().detect(picture)
            return found[:1] if int(picture[0, 0, 0]) in (2, 3, 4) else found

    out = follow(clip(7), Beside(present))
    assert np.flatnonzero(~out.found).tolist() == [2, 3, 4]
    np.testing.assert_allclose(out.points[5], out.points[0], atol=1e-4)
    # Without a bridge the other one is a face as good as any.
    out = follow(clip(7), Beside(present), FollowOptions(bridge=0))
    assert out.found.sum() > 4


def test_after_a_long_gap_whoever_is_there_is_followed():
    centers = np.tile([100.0, 100.0], (8, 1))
    centers[5:] = (280, 280)  # beyond the reach
    present = [1, None, None, None, None, 1, 1, 1]
    for bridge, lost in ((4, [1, 2, 3, 4, 5]), (3, [1, 2, 3, 4])):
        detector = Scripted(present, centers)
        detector.place = hidden_far(detector)
        out = follow(clip(8), detector, FollowOptions(bridge=bridge, reach=1.0))
        assert np.flatnonzero(~out.found).tolist() == lost


def hidden_far(detector):
    """`place` that sees the face only where the crop has it."""
    plain = detector.place

    def place(picture, found):
        points, errors, presence = plain(picture, found)
        middle = (points[0].min(0) + points[0].max(0)) / 2
        far = np.linalg.norm(found[0].center - middle) > FACE
        return points, errors, presence * (not far)

    return place


def test_a_clip_without_a_face_is_refused():
    with pytest.raises(InputError, match="no face found in any frame"):
        follow(clip(12), Scripted([None] * 12))


@pytest.fixture(scope="module")
def shipped():
    return plug_in("detectors", "network")


@pytest.fixture(scope="module")
def subject(shipped):
    """The painted Anna in 640x480, her face 110 pixels large: picture, her points."""
    picture = cv2.imread(str(SAMPLES / "anna.jpg"))
    small = cv2.resize(picture, (225, 282), interpolation=cv2.INTER_AREA)[..., ::-1]
    rest = (640 - 225, 480 - 282)
    wide = cv2.copyMakeBorder(
        small, rest[1] // 2, rest[1] - rest[1] // 2, rest[0] // 2, rest[0] - rest[0] // 2,
        cv2.BORDER_REPLICATE,
    )  # fmt: skip
    (found,) = shipped.detect(np.ascontiguousarray(wide))
    return np.ascontiguousarray(wide), found.points


def film(pictures):
    return [(number / 25, picture) for number, picture in enumerate(pictures)]


def errors_of(out, points, shifts):
    """Of each frame's points, mean distance from where they are in outer-eye distances."""
    truth = points + np.array(shifts)[:, None]
    return np.linalg.norm(out.points - truth, axis=2).mean(1) / face_size(points)


@pytest.mark.parametrize("light", [1.0, 0.05])
def test_a_face_that_jumps_is_not_lost(shipped, subject, light):
    """By two thirds of its size, there and back, also in the dark, where nothing detects a face.

    4% of the eye distance: twice what the network itself is off between two crops in the dark.
    """
    picture, points = subject
    jump = round(0.67 * np.ptp(points, axis=0).max())
    shifts = [(0, 0), (jump, 0), (jump, jump // 3), (0, 0), (-jump, 0), (-jump // 3, 0)]
    pictures = [np.roll(picture, shift[::-1], (0, 1)) for shift in shifts]
    dark = [pictures[0], *((one * light).astype(np.uint8) for one in pictures[1:])]
    if light < 1:
        assert all(shipped.detect(one) == [] for one in dark[1:]), "not dark enough to prove it"
    out = follow(film(dark), shipped)
    assert out.found.all()
    assert errors_of(out, points, shifts).max() < 0.04


def test_a_face_that_goes_is_not_held_on_to(shipped, subject):
    """Plain wall, noise and cloth are no face, however near one was."""
    picture, points = subject
    rng = np.random.default_rng(0)
    top = round(float(points[:, 1].min())) - 65
    wall = picture.copy()
    wall[top:] = wall[5, 5]
    noise = rng.integers(0, 255, picture.shape, np.uint8)
    y, x = np.mgrid[:480, :640]
    cloth = np.repeat((128 + 90 * np.sin(x / 9) * np.sin(y / 7))[..., None], 3, 2).astype(np.uint8)
    out = follow(film([picture, wall, noise, cloth, picture]), shipped)
    assert out.found.tolist() == [True, False, False, False, True]
    assert errors_of(out, points, [(0, 0)] * 5)[[0, 4]].max() < 0.03


def test_gaps():
    found = np.array([0, 0, 1, 1, 0, 1, 0, 0, 0], bool)
    assert gaps_of(found) == [(0, 2), (4, 5), (6, 9)]
    assert gaps_of(np.ones(3, bool)) == [] and gaps_of(np.zeros(3, bool)) == [(0, 3)]


def test_short_gaps_lie_between_their_neighbours_and_in_long_ones_the_face_rests():
    found = np.ones(40, bool)
    found[5:8] = found[15:35] = False
    seconds = np.arange(40) / 25
    values = np.where(np.arange(40) < 10, np.arange(40) / 10, 0.8)[:, None]
    out = filled(values[found], found, seconds, 8)[:, 0]
    np.testing.assert_allclose(out[5:8], [0.5, 0.6, 0.7])  # on the line
    np.testing.assert_allclose(out[19:31], 0, atol=1e-12)  # half of 8 frames inside
    assert (np.diff(out[14:20]) < 0).all() and (np.diff(out[30:36]) > 0).all()
    np.testing.assert_allclose(out[found], values[found][:, 0])  # what was seen stays
    still = filled(values[found], found, seconds, 8, rests=False)[:, 0]
    np.testing.assert_allclose(still[15:35], 0.8)  # a head goes on as it was
    np.testing.assert_allclose(filled(values[found], found, seconds, 20)[15:35], 0.8)


@pytest.mark.parametrize("bridge", [0, 1, 2, 3, 8])
@pytest.mark.parametrize("length", [1, 2, 3, 4, 9])
def test_any_gap_at_any_place_is_filled(bridge, length):
    for first in (0, 1, 7, 20 - length):
        found = np.ones(20, bool)
        found[first : first + length] = False
        out = filled(np.full((20 - length, 2), 0.5), found, np.arange(20) / 25, bridge)
        assert out.shape == (20, 2) and np.isfinite(out).all()
        assert (out[found] == 0.5).all() and out.min() >= 0 and out.max() <= 0.5
        assert (out[~found].min() == 0) == (length > bridge)


def test_gaps_are_told():
    found = np.ones(60, bool)
    found[[3, 4, 9]] = found[20:45] = False
    assert told(found, 7 + np.arange(60) / 25, 8) == (
        "3 frames without a face interpolated",
        "25 frames without a face, 0.80 to 1.76 s: the face rests there",
    )
    assert told(np.ones(4, bool), np.arange(4.0), 8) == ()


def test_turns_count_by_the_shorter_way():
    one = frames.FaceFrame(np.zeros(2), 10.0, np.pi - 0.01)
    assert follows.moved(one, replace(one, roll=-np.pi + 0.01)) == pytest.approx(0.02)
