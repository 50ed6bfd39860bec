"""The tongue leaves an open mouth free, and comes out between lips and teeth."""

import numpy as np
import pytest

from bakery.geometry.raster import rasterize
from bakery.heads.base import PARTS, weights
from bakery.stages.texture.tongue import CLEAR, MIDDLE, keep_in, seat_tongue

INSIDE = (
    "skin", "mouth_cavity", "teeth_upper", "teeth_lower", "gums_upper", "gums_lower", "tongue",
)  # fmt: skip


def person(head, seed):
    neutral = head.neutral(0.7 * np.random.default_rng(seed).normal(size=len(head.identity_basis)))
    return neutral, seat_tongue(head, neutral)


def seen(head, neutral, mix):
    """How many pixels each part takes between the lips, from the front, five a millimetre."""
    shape = head.vertices(neutral, weights(mix)).astype(float)
    middle = neutral[head.part_vertices("mouth_sheet")].mean(0)
    pixels = (shape - middle)[:, :2] * [5, -5] + [200, 150]
    faces = head.part_faces(*INSIDE)
    found = rasterize(pixels, 600 - shape[:, 2], head.faces[faces], (450, 400), cull=True)
    part = head.face_part[faces[np.maximum(found.face, 0)]]
    part = np.where(found.face >= 0, part, 255)
    return {name: int((part == PARTS.index(name)).sum()) for name in INSIDE}


@pytest.mark.parametrize("seed", range(4))
def test_an_open_mouth_has_a_throat(head, seed):
    """It was a flat panel: the tongue alone, up to the upper teeth, in every mouth."""
    neutral, own = person(head, seed)
    before, after = (seen(one, neutral, {"jawOpen": 1.0}) for one in (head, own))
    assert after["mouth_cavity"] > 0.15 * (after["tongue"] + after["mouth_cavity"])
    assert after["mouth_cavity"] > 2 * before["mouth_cavity"]
    assert after["tongue"] > 0.3 * before["tongue"]  # it is seen, lying below


@pytest.mark.parametrize("jaw", [0.0, 0.4])
@pytest.mark.parametrize("seed", range(4))
def test_a_tongue_comes_out_over_the_lower_lip(head, seed, jaw):
    neutral, own = person(head, seed)
    out = seen(own, neutral, {"tongueOut": 1.0, "jawOpen": jaw})
    assert out["tongue"] > 25 * 40  # 40 square millimetres
    shape = own.vertices(neutral, weights({"tongueOut": 1.0, "jawOpen": jaw}))
    tongue, sheet = (shape[own.part_vertices(name)] for name in ("tongue", "mouth_sheet"))
    assert tongue[:, 2].max() > np.median(sheet[:, 2]) + 5


@pytest.mark.parametrize("seed", range(4))
def test_it_passes_below_the_upper_incisors(head, seed):
    neutral, own = person(head, seed)
    shape = own.vertices(neutral, weights({"tongueOut": 1.0}))
    teeth, tongue = (shape[own.part_vertices(name)] for name in ("teeth_upper", "tongue"))
    middle = np.median(teeth[:, 0])
    teeth = teeth[np.abs(teeth[:, 0] - middle) < MIDDLE]
    edge = teeth[teeth[:, 1].argmin()]
    near = (np.abs(tongue[:, 2] - edge[2]) < 2) & (np.abs(tongue[:, 0] - middle) < MIDDLE)
    assert (tongue[near, 1] < edge[1] - CLEAR / 2).all()


def test_nothing_else_changes(head):
    """But for the tongue under jawOpen and everything under tongueOut, the head stays as it is."""
    before = head.expression_basis.copy()
    _, own = person(head, 0)
    np.testing.assert_array_equal(head.expression_basis, before)
    changed = np.abs(own.expression_basis - before).max(-1) > 0  # [E, V]
    shapes = np.flatnonzero(changed.any(1))
    assert sorted(shapes) == sorted(np.flatnonzero(weights({"jawOpen": 1, "tongueOut": 1})))
    jaw = int(np.flatnonzero(weights({"jawOpen": 1}))[0])
    assert np.isin(np.flatnonzero(changed[jaw]), head.part_vertices("tongue")).all()


def test_behind_a_tongue_that_is_out_is_the_mouth_that_its_jaw_opens(head):
    """Lips and teeth stand where tongueOut puts them; the tongue lies where it does at that jaw."""
    neutral, own = person(head, 1)
    kept = keep_in(own)
    shape = kept.vertices(neutral, weights({"tongueOut": 1.0}))
    tongue = own.part_vertices("tongue")
    others = np.setdiff1d(np.arange(len(neutral)), tongue)
    out = own.vertices(neutral, weights({"tongueOut": 1.0}))
    np.testing.assert_array_equal(shape[others], out[others])
    teeth = own.part_vertices("teeth_lower")
    jaw = own.vertices(neutral, weights({"jawOpen": 1.0}))
    share = np.linalg.norm(shape[teeth] - neutral[teeth]) / np.linalg.norm(
        jaw[teeth] - neutral[teeth]
    )
    assert 0.2 < share < 0.6
    same = own.vertices(neutral, weights({"jawOpen": share}))
    np.testing.assert_allclose(shape[tongue], same[tongue], atol=0.05)
    assert out[tongue, 2].max() > shape[tongue, 2].max() + 15


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("smile", [0.0, 0.5])  # in a wider one lips show (docs/log-heads.md)
def test_no_lip_shows_through_a_tongue(head, seed, smile):
    """Between the lips and its tip, the column in the middle of the tongue is the tongue alone."""
    neutral, own = person(head, seed)
    pose = weights({"tongueOut": 1.0, "mouthSmileLeft": smile, "mouthSmileRight": smile})
    shape = own.vertices(neutral, pose).astype(float)
    middle = neutral[own.part_vertices("mouth_sheet")].mean(0)
    pixels = (shape - middle)[:, :2] * [5, -5] + [200, 150]
    faces = own.part_faces("skin", "tongue")
    found = rasterize(pixels, 600 - shape[:, 2], own.faces[faces], (450, 400), cull=True)
    mine = (found.face >= 0) & (own.face_part[faces[found.face]] == PARTS.index("tongue"))
    for column in range(190, 211, 5):
        rows = np.flatnonzero(mine[:, column])
        assert len(rows) > 5 * 6 and len(rows) == np.ptp(rows) + 1
