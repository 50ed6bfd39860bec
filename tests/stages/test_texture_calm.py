"""Cheeks of a smile become as even as resting ones; what is fainter, or elsewhere, is left alone."""

import cv2
import numpy as np
import pytest
from numpy.testing import assert_allclose

from bakery.geometry.color import LUMA
from bakery.landmarks import LIPS_OUTER, MOUTH_CORNERS, NOSE_BASE, OVAL
from bakery.stages.atlas import make_atlas, uv_polygon
from bakery.stages.texture import calm

SKIN = np.array([0.45, 0.28, 0.22], np.float32)
STREAK = 6.0  # mm, wavelength


@pytest.fixture(scope="module")
def face(head):
    """Atlas of skin, each texel's place in mm, and how surely it lies on a cheek."""
    on_skin = make_atlas(head, 512).take("skin")
    weight, texel = calm._cheeks(head, on_skin)
    assert 0.3 < texel < 0.7  # mm: a face of 200 mm on some 400 texels
    return on_skin, on_skin.at(head.mean), weight.reshape(-1)[on_skin.index]


def calmed(colors, plain, head, on_skin, share):
    cheeks = calm.cheeks_of(colors, plain, head, on_skin)
    return calm.calmed(colors, plain, cheeks, head, on_skin, share)


def streaks(places, height):
    return SKIN * np.exp(height * np.sin(2 * np.pi * places[:, 1:2] / STREAK)).astype(np.float32)


def spread(colors, rows):
    return float(np.log(colors[rows] @ LUMA).std())


def test_streaks_are_brought_down_to_rest(head, face):
    on_skin, places, weight = face
    core = np.flatnonzero(weight > 0.95)
    assert len(core) > 2000
    plain = np.ones(len(places), np.float32)
    streaked = streaks(places, 0.4)
    made = calmed(streaked, plain, head, on_skin, 1.0)
    # 0.28 before; each of the octaves that share a wavelength keeps what it has at rest.
    most = sum(limit for _, limit, _ in calm.OCTAVES[:5])
    assert spread(made, core) < min(most, spread(streaked, core) / 2)
    assert_allclose(np.log(made[core]).mean(0), np.log(SKIN), atol=0.02)
    base = head.landmarks(head.mean)[NOSE_BASE[0], 1]
    lips = uv_polygon(head, LIPS_OUTER, 1.0, on_skin.size).reshape(-1)[on_skin.index] > 0
    # Lips, nose, lids, brows and forehead; what is between nose and lips is shade.
    away = (weight == 0) & (lips | (places[:, 1] > base + calm.UNDER_NOSE[0]))
    assert away.sum() > 2000
    assert_allclose(made[away], streaked[away], rtol=1e-6)


def test_no_edge_along_the_contour(head, face):
    """What is evened fades out before the jaw, over FADE: it ended in a line once."""
    on_skin, places, _ = face
    streaked = streaks(places, 0.4)
    made = calmed(streaked, np.ones(len(places), np.float32), head, on_skin, 1.0)
    change = on_skin.paint(np.log(made / streaked) @ LUMA)
    inside = uv_polygon(head, OVAL, calm.WITHIN, on_skin.size).astype(np.uint8)
    rim = cv2.morphologyEx(inside, cv2.MORPH_GRADIENT, np.ones((5, 5), np.uint8)) > 0
    rim &= on_skin.paint(np.ones(len(places))) > 0
    assert rim.sum() > 1000
    # From trough to crest 0.8 may change; 3 texels of 0.5 mm inside a smoothstep of 6 mm a fifth of it.
    assert np.abs(change[rim]).max() < 0.16


def test_ears_keep_their_folds(head, face):
    """The face's contour on the atlas reaches over the ears, whose folds were levelled with the cheeks."""
    on_skin, places, _ = face
    ears = places[:, 2] < head.landmarks(head.mean)[OVAL, 2].min()
    streaked = streaks(places, 0.4)
    made = calmed(streaked, np.ones(len(places), np.float32), head, on_skin, 1.0)
    assert_allclose(made[ears], streaked[ears], rtol=1e-6)


def test_faint_unevenness_and_resting_faces_stay(head, face):
    on_skin, places, _ = face
    plain = np.ones(len(places), np.float32)
    faint = streaks(places, 0.01)
    assert_allclose(calmed(faint, plain, head, on_skin, 1.0), faint, rtol=1e-3)
    assert calmed(faint, plain, head, on_skin, 0.0) is faint


def test_who_has_a_beard_keeps_it(head, face):
    on_skin, places, weight = face
    plain = np.ones(len(places), np.float32)
    streaked = streaks(places, 0.2)
    hairs = np.random.default_rng(1).normal(1, 0.6, (len(places), 1)).clip(0.1).astype(np.float32)
    lip = uv_polygon(head, calm.MOUSTACHE, 1.0, on_skin.size).reshape(-1)[on_skin.index] > 0
    mouth = head.landmarks(head.mean)[MOUTH_CORNERS, 1].mean()
    below, above = (places[:, 1] < mouth - 5), (places[:, 1] > mouth + 5)
    grown = streaked * np.where((lip | below)[:, None], hairs, 1)
    made = calmed(grown, plain, head, on_skin, 1.0)
    near = np.abs(places[:, 0]) < corner_of(head) + calm.ASIDE[0]
    kept = (below & near) | lip
    assert_allclose(made[kept], grown[kept], rtol=1e-5)
    beside = np.abs(places[:, 0]) < 45  # mm, well off the moustache
    cheek = np.flatnonzero(above & ~beside & (weight > 0.95))
    # 0.14 before; what the octaves about 6 mm keep at rest comes to 0.08.
    assert spread(made, cheek) < 0.6 * spread(grown, cheek)


def corner_of(head):
    return np.abs(head.landmarks(head.mean)[MOUTH_CORNERS, 0]).mean()


def test_a_crease_beside_a_beard_goes(head, face):
    """A dark line from cheek to jaw is filled in a beard too; one as wide in its middle is a goatee's."""
    on_skin, places, weight = face
    plain, corner = np.ones(len(places), np.float32), corner_of(head)
    hairs = np.random.default_rng(1).normal(1, 0.2, (len(places), 1)).clip(0.1).astype(np.float32)
    mouth = head.landmarks(head.mean)[MOUTH_CORNERS, 1].mean()
    lower, bearded = np.abs(places[:, 1] - mouth + 18) < 8, places[:, 1] < mouth
    grown = streaks(places, 0.02) * np.where(bearded[:, None], hairs, 1)
    for at, goes in ((corner + calm.ASIDE[1] + 2, True), (corner - 8, False)):
        off = np.abs(np.abs(places[:, 0]) - at)
        dark = grown * np.exp(-0.4 * np.exp(-((off / 3) ** 2)))[:, None].astype(np.float32)
        line = lower & (off < 1) & (weight > 0.8)
        assert line.sum() > 30
        found, left = (
            np.log(grown[line] / calmed(x.astype(np.float32), plain, head, on_skin, 1.0)[line])
            for x in (dark, grown)
        )
        depth = float((found - left).mean())  # what the line adds, beside what hairs get anyway
        assert (depth < 0.2) if goes else (depth > 0.33), depth


def test_a_fold_above_the_lip_is_no_beard(head, face):
    """A smile folds the skin there; chin and cheeks have the same pores."""
    on_skin, places, weight = face
    lip = uv_polygon(head, calm.MOUSTACHE, 1.0, on_skin.size).reshape(-1)[on_skin.index] > 0
    pores = np.random.default_rng(1).normal(1, 0.02, (len(places), 1)).astype(np.float32)
    folded = streaks(places, 0.2) * pores * np.where(lip[:, None], streaks(places, 0.4) / SKIN, 1)
    made = calmed(folded, np.ones(len(places), np.float32), head, on_skin, 1.0)
    chin = places[:, 1] < head.landmarks(head.mean)[MOUTH_CORNERS, 1].mean() - 5
    core = np.flatnonzero(chin & (weight > 0.95))
    assert spread(made, core) < 0.6 * spread(folded, core)


def test_a_beard_stays(head, face):
    on_skin, places, _ = face
    beard = streaks(places, 0.4)
    none = np.zeros(len(places), np.float32)
    assert_allclose(calmed(beard, none, head, on_skin, 1.0), beard, rtol=1e-6)


def test_patches_of_colour_go(head, face):
    on_skin, places, weight = face
    plain, core = np.ones(len(places), np.float32), weight > 0.95
    redder = 0.2 * np.sin(2 * np.pi * places[:, 1:2] / STREAK) * np.array([1, 0, -1])
    made = calmed(SKIN * np.exp(redder), plain, head, on_skin, 1.0)
    assert np.log(made[core, 0] / made[core, 2]).std() < 0.5 * (2 * redder[core, 0]).std()


def test_wide_hollows_beside_the_mouth_go(head, face):
    """A dark band of 12 mm down a cheek, lighter on both sides: its shade is filled, the forehead's is not."""
    on_skin, places, weight = face
    plain = np.ones(len(places), np.float32)
    band = np.exp(-(((np.abs(places[:, 0]) - 42) / 6) ** 2))
    hollow = (SKIN * np.exp(-0.25 * band)[:, None]).astype(np.float32)
    base = head.landmarks(head.mean)[NOSE_BASE[0], 1]
    cheek = (weight > 0.95) & (np.abs(places[:, 1] - base + 15) < 10) & (band > 0.9)
    above = (weight > 0) & (places[:, 1] > base + calm.HOLLOW_BELOW[0] + 1)
    assert cheek.sum() > 50

    def depth(colors, where):
        return -np.log(colors[where] / SKIN).mean()

    made = calmed(hollow, plain, head, on_skin, 1.0)
    assert depth(hollow, cheek) > 0.2 and depth(made, cheek) < 0.12
    lighter = calmed((SKIN**2 / hollow).astype(np.float32), plain, head, on_skin, 1.0)
    assert depth(lighter, cheek) < -0.1, "what is lighter than its sides is none"
    assert above.sum() > 50


def test_shade_above_the_lip_is_no_moustache(head, face):
    """An upper lip darker than the cheeks becomes lighter; one with hairs on it stays, and so do the lips."""
    on_skin, places, _ = face
    plain = np.ones(len(places), np.float32)
    ring = uv_polygon(head, calm.MOUSTACHE, 0.8, on_skin.size).reshape(-1)[on_skin.index] > 0
    lips = uv_polygon(head, LIPS_OUTER, 1.0, on_skin.size).reshape(-1)[on_skin.index] > 0
    pores = np.random.default_rng(1).normal(1, 0.02, (len(places), 1)).astype(np.float32)
    shaded = SKIN * pores * np.where(ring, 0.75, np.where(lips, 0.6, 1))[:, None]
    made = calmed(shaded, plain, head, on_skin, 1.0)
    gain = np.log(made / shaded)
    base = head.landmarks(head.mean)[NOSE_BASE[0], 1]
    middle = ring & (places[:, 1] < base + calm.UNDER_NOSE[1])
    assert middle.sum() > 100 and np.median(gain[middle]) > 0.1
    assert np.abs(gain[lips]).max() < 0.05

    def rough(colors):
        log = on_skin.paint(np.log(colors[:, 1]).astype(np.float32))
        fine = (log - cv2.GaussianBlur(log, (0, 0), 1.5)).reshape(-1)[on_skin.index]
        return fine[
            cv2.erode(on_skin.paint(middle * 1.0), np.ones((9, 9))).reshape(-1)[on_skin.index] > 0
        ].std()

    assert rough(made) < 0.7 * rough(shaded), "noise in the shade is no scar in the light"
    hairs = np.random.default_rng(2).normal(1, 0.5, (len(places), 1)).clip(0.2)
    grown = (shaded * np.where(ring[:, None], hairs, 1)).astype(np.float32)
    kept = np.log(calmed(grown, plain, head, on_skin, 1.0) / grown)
    assert np.abs(kept[middle]).max() < 0.01
