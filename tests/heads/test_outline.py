"""The basis of what landmarks do not see of a head."""

import numpy as np
import pytest

from bakery.geometry import mesh
from bakery.heads.base import PARTS
from bakery.heads.outline import JAW_CORNER, NAMES, outline_basis, outline_offsets
from bakery.heads.scalp import ear_box, unrolled
from bakery.landmarks import FACE
from bakery.stages.fit.outline import population
from bakery.stages.fit.warp import folded


def people(head, count, seed=0):
    """Random outlines within the bounds."""
    mean, covariance, low, high = population(head)
    drawn = np.random.default_rng(seed).multivariate_normal(mean, covariance, count)
    return np.clip(drawn, low, high)


def test_zero_changes_nothing(head):
    for none in (np.zeros(0), np.zeros(3), np.zeros(len(NAMES))):
        assert not outline_offsets(head, none).any()


def test_nothing_moves_inside_the_face(head):
    for outline in people(head, 4):
        moved = outline_offsets(head, outline)
        assert not moved[head.landmark_vertices[:FACE]].any()
        others = head.part_vertices(*(part for part in PARTS if part != "skin"))
        skin = head.part_vertices("skin")
        assert not moved[np.setdiff1d(others, skin)].any()
        front = skin[(head.mean[skin, 2] > 0) & (np.abs(head.mean[skin, 1] + 20) < 65)]
        assert np.abs(moved[front]).max() < 0.5  # above the forehead the skull begins
        assert np.abs(moved).max() > 5


def test_a_thick_neck_has_no_crease_below_the_jaw(head):
    """Neighbouring faces there met at up to 47 degrees, 20 on the mean head: the jaw's corner jutted out."""
    faces = head.faces[head.part_faces("skin")]
    jaw = head.landmarks(head.mean)[list(JAW_CORNER), 1].mean()
    middle = head.mean[faces].mean(1)
    near = (np.abs(middle[:, 1] - jaw + 10) < 30) & (np.abs(middle[:, 0]) > 35)
    faces = faces[near & (outline_basis(head).ear[faces].max(1) < 0.1)]
    sides = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), 1)
    order = np.lexsort(sides.T)
    same = (sides[order][1:] == sides[order][:-1]).all(1)
    pairs = np.stack([order[1:][same], order[:-1][same]], 1) // 3
    outline = np.where(np.array(NAMES) == "neck_width", 20.0, 0.0)
    normals = mesh.face_normals(head.mean + outline_offsets(head, outline), faces)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    assert (normals[pairs[:, 0]] * normals[pairs[:, 1]]).sum(1).min() > np.cos(np.radians(32))


def swapped(name):
    """The name of the same field of the other side."""
    stem, _, side = name.rpartition("_")
    return f"{stem}_{dict(left='right', right='left')[side]}" if side in ("left", "right") else name


def test_left_and_right_are_alike(head):
    fields = dict(zip(NAMES, outline_basis(head).fields))
    places = head.mean[outline_basis(head).rows]
    for name in NAMES:
        other = fields[swapped(name)]
        here = np.flatnonzero(np.abs(fields[name]).max(1) > 0.2)[::40]
        square = ((places[here][:, None] * [-1, 1, 1] - places[None]) ** 2).sum(-1)
        assert square.min(1).max() < 0.01
        mirrored = other[square.argmin(1)] * [-1, 1, 1]
        assert np.abs(fields[name][here] - mirrored).max() < 0.05, name


@pytest.mark.parametrize(
    ("name", "axis", "way"),
    [
        ("skull_width", 0, 1), ("crown_width", 0, 1), ("skull_height", 1, 1), ("skull_depth", 2, -1),
        ("jaw_width", 0, 1), ("neck_width", 0, 1), ("neck_taper", 0, 1), ("shoulder_drop", 1, -1),
        ("shoulder_width", 0, 1), ("ear_out_left", 0, 1), ("ear_drop_left", 1, -1),
        ("ear_lobe_left", 1, -1),
    ],
)  # fmt: skip
def test_a_unit_is_a_millimetre_that_way(head, name, axis, way):
    basis = outline_basis(head)
    left = head.mean[basis.rows, 0] > 0
    field = way * basis.fields[NAMES.index(name)][left][:, axis]
    assert 0.6 < field.max() < 1.4
    assert field.min() > -0.05


def test_an_ear_grows_in_height_by_what_is_said(head):
    places = head.mean + outline_offsets(head, np.eye(len(NAMES))[NAMES.index("ear_size_left")] * 8)
    ear = (outline_basis(head).ear > 0.5) & (head.mean[:, 0] > 0)
    before, after = np.ptp(head.mean[ear, 1]), np.ptp(places[ear, 1])
    assert after - before == pytest.approx(8, abs=1.5)
    assert np.ptp(places[ear, 2]) > np.ptp(head.mean[ear, 2]) + 2


def test_the_skull_carries_an_ear_rigidly(head):
    moved = outline_offsets(head, np.eye(len(NAMES))[NAMES.index("skull_width")] * 5)
    faces = head.faces[head.part_faces("skin")]
    links = mesh.edges(faces[(outline_basis(head).ear[faces] > 0.9).all(1)])

    def lengths(shape):
        return np.linalg.norm(shape[links[:, 0]] - shape[links[:, 1]], axis=1)

    stretch = lengths(head.mean + moved) / lengths(head.mean)
    assert np.abs(stretch - 1).max() < 0.15  # where the ear goes over into the face, which stays


def test_no_skin_folds(head):
    faces = head.faces[head.part_faces("skin")]
    for outline in people(head, 12):
        bad = folded(head.mean + outline_offsets(head, outline), faces, head.mean)
        # The groove between ear and skull, and slivers within the ear, may turn unseen.
        assert len(bad) < 25, outline
        flat = unrolled(head)(head.mean[faces[bad]].mean(1)) if len(bad) else np.zeros((0, 2))
        front, behind, low, high = ear_box(head)
        assert (flat[:, 0] > front - 12).all() and (flat[:, 0] < behind + 12).all()
        assert (flat[:, 1] > low - 25).all() and (flat[:, 1] < high + 12).all()


def test_a_head_without_ears_has_no_fields_for_them(head):
    from dataclasses import replace

    from bakery.heads.outline import _membrane

    skin = head.part_vertices("skin")
    bare = head.mean.copy()
    bare[skin] = _membrane(head, skin, head.mean[skin].astype(np.float64))[0]
    basis = outline_basis(replace(head, mean=bare.astype(np.float32)))
    for name, field in zip(NAMES, basis.fields):
        assert np.isfinite(field).all()
        if name.startswith("ear_"):
            assert np.abs(field).max() < 1e-6, name
