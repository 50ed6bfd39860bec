"""Labels of hair that the photo's colours contradict."""

import cv2
import numpy as np
import pytest

from bakery.landmarks import BROW_LEFT, BROW_RIGHT
from bakery.stages.segment import BACKGROUND, EARS, GLASSES, HAIR, LENS, SKIN, Segmentation
from bakery.stages.segment.refine import refined
from bakery.stages.segment.scalp import without_cloth_colors, without_clothes

SKIN_TONE = (0.8, 0.6, 0.5)
COLORS = {HAIR: (0.3, 0.2, 0.1), SKIN: SKIN_TONE, BACKGROUND: (0.9, 0.9, 0.9)}


def points_with_eyes(gap):
    points = np.zeros((478, 2))
    points[:, 1] = 100.0
    points[33], points[263] = (50.0, 100.0), (50.0 + gap, 100.0)
    return points


def photo_of(labels):
    """Brown hair, light skin and white background, [H, W, 3]."""
    out = np.zeros(labels.shape + (3,), np.float32)
    for label, color in COLORS.items():
        out[labels == label] = color
    return out


@pytest.mark.parametrize("shaved", [True, False])
def test_rims_of_bald_tops_are_no_hair(shaved):
    """Hair around a face: a rim in skin's colour above brown sides, or all of it thin and like skin."""
    labels = np.full((200, 200), BACKGROUND, np.uint8)
    band = 12 if shaved else 35  # pixels, of 1.8 mm
    labels[30:170, 75 - band : 125 + band] = HAIR
    labels[40:170, 75:125] = SKIN
    photo = photo_of(labels)
    rim = np.zeros(labels.shape, bool)
    rim[32:38, 85:115] = True
    photo[30:40, 75:125] = photo[100, 100]
    if shaved:
        photo[labels == HAIR] = photo[100, 100] + np.float32(0.02)
    segmentation = Segmentation(labels, (labels == SKIN).astype(np.float32))
    hair = refined(segmentation, photo, points_with_eyes(50.0)).regions == HAIR
    assert not hair[rim].any()
    assert hair[100, 75 - band // 2] != shaved


def test_dark_hair_on_dark_skin_is_no_rim():
    """The sides of a cropped head are thin, and nearly as dark as the face."""
    labels = np.full((200, 200), BACKGROUND, np.uint8)
    labels[5:170, 63:137] = HAIR
    labels[50:170, 75:125] = SKIN
    photo = photo_of(labels)
    photo[labels == SKIN], photo[labels == HAIR] = (0.22, 0.15, 0.13), (0.12, 0.11, 0.11)
    segmentation = Segmentation(labels, (labels == SKIN).astype(np.float32))
    hair = refined(segmentation, photo, points_with_eyes(50.0)).regions == HAIR
    assert hair[60:160, 66:72].all() and hair[20, 100]


@pytest.mark.parametrize("lighter", [True, False])
def test_cropped_hair_that_shines_on_top_keeps_its_sides(lighter):
    """Its sides are as dark as dark skin, and what is left above is a highlight; under a brown top
    sides like skin are shaved."""
    labels = np.full((200, 200), BACKGROUND, np.uint8)
    labels[5:120, 63:137] = HAIR
    labels[50:170, 75:125] = SKIN
    photo = photo_of(labels)
    photo[labels == SKIN], photo[labels == HAIR] = (0.31, 0.24, 0.21), (0.25, 0.19, 0.17)
    photo[5:50, 63:137] = 0.6 if lighter else 0.05
    segmentation = Segmentation(labels, (labels == SKIN).astype(np.float32))
    hair = refined(segmentation, photo, points_with_eyes(50.0)).regions == HAIR
    side = hair[70:110, 66:72]
    assert side.all() if lighter else not side.any()
    assert hair[20, 100]


def test_clothes_below_the_hair_are_none():
    hair, clothes = np.zeros((2, 100, 100), bool)
    hair[10:40, 20:80] = hair[60:80, 70:90] = True
    clothes[80:] = clothes[70:, 90:] = True
    own = hair & (np.arange(100) < 50)[:, None]
    assert (without_clothes(hair, clothes, 1.0) == own).all()
    assert (without_clothes(hair, np.zeros_like(clothes), 1.0) == hair).all()
    lock = hair.copy()
    lock[40:60, 75:80] = True  # hangs from the head
    assert (without_clothes(lock, clothes, 1.0) == lock).all()
    beside = hair.copy()
    beside[40:75, 20:25] = True  # the head's own hair ends no higher
    assert (without_clothes(beside, clothes, 1.0) == beside).all()
    nothing = np.zeros_like(hair)
    assert not without_clothes(nothing, clothes, 1.0).any()


@pytest.mark.parametrize("scarf", [(0.1, 0.15, 0.5), (0.7, 0.1, 0.1)])
def test_a_scarf_in_the_colour_of_the_clothes_is_no_hair(scarf):
    hair, clothes = np.zeros((2, 160, 160), bool)
    hair[10:110, 20:60] = True  # hangs beside a neck, and goes over into
    clothes[130:] = clothes[110:, 60:] = True
    picture = np.full((160, 160, 3), COLORS[BACKGROUND], np.float32)
    picture[hair] = COLORS[HAIR]
    cloth = clothes.copy()
    cloth[110:130, 20:60] = True
    labelled = hair | (cloth & ~clothes)
    picture[cloth] = scarf
    kept = without_cloth_colors(picture, labelled, clothes, 1.0)
    assert not kept[110:].any()
    assert kept[:95].sum() == hair[:95].sum()
    # The same patch that clothes do not touch is a gleam of them, and hair.
    away = clothes & (np.arange(160) > 140)[:, None]
    assert (without_cloth_colors(picture, labelled, away, 1.0) == labelled).all()
    # Cloth that is dark as the hair tells nothing.
    picture[cloth] = COLORS[HAIR]
    assert (without_cloth_colors(picture, labelled, clothes, 1.0) == labelled).all()
    nothing = np.zeros_like(hair)
    assert not without_cloth_colors(picture, nothing, clothes, 1.0).any()


def head_of(top=20):
    """Labels [200, 200] of a head whose hair reaches `top` pixels over the forehead, and its photo."""
    labels = np.full((200, 200), BACKGROUND, np.uint8)
    labels[20:170, 40:160] = HAIR
    labels[20 + top : 170, 70:130] = SKIN
    return labels, photo_of(labels)


def test_beside_what_becomes_skin_none_is_left_out():
    """Skin beside labelled hair is not unwrapped; where that was none, it is."""
    labels, photo = head_of()
    photo[20:40, 70:130] = COLORS[SKIN]
    skin = cv2.erode((labels == SKIN).astype(np.float32), np.ones((9, 9)))
    found = refined(Segmentation(labels, skin), photo, points_with_eyes(50.0))
    assert skin[40:43, 75:125].max() == 0 and found.skin[40:43, 75:125].min() == 1
    np.testing.assert_array_equal(found.skin[60:], skin[60:])


def refine(labels, photo, gap=50.0):
    return refined(
        Segmentation(labels, (labels == SKIN).astype(np.float32)), photo, points_with_eyes(gap)
    )


def test_a_bald_top_becomes_skin_that_can_be_unwrapped():
    labels, photo = head_of()
    photo[20:40, 70:130] = 0.8 * np.array(COLORS[SKIN])  # in the shade
    found = refine(labels, photo)
    assert (found.regions[22:40, 75:125] == SKIN).all() and (
        found.labels[22:40, 75:125] == SKIN
    ).all()
    assert found.skin[26:40, 75:125].min() == 1 and found.skin[:20].max() == 0
    assert (found.labels[labels != HAIR] == labels[labels != HAIR]).all()
    assert (found.labels[60:160, 42:66] == HAIR).all()


def test_strands_in_the_colour_of_skin_are_hair():
    labels, photo = head_of()
    streaks = np.random.default_rng(0).uniform(0.5, 1, (1, 60, 1)).astype(np.float32)
    photo[20:40, 70:130] = streaks * np.array(COLORS[SKIN], np.float32)
    assert (refine(labels, photo).labels[20:40, 70:130] == HAIR).mean() > 0.9


def test_a_highlight_that_skin_reaches_by_a_narrow_way_is_hair():
    labels, photo = head_of(60)
    photo[40:55, 80:120] = photo[40:80, 99:102] = COLORS[SKIN]
    assert (refine(labels, photo).labels[40:55, 80:98] == HAIR).all()
    photo[55:80, 80:120] = COLORS[SKIN]  # a broad one is a bald top
    assert (refine(labels, photo).labels[45:55, 85:115] == SKIN).all()


def test_blond_hair_is_not_shaved_and_a_shaved_head_is():
    labels, photo = head_of()
    photo[labels == HAIR] = np.array(COLORS[SKIN]) - 0.02
    assert not (refine(labels, photo).regions == HAIR).any()
    streaks = np.random.default_rng(0).uniform(0.5, 1, (1, 200, 1)).astype(np.float32)
    photo = np.where((labels == HAIR)[..., None], photo * streaks, photo)
    assert (refine(labels, photo).labels == labels).all()


def test_a_larger_photo_is_refined_alike():
    labels, photo = head_of()
    photo[20:40, 70:130] = COLORS[SKIN]
    twice = [np.repeat(np.repeat(plane, 8, 0), 8, 1) for plane in (labels, photo)]
    small = refine(labels, photo, 90.0)
    points = points_with_eyes(90.0) * 8
    large = refined(Segmentation(twice[0], (twice[0] == SKIN).astype(np.float32)), twice[1], points)
    differ = large.labels[4::8, 4::8] != small.labels
    assert differ.mean() < 0.005  # a pixel along the borders


def test_without_hair_nothing_changes():
    labels = np.full((40, 40), SKIN, np.uint8)
    segmentation = Segmentation(labels, np.ones((40, 40), np.float32))
    found = refined(segmentation, photo_of(labels), points_with_eyes(20.0))
    assert (found.labels == labels).all() and (found.skin == 1).all()


def with_glasses(rim, brow=SKIN_TONE, thick=3):
    """A face at 1.6 pixels a millimetre, a rim around each lens, and a band [H, W] that is labelled glasses."""
    scale = 1.6
    points = points_with_eyes(90.0 * scale)
    labels = np.full((220, 320), SKIN, np.uint8)
    photo = np.full((220, 320, 3), SKIN_TONE, np.float32)
    band = np.zeros(labels.shape, np.uint8)
    for middle, brow_points in ((70, BROW_RIGHT), (180, BROW_LEFT)):
        box = (middle - 32, 82), (middle + 32, 128)
        points[brow_points, 0] = np.linspace(middle - 25, middle + 25, 10)
        points[brow_points, 1] = np.where(np.arange(10) % 2, 70, 78)
        cv2.rectangle(photo, (middle - 25, 70), (middle + 25, 78), brow, -1)
        cv2.rectangle(photo, *box, rim, thick)
        cv2.rectangle(band, *box, 1, 15)
        lens = np.zeros(labels.shape, np.uint8)
        cv2.rectangle(lens, *box, 1, -1)
        labels[lens > 0] = LENS
    labels[(band > 0) & (labels == SKIN)] = GLASSES
    regions = np.where(band > 0, GLASSES, SKIN).astype(np.uint8)
    skin = cv2.erode((band == 0).astype(np.uint8), np.ones((9, 9), np.uint8)).astype(np.float32)
    true = np.abs(photo - SKIN_TONE).max(-1) > 0.02
    return photo, Segmentation(labels, skin, regions), points, true


def test_a_rim_in_a_grainy_photo_is_found_whole():
    photo, segmentation, points, true = with_glasses((0.6, 0.45, 0.3), thick=2)
    grain = np.random.default_rng(3).normal(0, 0.06, photo.shape)
    found = refined(segmentation, np.clip(photo + grain, 0, 1).astype(np.float32), points)
    assert (found.regions == GLASSES)[true].mean() > 0.9


@pytest.mark.parametrize("rim", [(0.1, 0.1, 0.12), (0.75, 0.65, 0.2), (0.95, 0.95, 0.98)])
def test_rims_are_cut_to_their_width(rim):
    photo, segmentation, points, true = with_glasses(rim)
    found = refined(segmentation, photo, points)
    worn = found.regions == GLASSES
    assert worn[true].all() and (found.labels[true] == GLASSES).all()
    around = cv2.dilate(true.astype(np.uint8), np.ones((9, 9), np.uint8)) > 0
    assert not worn[~around].any() and (found.regions[~around] == SKIN).all()
    assert (
        found.skin[~(cv2.dilate(true.astype(np.uint8), np.ones((13, 13), np.uint8)) > 0)].min() == 1
    )
    assert found.skin[true].max() == 0


def test_brows_above_a_rim_are_kept():
    photo, segmentation, points, _ = with_glasses((0.1, 0.1, 0.12), (0.4, 0.3, 0.25))
    found = refined(segmentation, photo, points)
    assert (found.regions[70:76, 50:90] == SKIN).mean() > 0.9


def test_lenses_that_mirror_stay_hidden():
    photo, segmentation, points, _ = with_glasses((0.1, 0.1, 0.12))
    regions = segmentation.regions.copy()
    regions[84:126, 40:100] = GLASSES
    photo[84:126, 40:100] = (0.7, 0.8, 0.95)
    mirrored = Segmentation(segmentation.labels, segmentation.skin, regions)
    assert (refined(mirrored, photo, points).regions[86:124, 42:98] == GLASSES).all()


def test_the_top_of_an_ear_that_is_labelled_hair_is_ear():
    """It goes on from what is labelled ear and has its colour; hair beside has not."""
    labels, photo = head_of()
    labels[110:150, 40:52] = EARS
    photo[103:150, 40:52] = (0.7, 0.45, 0.4)  # 14 mm around it are looked at
    found = refine(labels, photo)
    assert (found.labels[104:150, 42:50] == EARS).all() and (
        found.regions[104:150, 42:50] == SKIN
    ).all()
    assert (found.labels[60:101, 40:66] == HAIR).all()
    photo[103:110, 40:52] = COLORS[HAIR]
    assert (refine(labels, photo).labels == labels).all()
