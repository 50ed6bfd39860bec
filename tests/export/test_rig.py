"""Bones of a head alone, and normals of shapes, by their numbers."""

from dataclasses import replace

import numpy as np
import pytest

from bakery.export.glb_data import UNBENT
from bakery.export.lod import coarser, head_surfaces
from bakery.export.rig import Rig
from bakery.export.skeleton import BONES, head_joints, head_weights, jaw_hinge
from bakery.geometry.mesh import vertex_normals
from bakery.types import EXPRESSIONS


@pytest.fixture(scope="module")
def pieces(head):
    return {piece.name: piece for piece in head_surfaces(head, head.mean)}


def test_every_vertex_is_carried_whole_by_four_bones_at_most(head, pieces):
    rig = Rig(head_joints(head, head.mean), BONES, lambda one: head_weights(head, head.mean, one))
    for piece in pieces.values():
        joints, weights = rig.weights(piece)
        assert joints.shape == weights.shape == (len(piece.vertices), 4)
        assert joints.dtype == np.uint8 and joints.max() < len(BONES)
        np.testing.assert_allclose(weights.sum(1), 1, atol=1e-6)
        assert not joints[weights == 0].any()  # glTF wants 0 there
    joints, weights = rig.weights(pieces["eyes"])
    left = pieces["eyes"].vertices[:, 0] > 0
    assert (weights[:, 0] == 1).all() and (np.array(BONES)[joints[left, 0]] == "leftEye").all()


def test_bones_stand_in_the_middle_and_eyes_where_they_turn(head):
    bones = {bone.name: bone for bone in head_joints(head, head.mean)}
    assert tuple(bones) == BONES
    assert [bones[name].place[0] for name in BONES[:4]] == [0] * 4
    eyes = np.array([bones[name].place for name in BONES[4:]]) * 1000
    np.testing.assert_allclose(eyes, head.eye_centers(head.mean), atol=1e-4)
    assert all(bones[name].parent == "head" for name in BONES[3:])


def test_the_hinge_of_a_jaw_that_turns_about_a_known_axis(head):
    turn, hinge = np.radians(15), np.array([0.0, -40.0, -60.0])
    c, s = np.cos(turn), np.sin(turn)
    rotated = (head.mean - hinge) @ np.array([[1, 0, 0], [0, c, -s], [0, s, c]]).T + hinge
    basis = np.zeros_like(head.expression_basis)
    basis[EXPRESSIONS.index("jawOpen")] = rotated - head.mean
    found, angle = jaw_hinge(replace(head, expression_basis=basis), head.mean)
    np.testing.assert_allclose(found, hinge, atol=0.01)
    assert angle == pytest.approx(turn, abs=1e-5)
    still, _ = jaw_hinge(replace(head, expression_basis=np.zeros_like(basis)), head.mean)
    assert -80 < still[1] < -20 and -80 < still[2] < -30  # below the ears


def test_normals_of_shapes_are_those_of_the_shaped_surface(pieces):
    """As the file keeps them, 3 degrees off on average at most; by place, for the atlas cuts it."""
    for piece in pieces.values():
        _, first, place = np.unique(piece.vertices, axis=0, return_index=True, return_inverse=True)
        place, worst = place.ravel(), 0
        for shape, bend in zip(piece.shapes, piece.bends):
            moved = np.linalg.norm(shape, axis=1) > 0.05
            if not moved.any():
                continue
            wanted = vertex_normals((piece.vertices + shape)[first], place[piece.faces])[place]
            kept = np.where(np.linalg.norm(bend, axis=1, keepdims=True) > UNBENT, bend, 0)
            found = piece.normals + kept
            found /= np.linalg.norm(found, axis=1, keepdims=True)
            angles = np.degrees(np.arccos(np.clip((found * wanted).sum(1), -1, 1)))
            worst = max(worst, angles[moved].mean())
        assert worst < 3, piece.name


def test_coarser_levels_stand_on_the_first_vertices(pieces):
    levels = coarser(pieces["skin"], (1.0, 0.5, 0.2, 0.05))
    for finer, level in zip(levels, levels[1:]):
        count = len(level.vertices)
        assert count < 0.75 * len(finer.vertices)
        assert len(np.unique(level.faces)) > 0.75 * count  # others serve coarser levels
        for name in ("vertices", "normals", "uv"):
            np.testing.assert_array_equal(getattr(level, name), getattr(finer, name)[:count])
        np.testing.assert_array_equal(level.shapes, finer.shapes[:, :count])
