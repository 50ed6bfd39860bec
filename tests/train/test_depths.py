"""Depth that turned faces show, on faces projected from known heads."""

import numpy as np
import pytest
from scipy.sparse import csr_matrix

from bakery import landmarks as marks
from bakery.geometry import camera as cameras
from bakery.geometry import rotation
from bakery.heads.build import learn, parallax
from bakery.heads.build.wheel import Raw
from bakery.train import depths
from bakery.types import EXPRESSION_INDEX, EXPRESSIONS, Camera

SIZE = (675, 825)
SMILE = [EXPRESSION_INDEX["mouthSmile" + side] for side in ("Left", "Right")]
NOSE = np.array([168, 6, 197, 195, 5, 4])  # its ridge


def camera(yaw):
    turn = rotation.yaw_pitch(yaw, 0.0)
    place = turn @ [0, 40.0, 0] + [0, 0, -600.0]
    return Camera(1485.0, np.array(SIZE) / 2, rotation.vector(turn), place, *SIZE)


def faces(places, yaws):
    """Points [N, 478, 2] of landmarks [468, 3], or of each of N, that are turned."""
    out = np.zeros((len(yaws), 478, 2))
    for face, yaw, points in zip(out, yaws, np.broadcast_to(places, (len(yaws), 468, 3))):
        face[:468] = cameras.project(points, camera(yaw))
    return out


@pytest.fixture(scope="module")
def turned(head):
    """Faces of the mean head, half of them smiling, with a longer nose and lips back in the smile."""
    yaws = np.tile(np.linspace(-20, 20, 8), 2)
    weights = np.zeros(len(EXPRESSIONS))
    weights[SMILE] = 0.9
    rest, smile = (
        head.landmarks(head.vertices(head.mean, w))[:468].astype(float)
        for w in (0 * weights, weights)
    )
    rest[NOSE, 2] += 4
    smile[NOSE, 2] += 4
    smile[marks.LIPS, 2] -= 5
    points = np.concatenate([faces(rest, yaws[:8]), faces(smile, yaws[8:])])
    return depths.missing_depths(head, points, np.tile(SIZE, (len(points), 1)))


def test_a_longer_nose_is_seen(turned):
    """Identity takes a part of it, and so does the turn."""
    ahead = turned.rest - turned.rest[np.setdiff1d(parallax.STEADY, NOSE)].mean()
    assert 1.5 < ahead[NOSE].mean() < 4.5
    assert abs(ahead[marks.LIPS].mean()) < 1.2
    assert turned.turned == pytest.approx(13.1, abs=0.4)  # of -20 to 20 degrees in eight


def test_lips_that_go_back_in_a_smile_are_seen(turned):
    more = turned.smile - turned.smile[parallax.STEADY].mean()
    assert -7 < more[marks.LIPS].mean() < -3


def test_a_head_lacks_nothing_of_itself(head):
    points = faces(head.landmarks(head.mean)[:468], np.linspace(-20, 20, 6))
    found = depths.missing_depths(head, points, np.tile(SIZE, (6, 1)))
    # The contour may slide, and a fit's prior holds it back a little.
    assert np.sqrt((found.rest[parallax.SEEN] ** 2).mean()) < 0.2


def test_turned_faces_are_measured(head):
    """Of the head itself all is met; a nose that stands ahead is not, and lips moved aside are told."""
    places = head.landmarks(head.mean)[:468].astype(float)
    yaws = np.linspace(-20, 20, 6)
    sizes = np.tile(SIZE, (6, 1))
    own = depths.measure_turned(head, faces(places, yaws), sizes)
    assert own["turned: nose, %"] < 0.3 and own["turned: lips, %"] < 0.3
    longer = places.copy()
    longer[NOSE, 2] += 8
    longer = depths.measure_turned(head, faces(longer, yaws), sizes)
    assert longer["turned: nose, %"] > 1.5 * own["turned: nose, %"]
    flatter = places.copy()
    flatter[marks.LIPS, 2] -= 8
    flatter = depths.measure_turned(head, faces(flatter, yaws), sizes)
    assert flatter["turned: mouthLeft less mouthRight, rms"] > 0.05
    assert flatter["turned: its correlation with the turn"] < -0.8


def lacking(**at):
    """Depths of a head that lacks something at some landmarks: name -> (points, mm)."""
    found = {"rest": np.zeros(468), "smile": np.zeros(468)}
    for name, (points, depth) in at.items():
        found[name][points] = depth
    return parallax.Depths(found["rest"], found["smile"], 10.0)


def test_the_mean_gets_the_depth_and_keeps_its_front(head):
    assert np.linalg.norm(parallax.depth_shift(head, lacking())) == 0
    shift = parallax.depth_shift(head, lacking(rest=(NOSE, 5.0)))
    moved = head.landmarks(head.neutral(shift)) - head.landmarks(head.mean)
    eyes = np.concatenate(marks.EYES)
    assert 0.2 < moved[NOSE, 2].mean() - moved[eyes, 2].mean() < 5
    assert np.sqrt((moved[:468, :2] ** 2).sum(1).mean()) < 0.5


def flat(side):
    """A control mesh: a square of quads of skin, 1 mm apart, and one quad of teeth off it."""
    y, x = np.mgrid[:side, :side].reshape(2, -1).astype(float)
    corner = (np.arange(side - 1)[:, None] * side + np.arange(side - 1)).ravel()
    quads = np.stack([corner, corner + 1, corner + side + 1, corner + side], 1)
    quads = np.concatenate([quads, side * side + np.arange(4)[None]])
    points = np.concatenate([np.stack([x, y, 0 * x], 1), np.zeros((4, 3))])
    none = np.zeros((0, len(points), 3))
    parts = np.array(["skin"] * (len(quads) - 1) + ["teeth_upper"])
    return Raw(points, points, quads, parts, points[:, :2], quads, none, none)


def test_displacements_of_points_spread_smoothly():
    raw = flat(12)
    middle = 12 * 6 + 6
    matrix = csr_matrix(([1.0], ([0], [middle])), (1, len(raw.mean)))
    found = learn.spread(raw, matrix, np.array([[0.0, 0.0, 2.0]]))
    assert np.abs(found[:, :2]).max() < 1e-12
    height = found[:, 2]
    assert height.argmax() == middle and 0.3 < height[middle] < 2
    assert height[middle] > height[middle + 2] > height[middle + 4] > 0
    assert (height[12 * 12 :] == 0).all(), "teeth are no flesh"


def test_a_smile_goes_back_as_far_as_it_may():
    """On a plane with lips in its middle: half of what they lack, smoothly, and nothing far away."""
    side = 40
    raw = flat(side)
    x, y = raw.mean[: side * side, :2].T
    far = np.hypot(x - side / 2, y - side / 2)
    order = np.argsort(far, kind="stable")
    rng = np.random.default_rng(0)
    where = np.zeros(marks.FACE, int)
    where[marks.LIPS] = order[: len(marks.LIPS)]
    others = np.setdiff1d(np.arange(marks.FACE), marks.LIPS)
    where[others] = rng.permutation(order[300:])[: len(others)]
    matrix = csr_matrix(
        (np.ones(marks.FACE), (np.arange(marks.FACE), where)), (marks.FACE, len(raw.mean))
    )
    move = parallax.smile_depth(raw, matrix, lacking(smile=(marks.LIPS, -6.0)))
    wanted = -6.0 * parallax.SMILE
    assert move[where[marks.LIPS]].mean() == pytest.approx(wanted, rel=0.25)
    assert np.abs(move[: side * side][far > 15]).max() < 0.1 * abs(wanted)
    # Smooth: no step between neighbours is as large as the whole.
    assert np.abs(np.diff(move[: side * side].reshape(side, side))).max() < 0.6 * abs(wanted)
    assert (move[side * side :] == 0).all(), "teeth do not smile"
    assert (parallax.smile_depth(raw, matrix, lacking()) == 0).all()
