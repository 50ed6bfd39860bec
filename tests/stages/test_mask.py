"""Activation masks."""

import numpy as np
import pytest

from bakery.stages.atlas import make_atlas
from bakery.stages.mask import activation_masks
from bakery.types import EXPRESSION_INDEX


@pytest.fixture(scope="module")
def masks(head):
    return activation_masks(head, make_atlas(head, 128))


def at(masks, head, name, landmark):
    """Mask of a shape at a landmark."""
    uv = head.uv[head.uv_faces[head.landmark_faces[landmark]]]
    column, row = (head.landmark_barycentric[landmark] @ uv * masks.shape[1]).astype(int)
    return masks[EXPRESSION_INDEX[name], row, column]


def test_masks_are_shares_of_the_largest_motion(masks):
    assert masks.shape == (52, 128, 128)
    assert masks.min() >= 0 and masks.max() <= 1
    # The blur of 1/256 of the side takes a little off every peak.
    assert masks[EXPRESSION_INDEX["jawOpen"]].max() > 0.85


@pytest.mark.parametrize(
    "name, moves, rests",
    [
        ("jawOpen", 152, 10),  # chin, not forehead
        ("browInnerUp", 107, 152),  # inner brow, not chin
        ("mouthSmileLeft", 291, 61),  # left corner, not the right one
        ("noseSneerRight", 49, 152),
    ],
)
def test_masks_are_where_the_shape_acts(masks, head, name, moves, rests):
    assert at(masks, head, name, moves) > 0.3
    assert at(masks, head, name, rests) < 0.12


def test_left_and_right_mirror(masks):
    """The atlas is mirrored, so a left mask flipped is the right one, up to blur and seams."""
    left = masks[EXPRESSION_INDEX["mouthSmileLeft"]]
    right = masks[EXPRESSION_INDEX["mouthSmileRight"]]
    assert np.abs(left[:, ::-1] - right)[:90].mean() < 0.01
