"""The resting shape: what a smile is known to leave is learned, mirrored, and left out fairly."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from bakery import landmarks as marks
from bakery.geometry import rotation
from bakery.heads.base import weights
from bakery.heads.file import load_head
from bakery.stages.fit.rest import load_rest_shape, presence, rest_moves
from bakery.train import rest_shape as training
from bakery.types import Camera, Fit

OPTIONS = replace(training.DEFAULTS, ridge=1e-3, modes=4)


@pytest.fixture(scope="module")
def head():
    return load_head("makehuman")


def left_over(head, share, side):
    """What a smile leaves in the warp: its corner 2 mm higher a unit of weight, smooth around it."""
    places = head.landmarks(head.mean)[: marks.FACE]
    corner = marks.MOUTH_CORNERS[side]
    near = np.exp(-((places - places[corner]) ** 2).sum(1) / 15**2)
    return 2 * share * (near * training.moving(head))[:, None] * [0, 1, 0]


def person(head, rng, left, right):
    """The fits of a resting and a smiling photo of one head."""
    camera = Camera(900.0, np.zeros(2), np.zeros(3), np.array([0, 0, -700.0]), 64, 64)
    identity = rng.normal(size=20)
    at_rest = Fit(
        head.name, camera, identity, np.zeros(52), np.zeros(2), np.zeros((9, 3)), np.zeros(1),
        np.zeros((marks.FACE, 3)), np.zeros((478, 2)),
    )  # fmt: skip
    smile = weights({"mouthSmileLeft": left, "mouthSmileRight": right})
    residual = left_over(head, right, 0) + left_over(head, left, 1)
    return at_rest, replace(at_rest, expression=smile, residual=residual)


@pytest.fixture(scope="module")
def known(head):
    rng = np.random.default_rng(0)
    shares = [(0.9, 0.95), (1.0, 0.9), (0.9, 0.9), (0.95, 0.85), (0.9, 1.0)]
    return training.pairs([person(head, rng, *share) for share in shares], head)


def test_a_known_left_over_is_learned(head, known):
    basis = training.learn(known, head, OPTIONS)
    _, smiling = person(head, np.random.default_rng(9), 0.97, 0.88)
    assert presence(head, smiling.expression) > 0.99
    moves = rest_moves(basis, smiling.expression, smiling.residual)
    # The warp of 20 mm does not carry its landmarks to the last hundredth.
    assert_allclose(moves, -smiling.residual, atol=0.1)
    found = training.left_out_error(known, head, OPTIONS)
    assert found["people"] == 5
    before, after = found["corners"]
    assert before > 1 and after < 0.1 * before
    assert found["resting_lips_moved"] == 0


def test_each_person_counts_mirrored_too(head, known):
    other = marks.mirror_landmarks(head.landmarks(head.mean))
    assert_array_equal(other[other], np.arange(marks.FACE))
    assert_array_equal(other[marks.MOUTH_CORNERS], marks.MOUTH_CORNERS[::-1])
    for part in (known.change, known.residual):
        assert_allclose(part[1::2], part[::2][:, other] * [-1, 1, 1], atol=1e-9)
    smiles = known.expression[1::2].sum(1)
    assert_allclose(smiles, known.expression[::2].sum(1))


def test_a_resting_mouth_is_the_aim_as_its_photo_shows_it(head):
    """A mouth that is wide at rest is so in the photo by an expression."""
    still, smiling = person(head, np.random.default_rng(4), 0.9, 0.9)
    wide = replace(still, expression=weights({"mouthDimpleLeft": 0.1, "mouthDimpleRight": 0.1}))
    (plain, _), (rested, _) = (
        training.pairs([(rest, smiling)], head).change for rest in (still, wide)
    )
    right, left = marks.MOUTH_CORNERS
    assert (rested - plain)[left, 0] > 0.1 and (rested - plain)[right, 0] < -0.1
    assert presence(head, wide.expression) == 0


def test_people_without_pairs_count_by_their_means(head, known):
    """Their mean smile comes to their mean rest, and pairs stay about as they are."""
    rng = np.random.default_rng(5)
    smiles = [person(head, rng, *share)[1] for share in ((0.9, 1.0), (1.0, 0.9))]
    stern = weights({"mouthPressLeft": 0.1, "mouthPressRight": 0.1})
    rests = [replace(person(head, rng, 0, 0)[0], expression=stern) for _ in range(2)]
    shape = np.zeros(20)  # one head, so that means of two are means of all
    found = [replace(fit, identity=shape) for fit in smiles + rests]
    others = training.means(found, head)
    other = marks.mirror_landmarks(head.landmarks(head.mean))
    assert_allclose(others.change[other] * [-1, 1, 1], others.change, atol=1e-9)
    assert np.abs(others.change[marks.LIPS]).max() > 0.5
    heavy = replace(OPTIONS, means=1e4, modes=8)
    basis = training.learn(known, head, heavy, others)
    moves = rest_moves(basis, others.expression, others.residual)
    assert_allclose(moves, others.change, atol=0.1)
    without = training.learn(known, head, heavy)
    moves = rest_moves(without, others.expression, others.residual)
    assert np.abs(moves - others.change).max() > 0.2


def test_which_lips_are_about_closed(head):
    points = np.zeros((478, 2))
    points[training.IRISES] = (-50, 0), (50, 0)
    points[training.SEAM] = (0, 100), (0, 101)
    points[marks.MOUTH_CORNERS] = (-40, 98), (40, 98)
    assert training._about_closed(points)
    for at, moved in ((training.SEAM[1], (0, 103)), (marks.MOUTH_CORNERS, (0, 92))):
        other = points.copy()
        other[at, 1] = moved[1]
        assert not training._about_closed(other)
    # The same of a head that is tilted.
    turn = np.array([[0.8, 0.6], [-0.6, 0.8]])
    assert training._about_closed(points @ turn)


def test_how_a_head_is_held_does_not_count(head):
    """A pair whose resting head lies elsewhere leaves nothing."""
    points = head.landmarks(head.mean)[: marks.FACE].astype(float)
    turn = rotation.matrix(np.array([0.05, -0.1, 0.02]))
    by = training.still(head)
    assert not by[marks.LIPS].any() and not by[marks.OVAL].any() and by.sum() > 100
    assert_allclose(training.aligned(points @ turn.T + [3, -2, 5], points, by), points, atol=1e-9)
    # and a mouth that moved does not draw the rest along
    moved = points.copy()
    moved[marks.LIPS, 1] += 5
    assert_allclose(training.aligned(moved, points, by), moved, atol=1e-9)


def test_files_come_back(head, known, tmp_path):
    basis = training.learn(known, head, OPTIONS)
    path = tmp_path / "shape.safetensors"
    training.save(basis, path)
    again = load_rest_shape(path)
    for name in ("modes", "by_residual"):
        assert_allclose(getattr(again, name), getattr(basis, name), atol=2e-3)
    assert_array_equal(again.response, basis.response)
    card = training.model_card(basis, {}, path, "abc")
    assert card["modes"] == len(basis.modes) and len(card["sha256"]) == 64
