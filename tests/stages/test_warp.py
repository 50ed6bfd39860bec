import numpy as np
import pytest

from bakery import landmarks as marks
from bakery.geometry import mesh
from bakery.heads.file import load_head
from bakery.stages.fit import warp


@pytest.fixture(scope="module")
def head():
    return load_head("makehuman")


def moved_landmarks(head, residual):
    offsets = warp.residual_offsets(head, residual)
    return (head.landmarks(head.mean + offsets) - head.landmarks(head.mean))[: marks.FACE]


def smooth_field(head):
    x, y, z = head.landmarks(head.mean)[: marks.FACE].T
    return np.stack([np.sin(y / 40), np.cos(x / 50), np.sin(x / 60 + z / 50)], 1) * 2.0


def test_nothing_asked_nothing_moves(head):
    assert not warp.residual_offsets(head, np.zeros((marks.FACE, 3))).any()


def test_landmarks_move_as_asked(head):
    asked = smooth_field(head)
    miss = np.linalg.norm(moved_landmarks(head, asked) - asked, axis=1)
    assert miss.mean() < 0.05 and miss.max() < 0.5  # mm


def test_far_from_the_face_nothing_moves(head):
    offsets = warp.residual_offsets(head, smooth_field(head))
    behind = head.mean[:, 2] < -110
    assert behind.any() and np.abs(offsets[behind]).max() < 0.2  # of 2 mm


def test_lips_and_lids_stay_apart(head):
    """What moves one lip (lid) must hardly move the other: the middle of the other moves < 20%."""
    for one, other in (
        (marks.LIPS_INNER_LOWER, marks.LIPS_INNER_UPPER),
        (marks.LID_LEFT_LOWER, marks.LID_LEFT_UPPER),
    ):
        asked = np.zeros((marks.FACE, 3))
        near = np.zeros(marks.FACE)
        near[one[2:-2]] = 1
        asked[:, 1] = -2 * near
        sure = np.ones(marks.FACE)
        smooth = warp.smooth_residual(head, asked, sure)
        moved = moved_landmarks(head, smooth)[:, 1]
        assert moved[one[len(one) // 2]] < -1.2
        assert abs(moved[other[len(other) // 2]]) < 0.4


def test_hard_parts_move_rigidly(head):
    offsets = warp.residual_offsets(head, smooth_field(head))
    for part in ("teeth_upper", "teeth_lower", "eye_left", "eye_right"):
        rows = head.part_vertices(part)
        if len(rows):
            assert np.ptp(offsets[rows], axis=0).max() < 1e-4, part


def test_mouth_proxy_hangs_on_the_lips(head):
    faces = head.faces[head.part_faces("mouth_sheet")]
    rim = np.unique(np.concatenate(mesh.boundary_loops(faces)))
    asked = smooth_field(head)
    offsets = warp.residual_offsets(head, asked)
    lips = np.setdiff1d(head.part_vertices("skin", "mouth_cavity"), rim)
    gap = np.linalg.norm(head.mean[rim][:, None] - head.mean[lips][None], axis=2)
    touching = gap.min(1) < 1e-3
    difference = offsets[rim[touching]] - offsets[lips[gap[touching].argmin(1)]]
    assert np.abs(difference).max(initial=0) < 0.05
    inside = np.setdiff1d(np.unique(faces), rim)
    low, high = offsets[rim].min(0) - 1e-4, offsets[rim].max(0) + 1e-4
    assert ((offsets[inside] >= low) & (offsets[inside] <= high)).all()  # harmonic: no extremes


def test_low_confidence_follows_the_neighbours(head):
    asked = np.zeros((marks.FACE, 3))
    asked[4] = [0, 8, 0]  # an outlier at the tip of the nose
    sure = np.ones(marks.FACE)
    trusted = warp.smooth_residual(head, asked, sure)[4, 1]
    sure[4] = 0.02
    assert warp.smooth_residual(head, asked, sure)[4, 1] < 0.1 < trusted


def test_folds_are_found_and_mended(head):
    weights = warp.warp_weights(head)
    before = head.mean[weights.skin]
    assert not len(warp.folded(before, weights.faces, before))
    asked = np.zeros((marks.FACE, 3))
    asked[marks.LIPS_OUTER_UPPER] = [0, -14, 0]  # pull the upper lip through the lower one
    asked[61] = asked[185] = [20, 0, 0]
    sure = np.ones(marks.FACE)
    rough = warp.smooth_residual(head, asked, sure)
    after = before + (weights.skin_matrix @ rough.astype(np.float32))
    assert len(warp.folded(after, weights.faces, before))
    mended = warp.unfolded_residual(head, head.mean, asked, sure, rounds=12)
    after = before + (weights.skin_matrix @ mended.astype(np.float32))
    assert len(warp.folded(after, weights.faces, before)) < 5


def test_same_input_same_bytes(head):
    field = smooth_field(head)
    assert (warp.residual_offsets(head, field) == warp.residual_offsets(head, field)).all()


@pytest.mark.parametrize("precision", [np.float32, np.float64])
def test_the_covariance_is_the_sum_of_two_matern_kernels(precision):
    """More points than are worked out together, to the bit the formula of Matern 3/2."""
    rng = np.random.default_rng(0)
    count = 2 * warp.ROWS + 3
    points, other = (rng.normal(0, 20, (n, 3)).astype(precision) for n in (count, 9))
    square = (points**2).sum(1)[:, None] + (other**2).sum(1)[None] - 2 * points @ other.T
    off = np.sqrt(np.maximum(square, 0))
    wide, fine = ((1 + r) * np.exp(-r) for r in (off * (3**0.5 / s) for s in (22.0, 7.0)))
    np.testing.assert_array_equal(warp.kernel(points, other), 0.85 * wide + 0.15 * fine)
    # A square of one product less another: to the last bits, which differ by processor.
    alone = warp.kernel(points[:1], points[:1])[0, 0]
    np.testing.assert_allclose(alone, 1, rtol=1e-12 if precision == np.float64 else 1e-6)
