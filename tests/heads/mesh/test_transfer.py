"""Shapes and people carried over: known answers, for the built-in head lies on itself exactly."""

import numpy as np
import pytest

from bakery.geometry import rotation
from bakery.heads.mesh import openings, transfer
from bakery.heads.mesh.register import Laid
from bakery.heads.mesh.solve import gradient, stiffness
from bakery.types import EXPRESSION_INDEX


@pytest.fixture(scope="module")
def found(skin, laid):
    return openings.find(skin, laid)


@pytest.fixture(scope="module")
def pairs(skin, laid, found):
    contours = [openings.halves(skin.vertices, ring) for ring in found.rings]
    names = np.array(["skin", *(openings.PART[name] for name in openings.OPENINGS)])
    return transfer.pair(skin.vertices, skin.faces, names[found.inside], contours, laid)


def test_gradient_of_a_linear_function(skin):
    """On each triangle it is the part of the slope that lies in its plane."""
    slope = np.array([0.3, -2.0, 0.7])
    G, area = gradient(skin.vertices, skin.faces)
    large = area > 0.05  # mm2; slivers count as larger than they are
    mine = (G @ (skin.vertices @ slope)).reshape(-1, 3)[large]
    a, b, c = skin.vertices[skin.faces[large]].transpose(1, 0, 2)
    np.testing.assert_allclose((mine * (b - a)).sum(1), (b - a) @ slope, atol=1e-9)
    np.testing.assert_allclose((mine * (c - a)).sum(1), (c - a) @ slope, atol=1e-9)
    np.testing.assert_allclose((mine * np.cross(b - a, c - a)).sum(1), 0, atol=1e-9)


def test_stiffness_knows_constants(skin):
    K = stiffness(skin.vertices, skin.faces)
    assert abs(K @ np.ones(len(skin.vertices))).max() < 1e-9
    assert abs(K - K.T).max() < 1e-9


def test_contours_are_the_head_s_own(head, skin, numbers, laid, found):
    assert not found.sealed
    for ring, halves in zip(found.rings, openings.guide(laid)):
        own = set(np.concatenate(halves).tolist())
        assert set(numbers[ring].tolist()) == own
    part = np.array(["skin", "mouth_cavity", "eye_socket", "eye_socket"])[found.inside]
    for name in ("mouth_cavity", "eye_socket"):
        assert (part == name).sum() == len(head.part_faces(name))


def test_upper_and_lower_halves(skin, found):
    for ring in found.rings:
        upper, lower = openings.halves(skin.vertices, ring)
        assert upper[0] == lower[0] and upper[-1] == lower[-1]
        assert skin.vertices[upper[0], 0] < skin.vertices[upper[-1], 0]
        assert len(upper) + len(lower) == len(ring) + 2
        assert skin.vertices[upper, 1].mean() >= skin.vertices[lower, 1].mean()


def test_each_vertex_finds_itself(head, skin, numbers, pairs):
    away = np.linalg.norm(pairs.read(head.faces, head.mean) - skin.vertices, axis=1)
    assert (away < 1e-3).mean() > 0.99
    assert away.max() < 0.4  # slivers in the folds of the lids are passed over for what lies beside


def test_lips_find_their_own_side(head, skin, numbers, pairs):
    """The closed lips touch; what the other lip does would be 30 mm wrong."""
    jaw = head.expression_basis[EXPRESSION_INDEX["jawOpen"]]
    away = np.linalg.norm(pairs.read(head.faces, jaw) - jaw[numbers], axis=1)
    assert away.max() < 1.2  # at the corners, where upper and lower lip meet


def test_its_own_shapes_come_back(head, skin, numbers, pairs, laid):
    own = transfer.own_shapes(laid)
    shapes = transfer.shapes(skin.vertices, skin.faces, pairs, laid, own)
    for k in range(len(shapes)):
        wanted = head.expression_basis[k][numbers]
        np.testing.assert_allclose(own[k][numbers], wanted, atol=0.3)  # of up to 38; slivers again
        # Of a sliver, and of lips that touch, the neighbour's deformation may be taken: at the
        # corners of the mouth, 0.3 mm of the 34 that jawOpen moves the chin by.
        assert np.percentile(np.linalg.norm(shapes[k] - wanted, axis=1), 99) < 0.32


def test_its_own_people_come_back(head, skin, numbers, pairs, laid):
    found = transfer.people(skin.vertices, skin.faces, pairs, laid)
    wanted = head.identity_basis[:, numbers]
    off = np.linalg.norm(found - wanted, axis=2)
    assert np.sqrt((off**2).mean() / (wanted**2).sum(2).mean()) < 0.03


def test_a_larger_turned_head_moves_as_much_more_and_turned(head, skin, numbers, laid):
    turn = rotation.matrix([0.2, -0.3, 0.1])
    other = Laid(head, 1.3 * laid.vertices @ turn.T, 1.3, turn, laid.matched, laid.distance)
    own = transfer.own_shapes(other)
    for name in ("jawOpen", "mouthSmileLeft", "eyeBlinkRight", "tongueOut"):
        k = EXPRESSION_INDEX[name]
        wanted = 1.3 * head.expression_basis[k] @ turn.T
        np.testing.assert_allclose(own[k], wanted, atol=0.5)  # as above; slivers, scaled and turned
