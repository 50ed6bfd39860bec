"""The picture on the cards: strands that thin out, the person's colour, nothing beyond its place."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from bakery.geometry.color import LUMA
from bakery.heads.lashes import BANDS, card_texels, with_lashes
from bakery.landmarks import BROW_LEFT, BROW_RIGHT, LIDS_UPPER
from bakery.stages.texture.lashes import LIMITS, WEAKEST, lash_color, lay_lashes, presence

SIZE = 512
SKIN, BROW = np.array([0.5, 0.33, 0.25]), np.array([0.2, 0.1, 0.04])
WHITE = np.array([0.5, 0.48, 0.45])


@pytest.fixture(scope="module")
def own(head):
    return with_lashes(head, head.mean)[0]


def painted(own, brow=BROW, rim=None):
    """A texture of plain skin with brows, and dark rims of the lids if asked."""
    texture = np.tile(np.float32(SKIN), (SIZE, SIZE, 1))
    places = own.landmark_uv() * SIZE
    for marks in (BROW_LEFT, BROW_RIGHT):
        hull = cv2.convexHull(np.float32(places[marks])).astype(np.int32)
        cv2.fillPoly(texture, [hull], brow.tolist())
        cv2.polylines(texture, [hull], True, SKIN.tolist(), 3)  # skin shows between the hair
    for lid in LIDS_UPPER if rim is not None else ():
        cv2.polylines(texture, [places[lid].astype(np.int32)], False, (rim * SKIN).tolist(), 3)
    return texture


def sheet(own, texture):
    layer = lay_lashes(np.zeros((SIZE, SIZE, 4), np.float32), texture, own, WHITE)
    return layer, layer[card_texels(own, SIZE)]


def test_strands_are_dark_and_thin_out(own):
    texture = painted(own)
    layer, cards = sheet(own, texture)
    color = lash_color(texture, own)
    for name in ("upper", "lower"):
        first, last = (round(share * len(cards)) for share in BANDS[name])
        band = cards[first:last]
        alpha = band[..., 3]
        thirds = [part.mean() for part in np.array_split(alpha[1:], 3)]
        assert thirds[0] > 1.5 * thirds[1] > 2 * thirds[2] > 0, "from the root to the tip"
        assert alpha.max() < 1 and not alpha[:, 0].any() and not alpha[-1].any()
        assert alpha[1 : len(alpha) // 3].std(1).min() > 0.04, "strands, no bar"
        np.testing.assert_allclose(band[..., :3], alpha[..., None] * color, atol=1e-6)
    rest = layer.copy()
    rest[card_texels(own, SIZE)] = 0
    assert not rest.any(), "the hair layer stays as it was"


def test_the_tear_line_gleams_between_lid_and_eye(own):
    _, cards = sheet(own, painted(own))
    tear = cards[round(BANDS["tear"][0] * len(cards)) :]
    light = tear[..., :3] @ LUMA / np.maximum(tear[..., 3], 1e-6)
    middle = tear.shape[1] // 2
    assert light[:, middle].max() > WHITE @ LUMA > light[-1, middle], (
        "brighter, then darker than the eye"
    )
    assert tear[..., 3].max() < 0.6 and not tear[:, [0, -1], 3].any()


def test_the_colour_is_the_brows_but_never_black(own):
    brown = lash_color(painted(own), own)
    np.testing.assert_allclose(brown / (brown @ LUMA), BROW / (BROW @ LUMA), rtol=0.02)
    for brow in (np.zeros(3) + 1e-3, 0.9 * SKIN):
        light = lash_color(painted(own, brow), own) @ LUMA / (SKIN @ LUMA)
        assert LIMITS[0] - 1e-4 <= light <= LIMITS[1] + 1e-4


def test_weak_lashes_stay_weak(own):
    faint, strong = (presence(painted(own, rim=rim), own) for rim in (1.0, 0.1))
    assert faint == WEAKEST and strong > 0.9


def test_two_pictures_are_the_same(own):
    np.testing.assert_array_equal(*(sheet(own, painted(own))[0] for _ in range(2)))


def test_a_head_without_cards_keeps_its_layer(head):
    bare = replace(head, uv_rectangles={}, face_part=np.zeros_like(head.face_part))
    layer = np.ones((8, 8, 4), np.float32)
    assert lay_lashes(layer, np.ones((8, 8, 3), np.float32), bare, WHITE) is layer
