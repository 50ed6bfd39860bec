"""Hairlines beside the face are one smooth line; what is hair there, and in which colours."""

import numpy as np
import pytest

from bakery.heads.scalp import ear_box, unrolled
from bakery.landmarks import EYES
from bakery.stages.hair.portrait import (
    COLLAR,
    HAIRLINE,
    LIKE_SKIN,
    MIXED,
    _continued,
    _share_of_hair,
    unlike_backdrop,
    without_glare,
)
from bakery.stages.hair.sideburns import sideburns
from bakery.stages.hair.temples import HEIGHTS, SOFT, Temples, temples_of

FRONT, BOTTOM, TOP = 128.0, -45.0, 6.0  # mm, as the built-in head has them
NONE = np.zeros((2, len(HEIGHTS)))  # sideburns
ACROSS, UP = np.meshgrid(np.arange(30.0, 140.0, 2.0), np.arange(-40.0, 120.0, 2.0))
BETWEEN = (ACROSS > 72) & (ACROSS < 116) & (UP > -10) & (UP < 90)  # where the line counts wholly


@pytest.fixture(scope="module")
def left():
    flat = np.stack([ACROSS, UP], -1)
    return Temples(flat, np.ones(ACROSS.shape, bool), FRONT, BOTTOM, TOP)


def sloping(up):
    """Across [...] mm at which hair begins: a line from the forehead to the ear."""
    return 118.0 - 0.45 * (up + 10)


def test_a_smooth_line_stays(left):
    hair = (ACROSS > sloping(UP)).astype(np.float32)
    out = left.smooth(hair, np.zeros(hair.shape), NONE)
    off = np.abs(ACROSS - sloping(UP))
    # Half of a soft edge, and 3 mm: a cell, and what the middle of seven rows leaves at a slope.
    assert np.abs(out - hair)[BETWEEN & (off > SOFT + 3)].max() < 0.05


def test_notches_and_spikes_go(left):
    hair = (ACROSS > sloping(UP)).astype(np.float32)
    hair[(UP > 30) & (UP < 44) & (ACROSS > sloping(UP) + 6)] = (
        0  # a notch behind a lock, above the ear
    )
    hair[(UP > 60) & (UP < 66) & (ACROSS > 60)] = 1  # a spike of three rows
    out = left.smooth(hair, np.zeros(hair.shape), NONE)
    plain = ACROSS > sloping(UP)
    off = np.abs(ACROSS - sloping(UP))
    assert np.abs(out - plain)[BETWEEN & (off > SOFT + 3)].max() < 0.05


def test_beside_an_ear_only_what_joins_it_is_a_sideburn(left):
    hair = ((UP > 20) & (ACROSS > 80)).astype(np.float32)
    hair[(UP < 0) & (ACROSS > 75) & (ACROSS < 95)] = 1  # the arm of glasses
    out = left.smooth(hair, np.zeros(hair.shape), NONE)
    assert out[(UP < -8) & (UP > -14) & (ACROSS > 72) & (ACROSS < 116)].max() < 0.05


def test_a_sideburn_goes_down_before_the_ear_it_was_seen_at(left):
    hair = ((UP > 20) & (ACROSS > 80)).astype(np.float32)
    burns = NONE.copy()
    burns[0, HEIGHTS > 0.6] = 1
    out = left.smooth(hair, np.zeros(hair.shape), burns)
    down = BOTTOM + 0.6 * (TOP - BOTTOM)
    before = (ACROSS > FRONT - 9) & (ACROSS < FRONT - 5)  # 18 mm wide, of that 10 soft
    assert out[before & (UP > down + 8) & (UP < 15)].min() > 0.9
    assert out[before & (UP < down - 8)].max() < 0.1
    assert out[(UP < 0) & (ACROSS < FRONT - 30)].max() < 0.05
    above = left.above_ears(burns)
    assert above[(UP > TOP) & (UP < TOP + 20) & (ACROSS > FRONT)].min() == 1
    assert above[UP < TOP - 4].max() == 0 and left.above_ears(burns[::-1]).max() == 0


def edge_on(head):
    """Places on the skin, their pixels seen from the front at 4 pixels a mm, and cosines."""
    faces = head.faces[head.part_faces("skin")]
    places = head.mean[faces].mean(1)
    normals = np.cross(*(head.mean[faces[:, k]] - head.mean[faces[:, 0]] for k in (1, 2)))
    cosine = normals[:, 2] / np.linalg.norm(normals, axis=1)
    pixels = np.stack([500 + 4 * places[:, 0], 600 - 4 * places[:, 1]], 1)
    return places, pixels, cosine


def test_sideburns_are_seen_as_far_down_as_there_is_hair_beside_the_cheek(head):
    places, pixels, cosine = edge_on(head)
    hair = np.zeros((1200, 1000), np.float32)
    assert sideburns(temples_of(head, places), places, pixels, cosine, hair).max() == 0
    _, _, bottom, top = ear_box(head)
    for side, columns in enumerate(
        (slice(795, 830), slice(170, 205))
    ):  # beside the skull, on one side
        one = hair.copy()
        down = bottom + 0.75 * (top - bottom)
        one[: int(600 - 4 * down), columns] = 1
        found = sideburns(temples_of(head, places), places, pixels, cosine, one)
        assert (found[side] > 0.5).tolist() == (HEIGHTS > 0.75).tolist()
        assert found[1 - side].max() == 0


@pytest.mark.parametrize("slant", [1.0, 0.2])
def test_a_side_that_is_turned_away_has_the_sideburn_of_the_other(slant, head):
    """Out of sight, or in sight at a slant that much worse than the other's."""
    places, pixels, cosine = edge_on(head)
    hair = np.zeros((1200, 1000), np.float32)
    hair[:640, 500:] = 1  # the photo has none on the subject's right
    far = (places[:, 0] < 0) & (cosine < 0.4)
    found = sideburns(
        temples_of(head, places), places, pixels, np.where(far, cosine - slant, cosine), hair
    )
    assert np.array_equal(found[0], found[1]) and found[1].max() == 1


@pytest.mark.parametrize("hairy", [False, True])
def test_sideburns_that_nobody_sees_are_as_usual_of_those_who_have_hair(hairy, head):
    places, pixels, cosine = edge_on(head)
    seen = unrolled(head)(places)[:, 0] < ear_box(head)[0] - 20
    hair = np.full((1200, 1000), float(hairy), np.float32)
    found = sideburns(
        temples_of(head, places[seen]), places[seen], pixels[seen], cosine[seen], hair
    )
    assert np.array_equal(found[0], found[1])
    assert np.array_equal(found[0] > 0.5, (HEIGHTS > 0.75) & hairy)


def test_what_is_seen_squarely_stays_as_it_is(left):
    hair = (np.random.default_rng(1).random(ACROSS.shape) > 0.5).astype(np.float32)
    assert np.array_equal(left.smooth(hair, np.full(hair.shape, 0.5), NONE), hair)


def test_nothing_changes_before_the_face_nor_behind_the_ear(left):
    hair = (np.random.default_rng(2).random(ACROSS.shape) > 0.5).astype(np.float32)
    out = left.smooth(hair, np.zeros(hair.shape), NONE)
    outside = (ACROSS < 52) | (ACROSS > FRONT + 2) | (UP > 115) | (UP < TOP - 38)
    assert np.array_equal(out[outside], hair[outside]) and (out != hair).any()


def test_sides_do_not_tell_of_each_other():
    flat = np.stack([ACROSS, UP], -1)
    both = Temples(np.stack([flat, flat]), np.stack([ACROSS > 0, ACROSS < 0]), FRONT, BOTTOM, TOP)
    one, none = (ACROSS > sloping(UP)).astype(np.float32), np.zeros(ACROSS.shape, np.float32)
    out = both.smooth(np.stack([one, none]), np.zeros((2, *ACROSS.shape)), NONE)
    assert out[1][BETWEEN].max() == 0 and out[0][BETWEEN].max() > 0.99


def test_a_head_has_its_ears_where_its_temples_end(head):
    points = head.mean
    found = temples_of(head, points)
    assert found.flat.shape == (len(points), 2)
    assert np.array_equal(found.left, points[:, 0] > 0)
    assert 100 < found.front < 150 and -10 < found.top < 40


def test_shaded_hair_is_no_backdrop():
    """Between hair and backdrop lie the colours of strands apart; what is darker than both is hair."""
    picture = np.full((60, 60, 3), (0.6, 0.45, 0.3), np.float32)  # hair
    backdrop = np.zeros((60, 60), bool)
    backdrop[:, :20] = True
    picture[backdrop] = (0.3, 0.4, 0.6)
    picture[20:40, 20:32] = (0.08, 0.06, 0.05)  # in the shade
    picture[44:56, 20:32] = (0.33, 0.4, 0.57)  # the backdrop, seen through
    hair = (~backdrop).astype(np.float32)
    kept = unlike_backdrop(picture, hair, backdrop, 60, 1.0)
    assert kept[24:36, 23:29].min() > 0.95
    assert kept[47:53, 23:26].max() < 0.3


def test_grey_temples_are_no_backdrop():
    """Their colour lies between that of dark hair above and a grey backdrop's."""
    picture = np.full((120, 60, 3), (0.15, 0.14, 0.13), np.float32)  # hair
    backdrop = np.zeros((120, 60), bool)
    backdrop[:, :15] = True
    picture[backdrop] = (0.55, 0.6, 0.65)
    picture[60:, 15:] = (0.45, 0.46, 0.47)
    kept = unlike_backdrop(picture, (~backdrop).astype(np.float32), backdrop, 120, 1.0)
    assert kept[75:, 15:].min() > 0.9  # 15 mm from the dark hair


def lit_from_behind(hair):
    """Picture, labels of hair and of skin, and landmarks: a temple that glares, labelled hair."""
    picture = np.full((80, 100, 3), (0.7, 0.5, 0.4), np.float32)
    solid = np.zeros((80, 100), bool)
    solid[:, 70:] = True
    picture[solid] = hair
    skin = ~solid
    picture[20:60, 70:76] = 0.95
    points = np.tile([40.0, 64.0], (478, 1))  # eyes end at column 40, below the glare
    return picture, solid, skin, points


def test_light_that_glares_on_a_temple_is_no_hair():
    picture, solid, skin, points = lit_from_behind((0.25, 0.18, 0.12))
    kept = without_glare(picture, solid, skin, points, 1.0)
    assert not kept[22:58, 70:76].any() and kept[:, 80:].all() and kept[:16, 70:].all()


def test_a_highlight_of_light_hair_beside_no_skin_stays():
    picture, solid, skin, points = lit_from_behind((0.25, 0.18, 0.12))
    picture[20:60, 70:76] = (0.25, 0.18, 0.12)
    picture[20:40, 73:79] = 0.95  # skin ends at column 70
    assert without_glare(picture, solid, skin, points, 1.0)[20:40, 74:].all()


def test_white_hair_and_locks_above_the_eyes_stay():
    picture, solid, skin, points = lit_from_behind((0.85, 0.85, 0.85))
    assert np.array_equal(without_glare(picture, solid, skin, points, 1.0), solid)
    picture, solid, skin, points = lit_from_behind((0.25, 0.18, 0.12))
    points[:, 0] = np.linspace(0, 99, len(points))
    points[np.concatenate(EYES), 0] = np.linspace(2, 98, len(np.concatenate(EYES)))
    assert np.array_equal(without_glare(picture, solid, skin, points, 1.0), solid)


def test_white_hair_beside_hair_that_is_light_is_no_glare():
    picture, solid, skin, points = lit_from_behind((0.25, 0.18, 0.12))
    picture[:, 76:88] = 0.6
    assert np.array_equal(without_glare(picture, solid, skin, points, 1.0), solid)


def _hairline(hair):
    """Skin below row 60, labelled hair above, 2 pixels a mm; rows 50 to 60 of it show skin: picture, planes."""
    picture = np.empty((100, 80, 3), np.float32)
    picture[:50], picture[50:] = hair, (0.8, 0.6, 0.5)
    skin = np.zeros((100, 80), bool)
    skin[60:] = True
    return picture, (~skin).astype(np.float32), skin


def test_skin_in_labelled_hair_beside_the_face_is_none():
    """Colours are taken over 1.5 mm: 2 mm, four rows, from the line they are told."""
    found = _share_of_hair(*_hairline((0.2, 0.15, 0.1)), HAIRLINE, 2.0, bare=True)
    assert found[54:60].max() < LIKE_SKIN[0] and found[:46].min() > MIXED[1]


def test_thin_hair_beside_the_face_is_hair_of_no_colour_of_its_own():
    picture, hair, skin = _hairline((0.2, 0.15, 0.1))
    picture[50:60] = 0.55 * picture[99] + 0.45 * picture[0]
    found = _share_of_hair(picture, hair, skin, HAIRLINE, 2.0, bare=True)[55]
    assert found.min() > LIKE_SKIN[1] and found.max() < MIXED[1]


def test_fair_hair_beside_the_face_is_not_told_from_skin():
    found = _share_of_hair(*_hairline((0.72, 0.58, 0.45)), HAIRLINE, 2.0, bare=True)
    assert found.min() > 0.95


def test_grey_hair_between_dark_hair_and_skin_is_hair():
    """As light as 0.7 of the way to the skin, but without its hue; glare on skin is lighter than skin."""
    picture, hair, skin = _hairline((0.2, 0.18, 0.17))
    picture[50:60] = (0.52, 0.52, 0.52)
    found = _share_of_hair(picture, hair, skin, HAIRLINE, 2.0, bare=True)
    assert found[50:58].min() > LIKE_SKIN[1]
    picture[50:60] = (0.85, 0.82, 0.8)
    assert _share_of_hair(picture, hair, skin, HAIRLINE, 2.0, bare=True)[54:60].max() < LIKE_SKIN[0]


def test_without_skin_or_hair_nothing_is_taken():
    picture, hair, skin = _hairline((0.2, 0.15, 0.1))
    assert _share_of_hair(picture, hair, np.zeros_like(skin), HAIRLINE, 2.0, bare=True).min() == 1
    assert _share_of_hair(picture, np.zeros_like(hair), skin, HAIRLINE, 2.0, bare=True).min() == 1


def test_a_collar_between_strands_is_none_of_the_hairs_colour():
    """A white collar that was labelled hair, 10 mm of it, hung as white locks in a dark hem."""
    picture, hair, clothes = _hairline((0.2, 0.15, 0.1))
    picture[:30], picture[30:50] = (0.2, 0.15, 0.1), (0.8, 0.6, 0.5)
    picture = np.concatenate([np.tile(picture[:1], (40, 1, 1)), picture])
    hair, clothes = (np.pad(plane, ((40, 0), (0, 0)), mode="edge") for plane in (hair, clothes))
    found = _share_of_hair(picture, hair, clothes, COLLAR, 2.0, bare=False)
    assert found[74:99].max() < MIXED[0] and found[:66].min() > MIXED[1]


def test_no_colour_of_clothes_bleeds_into_a_lock_that_hangs_before_them():
    """Labels of brown locks held green cloth at their end; being less red than it is no sign of grey hair."""
    picture = np.full((160, 200, 3), (0.2, 0.33, 0.31), np.float32)  # cloth
    picture[:60] = (0.55, 0.6, 0.65)  # backdrop
    # The lock, 60 mm wide, ends above the picture's edge; labels go on.
    picture[:120, 40:160] = (0.37, 0.26, 0.2)
    hair = np.zeros((160, 200), np.float32)
    hair[:, 40:160] = 1
    clothes = (hair == 0) & (np.arange(160) >= 60)[:, None]
    found = _share_of_hair(picture, hair, clothes, COLLAR, 2.0, bare=False)
    assert found[126:, 44:84].max() < MIXED[0] and found[:110, 46:154].min() > MIXED[1]


def test_earrings_do_not_shine_in_hair():
    """Small and white below the eyes; above them such a spot is a highlight, and what is wide is a grey lock."""
    hair, white = np.float32(0.02), np.float32(0.6)
    linear = np.full((160, 160, 3), hair, np.float32)
    earring, highlight, lock = np.s_[100:106, 20:26], np.s_[20:26, 20:26], np.s_[90:150, 90:120]
    for where in (earring, highlight, lock):
        linear[where] = white
    solid, none = np.ones((160, 160), np.float32), np.zeros((160, 160), bool)
    none[:, -1] = True
    out, sharp = _continued(linear, solid, none, 60.0, 1.0)
    assert sharp[earring].max() < 0.1 and sharp[80, 80] == 1 and sharp[80, 158] < 0.1
    np.testing.assert_allclose(out[earring], hair, rtol=0.1)
    assert out[highlight].max() > 0.5 and np.median(out[lock]) > 0.5
