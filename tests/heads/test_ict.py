"""ICT-FaceKit from its numbers and from a folder of OBJ files."""

import numpy as np
import pytest

from bakery.errors import InputError
from bakery.heads import ict
from bakery.heads.base import PARTS
from bakery.heads.outline import NAMES, outline_basis, outline_offsets
from bakery.types import EXPRESSION_INDEX


@pytest.fixture(scope="module")
def head(shared):
    return ict.build(ict.read(shared / "heads" / "ict_facekit_light.npz"))


def test_it_is_a_whole_head_in_millimetres(head):
    assert len(head.identity_basis) == 100
    np.testing.assert_allclose(head.eye_centers(head.mean).sum(0), 0, atol=0.01)
    assert 60 < head.eye_centers(head.mean)[0, 0] * 2 < 66
    missing = {name for k, name in enumerate(PARTS) if not (head.face_part == k).any()}
    assert missing == set()


def test_upper_teeth_stay(head):
    jaw = head.expression_basis[EXPRESSION_INDEX["jawOpen"]]
    assert np.abs(jaw[head.part_vertices("teeth_upper", "gums_upper")]).max() < 0.05
    assert jaw[head.part_vertices("teeth_lower")][:, 1].mean() < -10


def test_stray_noise_is_gone(head):
    smile = head.expression_basis[EXPRESSION_INDEX["mouthSmileRight"]]
    assert np.abs(smile[head.part_vertices("gums_upper", "tongue", "teeth_lower")]).max() == 0


def test_landmarks_are_on_their_sides(head):
    points = head.landmarks(head.mean)
    assert points[33, 0] < points[133, 0] < 0 < points[362, 0] < points[263, 0]
    move = head.expression_basis[EXPRESSION_INDEX["jawOpen"]]
    opened = head.landmarks(head.mean + move) - points
    assert opened[14, 1] < opened[13, 1] - 10


def test_the_outline_lies_on_the_jaw_not_on_the_throat(head):
    """Along the jaw each point is nearer to the camera than the one before it, to the chin."""
    jaw = head.landmarks(head.mean)[[58, 172, 136, 150, 149, 176, 148, 152]]
    assert (np.diff(jaw[:, 2]) > 0).all()
    assert jaw[0, 2] > -45


def test_a_wrong_folder_says_so(tmp_path):
    with pytest.raises(InputError, match="generic_neutral_mesh.obj"):
        ict.read(tmp_path)
    (tmp_path / "generic_neutral_mesh.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1/1 2/1 3/1\n")
    with pytest.raises(InputError, match="identity"):
        ict.read(tmp_path)
    (tmp_path / "identity000.obj").write_text("v 0 0 0\nv 1 0 0\n")
    with pytest.raises(InputError, match="2 vertices"):
        ict.read(tmp_path)
    (tmp_path / "identity000.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\n")
    with pytest.raises(InputError, match="26719"):
        ict.read(tmp_path)
    (tmp_path / "x.npz").write_bytes(b"no")
    with pytest.raises(InputError, match="not a file of ICT"):
        ict.read(tmp_path / "x.npz")


def test_its_ears_and_neck_can_be_fitted(head):
    basis = outline_basis(head)
    ears = head.mean[basis.ear > 0.5]
    assert 50 < np.ptp(ears[:, 1]) < 75 and np.abs(ears[:, 0]).min() > 50
    moved = outline_offsets(head, np.full(len(NAMES), 5.0))
    assert not moved[head.landmark_vertices[:468]].any()
    assert np.abs(moved).max() > 5
