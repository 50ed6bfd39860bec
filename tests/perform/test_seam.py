"""The seam of known pictures: through plain skin, steady in time, never through the footage's features."""

import numpy as np
import pytest

from bakery.evaluate.replacing import step_sums
from bakery.heads.file import load_head
from bakery.perform.patch import patch_of, within
from bakery.perform.seam import Seen, seam


@pytest.fixture(scope="module")
def patch():
    return patch_of(load_head("makehuman"))


def seen_of(patch, count=3):
    """Plain grey skin in all frames, wholly in sight."""
    shape = count, len(patch.vertices)
    grey = np.full((*shape, 3), 0.5, np.float32)
    none = np.zeros(shape, bool)
    return Seen(grey, grey.copy(), ~none, np.zeros(shape, np.float32), none)


def test_polygons():
    ring = np.array([[0, 0], [4, 0], [4, 2], [0, 2]], float)
    points = np.array([[1, 1], [5, 1], [1, 3], [3.9, 1.9]], float)
    assert within(points, ring).tolist() == [True, False, False, True]


def test_the_face_is_inside_and_its_rim_outside(patch):
    labels = seam(patch, seen_of(patch))
    assert labels[:, patch.inner].all() and not labels[:, patch.outer].any()
    assert patch.own[patch.inner].min() == 1 and patch.own[patch.outer].max() == 0


def test_the_seam_goes_where_both_pictures_agree(patch):
    """One half of the rim differs in a ring near the face: there the seam runs outside of it."""
    seen, own = seen_of(patch), patch.own[:, 0]
    apart = ~patch.inner & ~patch.outer & (own > 0.4)
    seen.target[:, apart] = 0.9
    labels = seam(patch, seen)
    assert labels[:, apart].mean() > 0.97


def test_it_does_not_jump_for_one_frame(patch):
    seen, own = seen_of(patch, 5), patch.own[:, 0]
    rng = np.random.default_rng(0)
    still = 0.5 + 0.1 * rng.random((len(own), 3), np.float32)
    seen.source[:] = seen.target[:] = still
    seen.target[2] += 0.01 * rng.random((len(own), 3), np.float32)
    labels = seam(patch, seen)
    assert (labels[2] != labels[1]).sum() <= 5


def test_features_of_the_footage_are_covered_and_what_is_out_of_sight_is_not(patch):
    seen, rim = seen_of(patch), np.flatnonzero(~patch.inner & ~patch.outer)
    seen.feature[:, rim[:50]] = True
    seen.sight[:, rim[50:100]] = False
    labels = seam(patch, seen)
    assert labels[:, rim[:50]].all() and not labels[:, rim[50:100]].any()


def test_a_step_across_the_seam_is_told():
    source = np.zeros((40, 40, 3))
    source[..., 0] = np.arange(40) / 400
    share = np.clip((np.arange(40) - 15) / 10, 0, 1)[None].repeat(40, 0)
    made = source + 0.2 * share[..., None] * [1, 0, 0]
    before, after = step_sums(source, made, share, 6)
    assert after / before == pytest.approx((12 / 400 + 0.2) / (12 / 400), rel=0.02)
    assert step_sums(source, source, share, 6)[0] == pytest.approx(before)
