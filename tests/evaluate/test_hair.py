"""Hair in the own photo: drawing, means, and the backdrop that an avatar is laid over."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from bakery.evaluate.hair.drawing import CardHair, draw_hair
from bakery.evaluate.hair.outlines import overlap, summary
from bakery.evaluate.hair.whole import SIDE, backdrop, contrast, from_behind
from bakery.evaluate.hair.whole import summary as whole_summary
from bakery.geometry.color import to_encoded
from bakery.types import Camera, HairMesh

CAMERA = Camera(100.0, np.array([20.0, 20.0]), np.zeros(3), np.array([0, 0, -100.0]), 40, 40)


def cards(colors, depths, kind=1):
    """Squares of 20 mm, one behind the other, each with one colour [r, g, b, alpha] of the atlas."""
    count = len(colors)
    square = np.array([[-10, 10, 0], [10, 10, 0], [10, -10, 0], [-10, -10, 0]], np.float32)
    corners = np.array([[0, 2, 1], [0, 3, 2]], np.int32)
    texture = np.zeros((8, 8, 4), np.float16)
    for k, color in enumerate(colors):
        texture[:, 2 * k : 2 * k + 2] = np.array(color) * [*[color[3]] * 3, 1]
    middle = [np.full((4, 2), [(2 * k + 1) / 8, 0.5]) for k in range(count)]
    return HairMesh(
        np.concatenate([square + [0, 0, z] for z in depths]).astype(np.float32),
        np.concatenate([corners + 4 * k for k in range(count)]).astype(np.int32),
        np.concatenate(middle).astype(np.float32), np.full(2 * count, kind, np.uint8),
        np.repeat(np.arange(count) if kind else [-1] * count, 2).astype(np.int32),
        np.ones(2 * count, np.uint8), np.zeros(4 * count, np.float32), texture,
        np.zeros((8, 8, 2), np.float16), np.zeros((8, 8), np.float16), np.zeros((8, 8), np.uint8),
    )  # fmt: skip


def drawn(mesh, wall=np.inf):
    """Straight sRGB colour and alpha."""
    picture = draw_hair(mesh, CAMERA, np.full((40, 40), wall))
    alpha = picture[..., 3]
    return to_encoded(picture[..., :3] / np.maximum(alpha, 1e-6)[..., None]), alpha


def test_the_nearer_card_lies_over_the_farther_one_in_any_order():
    red, blue = (1, 0, 0, 0.5), (0, 0, 1, 0.5)
    for colors, depths in (((red, blue), (0, 20)), ((blue, red), (20, 0))):
        color, alpha = drawn(cards(colors, depths))
        # Mixed in sRGB: half blue over half red that nothing lies behind.
        np.testing.assert_allclose(color[20, 17], np.array([0.25, 0, 0.5]) / 0.75, atol=2e-3)
        assert abs(alpha[20, 17] - 0.75) < 1e-3 and alpha[2, 2] == 0


def test_what_lies_behind_the_head_is_not_drawn():
    assert drawn(cards([(1, 0, 0, 1)], [0]), wall=90)[1].max() == 0
    assert drawn(cards([(1, 0, 0, 1)], [0]), wall=110)[1].max() == 1


def test_the_cap_is_seen_where_nothing_hides_it():
    cap = cards([(0, 1, 0, 1)], [0], kind=0)
    color, alpha = drawn(cap)
    np.testing.assert_allclose(color[20, 20], [0, 1, 0], atol=1e-3)
    assert alpha[20, 20] == 1
    assert drawn(cap, wall=90)[1].max() == 0


def test_the_depth_of_cards_is_that_of_what_is_seen():
    """An opaque card hides the depth behind it; a clear one lets half of it through."""
    wall = np.full((40, 40), np.inf)
    for kind in (0, 1):
        seen = CardHair(cards([(1, 1, 1, 1)], [0], kind)).seen(CAMERA, wall)
        np.testing.assert_allclose(seen.depth[seen.there], 100, atol=0.05)
    front = CardHair(cards([(1, 1, 1, 1), (1, 1, 1, 1)], [0, 20])).seen(CAMERA, wall)
    assert abs(front.depth[20, 20] - 80) < 0.05
    half = CardHair(cards([(1, 1, 1, 1), (1, 1, 1, 0.5)], [0, 20])).seen(CAMERA, wall)
    assert abs(half.depth[20, 17] - 90) < 0.2 and half.there[20, 17]


def test_overlap_and_means():
    one, other = np.zeros((4, 4), bool), np.zeros((4, 4), bool)
    one[:2], other[1:3] = True, True
    assert overlap(one, other) == round(1 / 3, 4) and overlap(one & False, other & False) == 1
    row = {"bare": 0.8, "bare_outside": 0.5, "outside": 0.9, "seconds": 3.0}
    rows = [{"photo": str(iou), "iou": iou, "triangles": [n, 2, 1]} | row
            for n, iou in ((5, 0.9), (7, 0.7))]  # fmt: skip
    found = summary(rows)
    assert found["iou"] == 0.8 and found["worst"] == "0.7" and found["most_triangles"] == [7, 2, 1]
    assert summary([]) == {"photos": 0}
    rows = [{"photo": name, "psnr": psnr, "layer": 17.0, "share": 0.9, "photographed": spread, "behind": None}
            for name, psnr, spread in (("a", 20.0, 0.8), ("b", 24.0, None))]  # fmt: skip
    assert whole_summary(rows) == {
        "photos": 2, "psnr": 22.0, "layer": 17.0, "share": 0.9, "photographed": 0.8, "behind": None, "worst": "a",
    }  # fmt: skip
    assert whole_summary([]) == {"photos": 0}


def test_contrast_is_that_of_hair_alone():
    level = np.random.default_rng(2).normal(-2, 0.4, (60, 60))
    level[:20] = 3.0  # a wall; beside it lies what hair and wall share
    picture = np.exp(level)[..., None].repeat(3, 2)
    where = np.arange(60)[:, None].repeat(60, 1) >= 18
    assert contrast(picture, where) == pytest.approx(0.4, rel=0.1)
    assert contrast(2 * picture, where) == pytest.approx(contrast(picture, where), abs=1e-3)
    assert contrast(picture, where & (np.arange(60) < 6)) is None


def test_the_back_of_a_bundle_has_hair(avatar):
    bald = replace(avatar, textures=replace(avatar.textures, hair_mesh=None))
    picture, where = from_behind(avatar, bald)
    assert picture.shape == (SIDE, SIDE, 3) and where.shape == (SIDE, SIDE)
    assert where.any() == (avatar.textures.hair_mesh is not None)
    assert not from_behind(bald, bald)[1].any()


def test_the_backdrop_goes_on_behind_the_person():
    """A slope of light is found again where a black figure stood, to 2% of the white."""
    y, x = np.mgrid[:120, :100] / 120
    plain = np.repeat((0.5 + 0.2 * y + 0.1 * x)[..., None], 3, 2).astype(np.float32)
    person = cv2.circle(np.zeros((120, 100), np.uint8), (50, 60), 25, 1, -1)
    photo = np.where(person[..., None] > 0, np.float32(0), plain)
    assert np.abs(backdrop(photo, person) - plain).mean() < 0.02
