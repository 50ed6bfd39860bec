"""Where hair may grow on the atlas of a head."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from bakery.heads.scalp import BACK, RADIUS, ear_box, ear_depth, nape_line, scalp, unrolled
from bakery.landmarks import FACE
from bakery.stages.atlas import make_atlas
from bakery.stages.texture.growth import (
    BALD,
    COARSE,
    OVAL_EAR,
    above_nape,
    bald_around,
    beside_scalp,
    on_ears,
)


def test_scalp_leaves_face_and_ears_bare_and_is_even(head):
    share = scalp(head)
    assert share.min() >= 0 and share.max() == 1
    marks = np.einsum(
        "lk,lk->l", share[head.faces[head.landmark_faces]], head.landmark_barycentric
    )[:FACE]
    temples = np.abs(head.landmarks(head.mean)[:FACE, 0]) > 45  # mm
    assert marks[~temples].max() < 0.2, "hair on the face"
    skin = head.part_vertices("skin")
    top = skin[head.mean[skin, 1].argmax()]
    widest = skin[np.abs(head.mean[skin][:, 0]).argmax()]
    assert share[top] == 1
    if abs(head.mean[widest, 1]) < 60:  # the tip of an ear, unless the shoulders are wider
        assert share[widest] == 0
    for sign in (1, -1):  # both sides alike: the same share of each half
        half = share[skin[sign * head.mean[skin, 0] > 1]]
        assert half.mean() == pytest.approx(share[skin].mean(), rel=0.03)


def test_ears_that_hardly_stand_out_have_the_usual_place(head):
    """Of ears close to a broad skull the tips alone stand out: hair would grow down to those."""
    flat, skin = head.mean.copy(), head.mean[head.part_vertices("skin")]
    beside = skin[(skin[:, 1] > -70) & (skin[:, 1] < 40), 0].max()
    broad = flat[:, 1] > 15
    flat[broad, 0] *= (beside - 6) / flat[broad, 0].max()
    close = replace(head, name="close", mean=flat)
    assert_allclose(ear_box(close), ear_box(head), atol=1)
    assert np.abs(scalp(close) - scalp(head)).mean() < 0.01


def test_hair_gets_less_down_to_the_nape(head):
    atlas = make_atlas(head, 256).take("skin")
    share, flat = above_nape(head, atlas), unrolled(head)(atlas.at(head.mean))
    _, behind, low, high = ear_box(head)
    back = np.abs(flat[:, 0] - np.pi * RADIUS) < 10
    above = flat[:, 1] - nape_line(head, flat[:, 0])
    assert share[back & (above > 20)].min() > 0.99 and share[back & (above < -16)].max() < 0.01
    order = np.argsort(above[back])
    assert (np.diff(share[back][order]) > -0.02).all()
    assert share[flat[:, 0] < behind].min() > 0.99, "before the ears, and on them"
    assert abs(nape_line(head, np.array([BACK]))[0] - (low - 18)) < 1e-6


def test_the_strip_beside_hair_stays_at_the_hairline():
    growth = np.zeros((250, 250), np.float32)
    growth[:100] = 1.0
    near = beside_scalp(growth)[:, 125]
    assert near[:100].min() > 0.9 and near[110:].max() < 0.1
    assert (np.diff(near) <= 1e-6).all(), "it ends softly"


def test_hair_grows_up_to_where_an_ear_stands_out(head):
    """Skin between an ear's root and the hairline is no flap of skin in the hair; its hollow stays bare."""
    atlas = make_atlas(head, 512).take("skin")
    flat, (front, behind, low, high) = unrolled(head)(atlas.at(head.mean)), ear_box(head)
    ears = on_ears(head, atlas) > 0
    oval = ear_depth(flat, (front, behind, low, high), OVAL_EAR) < 1
    assert not (ears & ~oval).any()
    out = np.where(oval, np.abs(atlas.at(head.mean)[:, 0]), 0)
    assert ears[out > out.max() - 2].all(), "the tip"
    middle = (np.abs(flat[:, 1] - (low + 0.4 * (high - low))) < 3) & (flat[:, 0] > front + 4)
    assert ears[middle & (flat[:, 0] < behind - 4)].all(), "the hollow of the shell"
    root = oval & (flat[:, 1] > high) & (flat[:, 0] < (front + behind) / 2)
    assert root.sum() > 20 and ears[root].mean() < 0.2


def test_scalp_that_is_bare_wide_enough_is_bald():
    size = 4 * COARSE
    wide, narrow = int(1.5 * size / BALD), int(0.8 * size / BALD)
    bare = np.zeros((size, size), np.float32)
    bare[size // 4 : size // 4 + wide] = 1
    found = bald_around(bare)
    middle = size // 4 + wide // 2
    assert found.shape == bare.shape and found[middle, size // 2] > 0.9
    assert found[size // 4, size // 2] == pytest.approx(0.5, abs=0.1)
    assert found[-size // 4 :].max() < 0.01
    strip = np.zeros_like(bare)
    strip[size // 4 : size // 4 + narrow] = 1
    assert bald_around(strip).max() < 1e-3
