"""What of a photo may become skin."""

import numpy as np

from bakery.stages.texture_complete import LIDS, LIPS, clear_of_hair, open_lids, rims


def points_with_eyes(gap=100.0):
    points = np.zeros((478, 2))
    points[33], points[263] = (50.0, 100.0), (50.0 + gap, 100.0)
    return points


def test_skin_keeps_clear_of_hair():
    """Seven pixels from hair nothing is taken, thirteen away all is: 100 pixels between the eyes."""
    hair = np.zeros((40, 60), bool)
    hair[:, :10] = True
    mask = clear_of_hair(np.ones((40, 60), np.float32), hair, points_with_eyes())
    assert mask[20, 10:16].max() == 0
    assert mask[20, 24:].min() == 1
    assert (np.diff(mask[20]) >= 0).all()


def test_no_hair_changes_nothing():
    skin = np.random.default_rng(0).random((30, 30)).astype(np.float32)
    np.testing.assert_array_equal(
        clear_of_hair(skin, np.zeros((30, 30), bool), points_with_eyes()), skin
    )


def eye_points():
    """Two round eyes of radius 10 at (40, 50) and (90, 50), and lips at (65, 100)."""
    points = np.zeros((478, 2))
    for ring, center in ((LIDS[1], (40, 50)), (LIDS[0], (90, 50)), (LIPS, (65, 100))):
        turn = np.linspace(0, 2 * np.pi, len(ring), endpoint=False)
        points[list(ring)] = np.stack([np.cos(turn), np.sin(turn)], 1) * 10 + center
    return points


def test_lids_open_up_to_their_edge():
    mask = open_lids(np.zeros((130, 130), np.float32), eye_points())
    assert mask[50, 40] == 0, "the eye itself is no skin"
    assert mask[38, 40] == 1, "the lid above it is"
    assert mask[20, 40] == 0, "the brow is left to the segmentation"


def test_rims_are_along_lids_and_lips():
    near = rims(eye_points(), (130, 130))
    assert near[50, 50] > 0.9 and near[100, 75] > 0.9
    assert near[50, 40] == 0 and near[75, 65] == 0
