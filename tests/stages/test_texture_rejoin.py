"""Patches that a smile's folds leave at rest get the tone and the pores of the skin around."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from bakery.geometry.color import LUMA
from bakery.landmarks import EYE_CORNERS, MOUTH_CORNERS, NOSE_BASE
from bakery.stages.atlas import make_atlas
from bakery.stages.texture import calm
from bakery.stages.texture.rejoin import BELOW, rejoined

SKIN = np.array([0.45, 0.28, 0.22], np.float32)
RADIUS = 8.0  # mm, of a patch beside the mouth


@pytest.fixture(scope="module")
def face(head):
    """Atlas of skin, grainy colours of it, its cheeks, and how far each texel is from a place on one."""
    on_skin = make_atlas(head, 512).take("skin")
    grain = np.random.default_rng(2).normal(0, 0.04, (len(on_skin.index), 1))
    seen = (SKIN * np.exp(grain)).astype(np.float32)
    cheeks = calm.cheeks_of(seen, np.ones(len(seen), np.float32), head, on_skin)
    points, places = head.landmarks(head.mean), on_skin.at(head.mean)
    corner, wing = points[MOUTH_CORNERS[0]], points[NOSE_BASE[0]]
    center = corner + [np.sign(corner[0]) * 20, (wing[1] - corner[1]) / 2, 0]
    away = np.linalg.norm((places - center)[:, :2], axis=1)
    return on_skin, seen, cheeks, away


def patched(seen, away):
    """Skin with a flat, bright patch."""
    return np.where((away < RADIUS)[:, None], SKIN * np.float32(1.3), seen)


def on_cheeks(cheeks, on_skin):
    return cheeks.rows(cheeks.weight * (1 - cheeks.beard), on_skin) > 0.95


def grain_of(colors, rows):
    return float(np.log(colors[rows] @ LUMA).std())


def test_a_flat_patch_is_like_the_skin_around(head, face):
    on_skin, seen, cheeks, away = face
    made = patched(seen, away)
    out = rejoined(made, seen, cheeks, head, on_skin, 1.0)
    plain = on_cheeks(cheeks, on_skin)
    core, around = plain & (away < RADIUS), plain & (away > RADIUS + 4) & (away < RADIUS + 7)
    assert core.sum() > 500 and around.sum() > 500
    rim = core & (away > RADIUS - 1.5)
    assert_allclose(np.log(out[core]).mean(0), np.log(SKIN), atol=0.02)  # 0.26 before
    assert_allclose(np.log(out[rim]).mean(0), np.log(SKIN), atol=0.04)
    assert grain_of(made, core) < 1e-6
    assert grain_of(out, core) == pytest.approx(grain_of(seen, around), rel=0.25)
    assert_allclose(out[away > 40], made[away > 40], rtol=1e-5)


def test_half_a_smile_is_rejoined_by_half(head, face):
    on_skin, seen, cheeks, away = face
    made = patched(seen, away)
    half, whole = (np.log(rejoined(made, seen, cheeks, head, on_skin, share)) for share in (0.5, 1))
    assert_allclose(half, (np.log(made) + whole) / 2, atol=1e-5)


def test_what_was_not_changed_stays(head, face):
    on_skin, seen, cheeks, _ = face
    assert_allclose(rejoined(seen, seen, cheeks, head, on_skin, 1.0), seen, rtol=1e-6)
    assert rejoined(seen, seen, cheeks, head, on_skin, 0.0) is seen


def test_a_beard_stays(head, face):
    on_skin, seen, cheeks, away = face
    made = patched(seen, away)
    bearded = calm.Cheeks(
        cheeks.window, cheeks.weight, np.ones_like(cheeks.weight), 0.0, cheeks.texel
    )
    assert rejoined(made, seen, bearded, head, on_skin, 1.0) is made


def test_where_all_was_changed_nothing_tells_the_tone(head, face):
    on_skin, seen, cheeks, _ = face
    made = seen * np.float32(1.5)
    assert rejoined(made, seen, cheeks, head, on_skin, 1.0) is made


def test_smooth_skin_beside_a_patch_gets_no_grain(head, face):
    """One half of a face lies out of focus: it gets no more detail than it had."""
    on_skin, seen, _, away = face
    left = on_skin.at(head.mean)[:, :1] > 0
    seen = np.where(left, seen, SKIN)
    cheeks = calm.cheeks_of(seen, np.ones(len(seen), np.float32), head, on_skin)
    made = seen * np.exp(np.float32(0.3) * (away < RADIUS)[:, None]).astype(np.float32)
    out = rejoined(made, seen, cheeks, head, on_skin, 1.0)
    smooth = (~left[:, 0]) & (away > 3 * RADIUS)
    assert smooth.sum() > 5000
    assert_allclose(out[smooth], made[smooth], rtol=1e-4)


def test_bags_under_the_eyes_stay(head, face):
    """Whatever was done to them: they are the person's own."""
    on_skin, seen, cheeks, _ = face
    level = head.landmarks(head.mean)[EYE_CORNERS, 1].mean()
    high = level - on_skin.at(head.mean)[:, 1] < BELOW[0]
    made = np.where(high[:, None], SKIN * np.float32(1.3), seen)
    assert (high & on_cheeks(cheeks, on_skin)).sum() > 500
    out = rejoined(made, seen, cheeks, head, on_skin, 1.0)
    assert_allclose(np.log(out[high]).mean(0), np.log(made[high]).mean(0), atol=1e-3)
