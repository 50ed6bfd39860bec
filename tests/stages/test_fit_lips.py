"""Lips in the fit: closed ones touch, and expression weights alone say opening and width."""

from types import SimpleNamespace

import numpy as np
import pytest

from bakery import landmarks as marks
from bakery.evaluate.mouths import lip_error, mean_lip_error
from bakery.formats.portraits import landmarks_of
from bakery.geometry import camera as cameras
from bakery.geometry import rotation
from bakery.heads.base import weights
from bakery.heads.file import load_head
from bakery.stages.fit import FitOptions, fit, lips
from bakery.stages.fit.landmarks import LandmarkModel, Weights
from bakery.stages.fit.warp import residual_offsets
from bakery.types import EXPRESSIONS, Camera, Photo

SIZE = 900
BY_POINTS = FitOptions(photometric=False)
GREY = Photo(np.full((SIZE, SIZE, 3), 0.5, np.float32), "")
SMILE = {"mouthSmileLeft": 0.5, "mouthSmileRight": 0.5}


@pytest.fixture(scope="module")
def head():
    return load_head("makehuman")


def seen(head, expression, seed=0, yaw=0.0, pitch=0.0):
    """Points of a person whom the model does not hold, as a detector gives them: on the seam."""
    rng = np.random.default_rng(seed)
    identity = rng.normal(size=30) * 0.7
    bent = residual_offsets(head, rng.normal(size=(marks.FACE, 3)) * [0.4, 0.4, 0])
    turn = rotation.vector(rotation.yaw_pitch(yaw, pitch))
    camera = Camera(1.8 * SIZE, np.full(2, SIZE / 2), turn, np.array([0, 10, -600.0]), SIZE, SIZE)
    shape = head.vertices(head.neutral(identity, bent), weights(expression))
    points = cameras.project(head.landmarks(shape).astype(np.float64), camera)
    upper, lower = points[lips.UPPER], points[lips.LOWER]
    points[lips.UPPER] = np.where(upper[:, 1:] > lower[:, 1:], lower, upper)
    return points


def fitted(head, points):
    return fit(GREY, landmarks_of(points), head, BY_POINTS)


def test_offsets_of_closed_open_and_overlapping_lips(head):
    mean = LandmarkModel(head, 1).mean
    far = np.array([0, 62, -1e5])  # mm; from near, what lies deeper moves to the picture's middle
    camera = Camera(3e5, np.full(2, SIZE / 2), np.zeros(3), far, SIZE, SIZE)
    rest = cameras.project(mean, camera)
    apart = mean[lips.LOWER] - mean[lips.UPPER]
    np.testing.assert_allclose(lips.seam_offsets(mean, rest), 0, atol=0.02)
    closed = rest.copy()
    closed[lips.UPPER] = closed[lips.LOWER]
    offsets = lips.seam_offsets(mean, closed)
    np.testing.assert_allclose(offsets[lips.UPPER], apart)
    assert np.count_nonzero(offsets.any(1)) == len(lips.UPPER)
    closed[lips.LOWER, 1] += 0.03 * np.ptp(closed[marks.MOUTH_CORNERS, 0])
    assert not lips.seam_offsets(mean, closed).any()


def test_rows_measure_opening_and_width():
    rng = np.random.default_rng(0)
    points, moved = rng.random((marks.FACE, 2)) * 500, rng.normal(size=(marks.FACE, 2))
    points[marks.MOUTH_CORNERS] = [[100, 300], [180, 300]]
    confidence = np.ones(marks.FACE)
    confidence[lips.UPPER[0]] = 0.0
    what = SimpleNamespace(points=points, confidence=confidence, size=200.0)
    jacobian = rng.normal(size=(marks.FACE, 2, 4))
    chosen = Weights(opening=9.0, width=4.0)
    found, slope = lips.lip_rows(moved, jacobian, what, chosen)
    opens = (moved[lips.LOWER] - moved[lips.UPPER])[:, 1] / 200
    np.testing.assert_allclose(found[1:-1], opens[1:])
    right, left = marks.MOUTH_CORNERS
    np.testing.assert_allclose(found[-1], 2 * (moved[left] - moved[right])[0] / 200)
    assert found[0] == 0 and not slope[0].any()  # nobody saw that rim
    step = rng.normal(size=4)
    after, _ = lips.lip_rows(moved + jacobian @ step, jacobian, what, chosen)
    np.testing.assert_allclose(after - found, slope @ step, atol=1e-12)


@pytest.mark.parametrize("yaw, pitch", [(0, 0), (20, 0), (0, 12), (0, -12)])
def test_closed_lips_touch_at_rest(head, yaw, pitch):
    for seed in range(3):
        points = seen(head, {}, seed, yaw, pitch)
        found = fitted(head, points)
        for residual in (0 * found.residual, found.residual):
            neutral = head.neutral(found.identity, residual_offsets(head, residual))
            # Percent of the width; half of what still counts as closed. From above the rims of
            # some of these heads do show a gap of 0.5.
            assert lip_error(head, neutral, found, points)["opening"] < 0.5


@pytest.mark.parametrize(
    "expression",
    [SMILE, SMILE | {"jawOpen": 0.1}, {"jawOpen": 0.3}, {"mouthPucker": 0.6}],
)
def test_weights_alone_drive_the_neutral_head(head, expression):
    """The neutral photo's head, moved by what the other photo's fit says: opening, width, contact."""
    rows = []
    for seed in range(4):
        rest, points = seen(head, {}, seed), seen(head, expression, seed, yaw=5)
        still, other = fitted(head, rest), fitted(head, points)
        neutral = head.neutral(still.identity, residual_offsets(head, still.residual))
        rows.append(lip_error(head, neutral, other, points))
    found = mean_lip_error(rows)
    assert found["opening"] < 1.0 and found["width"] < 3.0
    if found["closed"]:
        assert found["gap_worst"] < 0.6


def test_the_measure_sees_a_gap(head):
    points = seen(head, {})
    found = fitted(head, points)
    neutral = head.neutral(found.identity, residual_offsets(head, found.residual))
    gaping = found.expression.copy()
    gaping[EXPRESSIONS.index("jawOpen")] += 0.1  # 2.9 mm, 6% of the width, less the overlap
    found = SimpleNamespace(expression=gaping, gaze=found.gaze, camera=found.camera)
    error = lip_error(head, neutral, found, points)
    assert 2 < error["gap"] < 8 and error["gap"] == pytest.approx(error["opening"], abs=0.3)
