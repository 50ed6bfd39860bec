"""What of a photo may become skin."""

import numpy as np

from bakery.landmarks import EYE_LEFT, EYE_RIGHT, LIPS_INNER
from bakery.stages.texture.unwrap import open_lids, penumbra, rims


def eye_points():
    """Two round eyes of radius 10 at (40, 50) and (90, 50), and lips at (65, 100)."""
    points = np.zeros((478, 2))
    for ring, center in ((EYE_RIGHT, (40, 50)), (EYE_LEFT, (90, 50)), (LIPS_INNER, (65, 100))):
        turn = np.linspace(0, 2 * np.pi, len(ring), endpoint=False)
        points[ring] = np.stack([np.cos(turn), np.sin(turn)], 1) * 10 + center
    return points


def test_lids_open_up_to_their_edge():
    none = np.zeros((130, 130), np.float32)
    mask = open_lids(none, eye_points(), none)
    assert mask[50, 40] == 0, "the eye itself is no skin"
    assert mask[38, 40] == 1, "the lid above it is"
    assert mask[20, 40] == 0, "the brow is left to the segmentation"
    assert open_lids(none, eye_points(), none + 1).max() == 0, "nor does a lid behind dark glass"


def test_rims_are_along_lids_and_lips():
    near = rims(eye_points(), (130, 130))
    assert near[50, 50] > 0.9 and near[100, 75] > 0.9
    assert near[50, 40] == 0 and near[75, 65] == 0


def test_only_the_edge_of_a_shadow_is_left_out():
    shadow = np.zeros((512, 512), np.float32)
    shadow[200:300, 200:300] = 1
    edge = penumbra(shadow)
    assert edge[200, 250] == edge[299, 250] == edge[250, 199] == 1
    assert edge[250, 250] == edge[190, 250] == edge[0, 0] == 0
    assert penumbra(0 * shadow).max() == 0
