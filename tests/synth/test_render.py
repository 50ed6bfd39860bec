"""Painted pictures: truth, masks, sameness."""

from dataclasses import replace

import numpy as np
import pytest

from bakery.geometry.camera import project
from bakery.heads.base import weights
from bakery.synth.render import paint
from bakery.synth.subject import CLOTHES, HAIR_STYLES


def test_landmarks_are_the_projected_embedding(head, subject, scene, picture):
    want = project(head.landmarks(head.neutral(subject.identity)), scene.camera)
    np.testing.assert_allclose(picture.landmarks, want, atol=0.05)  # gaze moves nothing here
    inside = (picture.landmarks > 0).all(1) & (picture.landmarks < [200, 250]).all(1)
    assert inside.all()


def test_masks_share_out_every_pixel(picture):
    total = sum(picture.masks.values())
    assert total.shape == (250, 200)
    inside = np.abs(total - 1) < 0.02
    assert inside.mean() > 0.995  # lashes and brows are no class of their own
    column, row = np.round(picture.landmarks[5]).astype(int)  # the nose's ridge
    assert picture.masks["skin"][row, column] > 0.99
    assert picture.masks["background"][2, 2] == 1
    assert picture.masks["hair"].max() > 0.9 and picture.masks["clothes"][-3, 100] > 0.9


def test_parts_have_their_colours(picture):
    """Skin redder than blue, the background blue as asked, black hair darker than skin."""
    mean = {
        name: np.average(picture.encoded.reshape(-1, 3), axis=0, weights=mask.ravel())
        for name, mask in picture.masks.items()
        if mask.any()
    }
    assert mean["skin"][0] > mean["skin"][1] > mean["skin"][2]
    assert mean["background"][2] > 2 * mean["background"][0]
    assert mean["hair"].mean() < 0.6 * mean["skin"].mean()


def test_light_comes_from_its_side(picture):
    """The lamp stands on the picture's left: that cheek is brighter."""
    left, right = np.round(picture.landmarks[[50, 280]]).astype(int)
    bright = picture.encoded[left[1] - 2 : left[1] + 3, left[0] - 2 : left[0] + 3].mean()
    dim = picture.encoded[right[1] - 2 : right[1] + 3, right[0] - 2 : right[0] + 3].mean()
    assert bright > 1.25 * dim


def test_same_seed_same_picture(wardrobe, scene, picture):
    again = paint(wardrobe, scene, supersample=2, quality=0.3)
    np.testing.assert_array_equal(again.encoded, picture.encoded)


def test_open_mouth_moves_the_chin_and_shows_the_mouth(wardrobe, scene, picture):
    opened = paint(wardrobe, replace(scene, expression=weights({"jawOpen": 1.0})), 1, 0.2)
    assert opened.landmarks[152, 1] > picture.landmarks[152, 1] + 5
    assert opened.masks["mouth"].sum() > picture.masks["mouth"].sum() + 50


@pytest.mark.parametrize("style", HAIR_STYLES)
def test_every_style_grows(head, subject, style):
    from bakery.synth.chart import chart_of
    from bakery.synth.hair import grow_scalp
    from bakery.synth.roots import scalp_mask

    chart = chart_of(head, 1.2)
    person = replace(subject, hair=style)
    hair = grow_scalp(head, chart, person, scalp_mask(chart, person), head.mean, 0.02)
    assert np.isfinite(hair.points).all()
    assert 200 < len(hair.points) and np.abs(hair.points).max() < 400


@pytest.mark.parametrize("clothes", CLOTHES)
def test_clothes_hide_where_the_head_ends(head, subject, clothes):
    from bakery.synth.garment import make_garment

    shirt = make_garment(head, replace(subject, clothes=clothes), head.mean)
    assert np.isfinite(shirt.vertices).all() and shirt.faces.max() < len(shirt.vertices)
    low = head.mean[head.faces][..., 1].max(1) < head.mean[:, 1].min() + 10
    assert shirt.covered[low].all()
    assert not shirt.covered[head.landmark_faces].any()
