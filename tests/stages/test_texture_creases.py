"""Lines of a smile are filled; what is wider, elsewhere, or of a mouth at rest is left alone."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from bakery import landmarks as marks
from bakery.geometry.color import LUMA
from bakery.geometry.curve import nearest_on
from bakery.stages.atlas import make_atlas
from bakery.stages.texture import creases

SKIN = np.array([0.45, 0.28, 0.22])


@pytest.fixture(scope="module")
def face(head):
    """Atlas of skin, each texel's place, and its distance from both lines, mm."""
    on_skin = make_atlas(head, 512).take("skin")
    places, points = on_skin.at(head.mean), head.landmarks(head.mean)
    lines = [nearest_on(places, points[line])[0] for line in creases.LINES]
    away = np.min([np.linalg.norm(places - line, axis=1) for line in lines], 0)
    return on_skin, places, away


def test_a_line_is_filled(head, face):
    on_skin, places, away = face
    dark = 0.4 * np.exp(-((away / 1.2) ** 2))[:, None]
    made = creases.filled(SKIN * np.exp(-dark), head, on_skin, 1.0)
    rows, weight, texel = creases._beside(head, on_skin)
    assert 0.3 < texel < 0.7  # mm: a face of 200 mm on some 400 texels
    core = rows[(away[rows] < 0.4) & (weight > 0.99)]
    assert len(core) > 20
    # Its middle was a third darker; of so narrow a line the blur leaves a quarter.
    assert_allclose(made[core], np.tile(SKIN, (len(core), 1)), rtol=0.1)
    assert (made >= SKIN * np.exp(-dark) - 1e-6).all()


def test_the_cut_at_the_bottom_of_a_fold_goes_too_and_pores_stay(head):
    on_skin = make_atlas(head, 1024).take("skin")
    places, points = on_skin.at(head.mean), head.landmarks(head.mean)
    lines = [nearest_on(places, points[line])[0] for line in creases.LINES]
    away = np.min([np.linalg.norm(places - line, axis=1) for line in lines], 0)
    pores = 0.06 * np.random.default_rng(0).normal(size=(len(places), 1))
    fold = 0.3 * np.exp(-((away / 1.5) ** 2)) + 0.4 * np.exp(-((away / 0.3) ** 2))
    made = creases.filled(SKIN * np.exp(pores - fold[:, None]), head, on_skin, 1.0)
    rows, weight, _ = creases._beside(head, on_skin)
    inside = rows[weight > 0.99]
    # By the first filling alone a line 0.3 darker is left where the cut was.
    core = inside[away[inside] < 0.25]
    assert len(core) > 20
    assert np.log(made[core] / SKIN).mean() > -0.1
    beside = inside[(away[inside] > 4) & (away[inside] < 5)]
    # The wide filling lifts what lies low among pores a little; the fine one would flatten all of them.
    changed = np.abs(np.log(made / (SKIN * np.exp(pores)))[beside])
    assert np.percentile(changed, 99) < 0.05
    assert np.log(made[beside] / SKIN).std() > 0.9 * 0.06


def test_the_hairs_of_a_beard_stay_as_fine_as_they_are(head):
    on_skin = make_atlas(head, 1024).take("skin")
    places, points = on_skin.at(head.mean), head.landmarks(head.mean)
    lines = [nearest_on(places, points[line])[0] for line in creases.LINES]
    away = np.min([np.linalg.norm(places - line, axis=1) for line in lines], 0)
    hairs = 0.9 * (np.random.default_rng(0).random((len(places), 1)) < 0.3)
    beard = SKIN * np.exp(-hairs - 0.3 * np.exp(-((away / 1.5) ** 2))[:, None])
    made = creases.filled(beard, head, on_skin, 1.0)
    rows, weight, _ = creases._beside(head, on_skin)
    core = rows[(weight > 0.99) & (away[rows] < 1)]
    hair = np.isclose(hairs[core, 0], 0.9)
    apart = [
        np.log(each[core][~hair] @ LUMA).mean() - np.log(each[core][hair] @ LUMA).mean()
        for each in (beard, made)
    ]
    assert apart[1] > 0.8 * apart[0]


def test_half_a_smile_fills_half(head, face):
    on_skin, _, away = face
    line = SKIN * np.exp(-0.4 * np.exp(-((away / 1.2) ** 2)))[:, None]
    whole, half = (creases.filled(line, head, on_skin, share) for share in (1.0, 0.5))
    assert_allclose(np.log(half / line), np.log(whole / line) / 2, atol=1e-5)
    assert creases.filled(line, head, on_skin, 0.0) is line


def test_what_is_no_line_is_left_alone(head, face):
    on_skin, places, away = face
    # A shadow over one side of the face, a bright line, and a dark one across the forehead.
    shadow = np.where(places[:, :1] > 0, 0.6, 1.0) * SKIN
    made = creases.filled(shadow, head, on_skin, 1.0)
    inside = np.abs(places[:, 0]) > 12  # its edge lies between both lines
    assert_allclose(made[inside], shadow[inside], rtol=1e-4)
    bright = SKIN * (1 + 0.5 * np.exp(-((away / 1.2) ** 2)))[:, None]
    rows, weight, _ = creases._beside(head, on_skin)
    crest = rows[(away[rows] < 0.5) & (weight > 0.99)]
    assert_allclose(creases.filled(bright, head, on_skin, 1.0)[crest], bright[crest], rtol=0.02)
    forehead = SKIN * np.where(np.abs(places[:, 1] - 30) < 1.5, 0.6, 1.0)[:, None]
    assert_allclose(creases.filled(forehead, head, on_skin, 1.0), forehead, rtol=1e-6)


def test_specks_and_pits_at_the_corners_are_taken_off(head, face):
    on_skin, places, _ = face
    corners = head.landmarks(head.mean)[marks.MOUTH_CORNERS]
    away = np.linalg.norm(places[:, None] - corners, axis=2).min(1)
    speck = SKIN * np.exp(0.8 * np.exp(-((away / 1.0) ** 2)))[:, None]
    made = creases.even_corners(speck, head, on_skin, 1.0)
    core = away < 0.5
    assert core.sum() > 5
    # It was twice as bright; of so small a speck the blur leaves a quarter.
    assert_allclose(made[core], np.tile(SKIN, (core.sum(), 1)), rtol=0.3)
    assert_allclose(made[away > 10], speck[away > 10], rtol=1e-6)
    assert creases.even_corners(speck, head, on_skin, 0.0) is speck
    # So is the dark behind lips that were open, but for what a closed mouth has; a shade as faint stays.
    for depth, left in ((0.8, 0.45), (2.5, 0.6), (0.1, 0.1)):
        dark = SKIN * np.exp(-depth * np.exp(-((away / 1.5) ** 2)))[:, None]
        made = creases.even_corners(dark, head, on_skin, 1.0)
        found = -np.log(made[core] / SKIN).mean()
        assert 0.05 < found < left + 0.01


def test_specks_beside_the_wings_go_and_their_own_crease_stays(head, face):
    """Ends of a smile's folds at the nose's edge; nostrils, a centimetre off it, are none."""
    on_skin, places, _ = face
    points = head.landmarks(head.mean)
    wing, nostril = points[creases.EDGES[0][1]], points[marks.NOSE_BASE].mean(0)
    speck = 1.0 * np.exp(-((np.linalg.norm(places - wing, axis=1) / 1.5) ** 2))
    crease = np.where(np.linalg.norm(places - points[creases.EDGES[1][1]], axis=1) < 2, 0.1, 0)
    hole = 1.5 * np.exp(-((np.linalg.norm((places - nostril)[:, :2], axis=1) / 2) ** 2))
    seen = SKIN * np.exp(-(speck + crease + hole))[:, None]
    made = creases.even_wings(seen, head, on_skin, 1.0)
    core = speck > 0.7
    assert core.sum() > 3
    left = -np.log(made[core] / SKIN).max(1)
    assert left.max() < 0.45 and left.mean() < 0.3  # 1.0 and 0.83 before
    for kept in (crease > 0, hole > 0.3):
        assert kept.sum() > 5
        assert_allclose(made[kept], seen[kept], rtol=0.02)
    assert creases.even_wings(seen, head, on_skin, 0.0) is seen
