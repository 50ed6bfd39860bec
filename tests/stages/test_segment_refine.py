"""Labels of glasses that the photo's colours contradict."""

import cv2
import numpy as np
import pytest

from bakery.landmarks import BROW_LEFT, BROW_RIGHT
from bakery.stages.segment import BACKGROUND, GLASSES, HAIR, LENS, SKIN, Segmentation
from bakery.stages.segment.refine import refined

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


def test_without_glasses_nothing_changes():
    labels = np.full((40, 40), SKIN, np.uint8)
    labels[:20] = HAIR
    segmentation = Segmentation(labels, np.ones((40, 40), np.float32))
    found = refined(segmentation, photo_of(labels), points_with_eyes(20.0))
    assert (found.labels == labels).all() and (found.skin == 1).all()


def with_glasses(rim, brow=SKIN_TONE, thick=3):
    """A face at 1.6 pixels a millimetre, a rim around each lens, labelled so, and a wider region [H, W] of glasses."""
    scale = 1.6
    points = points_with_eyes(90.0 * scale)
    labels = np.full((220, 320), SKIN, np.uint8)
    photo = np.full((220, 320, 3), SKIN_TONE, np.float32)
    band, told = np.zeros((2, *labels.shape), np.uint8)
    for middle, brow_points in ((70, BROW_RIGHT), (180, BROW_LEFT)):
        box = (middle - 32, 82), (middle + 32, 128)
        points[brow_points, 0] = np.linspace(middle - 25, middle + 25, 10)
        points[brow_points, 1] = np.where(np.arange(10) % 2, 70, 78)
        cv2.rectangle(photo, (middle - 25, 70), (middle + 25, 78), brow, -1)
        cv2.rectangle(photo, *box, rim, thick)
        cv2.rectangle(band, *box, 1, 15)
        cv2.rectangle(told, *box, 1, thick + 2)
        lens = np.zeros(labels.shape, np.uint8)
        cv2.rectangle(lens, *box, 1, -1)
        labels[lens > 0] = LENS
    labels[told > 0] = GLASSES
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


def test_a_labelled_rim_of_the_skins_colour_hides_the_face():
    photo, segmentation, points, _ = with_glasses(SKIN_TONE)
    told = segmentation.labels == GLASSES
    found = refined(segmentation, photo, points)
    assert (found.regions == GLASSES)[told].all() and found.skin[told].max() == 0


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


def test_a_rim_is_followed_where_its_label_ends():
    """The lower half of one rim is labelled skin; it lies beside the lens."""
    photo, segmentation, points, true = with_glasses((0.1, 0.1, 0.12))
    labels, regions = segmentation.labels.copy(), segmentation.regions.copy()
    low = np.zeros(labels.shape, bool)
    low[110:150, 130:250] = True
    lens = np.zeros(labels.shape, np.uint8)
    cv2.rectangle(lens, (148, 82), (212, 128), 1, -1)
    labels[low & (labels == GLASSES)] = SKIN
    labels[low & (lens > 0)] = LENS
    regions[low & (regions == GLASSES)] = SKIN
    skin = np.where(low, 1, segmentation.skin).astype(np.float32)
    found = refined(Segmentation(labels, skin, regions), photo, points)
    assert (found.regions == GLASSES)[true].mean() > 0.98
    assert found.skin[true].max() < 0.5
