"""Pieces of a file beside its skin: named by what of the built-in head they lie at, or left out."""

import numpy as np
import pytest

from bakery.heads.mesh import parts
from bakery.heads.mesh.read import Surface, pieces
from bakery.types import EXPRESSION_INDEX


@pytest.fixture(scope="module")
def whole(head):
    """The built-in head without shapes: skin, eyes, teeth, gums, tongue, and lash cards."""
    names = ("skin", "eye_socket", "mouth_cavity", "eye_left", "eye_right", "lashes", *parts.MOUTH)
    return Surface(head.mean.astype(float), head.faces).take(head.part_faces(*names))


@pytest.fixture(scope="module")
def told(whole, laid):
    return parts.tell(whole, pieces(whole.faces), 0, laid, parts.seat(laid))


def test_every_piece_is_named(head, told):
    for name in (*parts.MOUTH, "eye_left", "eye_right"):
        assert sum(map(len, told.pieces[name])) == len(head.part_faces(name)), name
    assert told.dropped > 0 and parts.has_mouth(told)  # the lashes


def test_eyes_are_placed_as_in_the_file(head, whole, told, laid):
    balls, own = parts.balls(whole, told, laid)
    assert own == 2
    for side, ball, center in zip(("left", "right"), balls, head.eye_centers(head.mean)):
        white = np.linalg.norm(head.mean[head.part_vertices("eye_" + side)] - center, axis=1)
        np.testing.assert_allclose(ball.center, center, atol=0.1)
        assert ball.radius == pytest.approx(np.median(white), abs=0.1)


def test_without_eyes_they_go_behind_the_lids(head, whole, laid):
    balls, own = parts.balls(whole, parts.Told({}, 0), laid)
    assert own == 0
    for ball, center in zip(balls, head.eye_centers(head.mean)):
        np.testing.assert_allclose(ball.center, center, atol=0.1)


def test_teeth_of_the_file_move_as_ours(head, whole, told, laid):
    jaw = EXPRESSION_INDEX["jawOpen"]
    found = list(parts.mouth_patches(whole, told, laid, parts.seat(laid)))
    for name, patch in zip(parts.MOUTH, found):
        used = head.part_vertices(name)
        wanted = head.expression_basis[jaw][used]
        assert len(patch.mean) == len(used)
        np.testing.assert_allclose(patch.expression[jaw].mean(0), wanted.mean(0), atol=0.05)
        if name.endswith("upper"):
            assert np.abs(patch.expression).max() == 0
        assert patch.uv.min() >= 0 and patch.uv.max() <= 1


def test_half_a_mouth_is_taken_from_the_built_in_head(head, whole, told, laid):
    some = {name: found for name, found in told.pieces.items() if name != "gums_lower"}
    assert not parts.has_mouth(parts.Told(some, 0))
    assert not parts.has_mouth(parts.Told({}, 0))
    upper = next(parts.mouth_patches(whole, parts.Told(some, 0), laid, parts.seat(laid)))
    np.testing.assert_array_equal(upper.mean, parts.seat(laid)[head.part_vertices("teeth_upper")])
