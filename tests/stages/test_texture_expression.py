"""The expression texture: its charts lie apart, and it reads back what a picture shows."""

import numpy as np

from bakery.geometry import camera as cameras
from bakery.geometry.color import to_encoded
from bakery.heads.base import PARTS, PROXIES
from bakery.stages.texture import expression as expressions
from bakery.synth.scene import portrait_camera


def test_every_part_has_its_place(head):
    atlas = expressions.expression_atlas(head, 128)
    for name in ("skin", *PROXIES):
        assert atlas.rows(name).any(), name
    row = atlas.index // 128
    skin = atlas.rows("skin")
    assert row[skin].max() < row[~skin].min(), "proxies lie below the skin"
    assert set(np.unique(atlas.part)) == {PARTS.index(name) for name in ("skin", *PROXIES)}


def test_the_square_holds_all_of_the_face(head):
    places = expressions._on_square(head.landmark_uv()[:468], expressions._window(head))
    assert places.min() >= 0 and places[:, 0].max() <= 1
    assert places[:, 1].max() <= expressions.SKIN_HEIGHT


def test_mouth_and_eyes_count_ten_times(head):
    weight = expressions.feature_weight(head, 128)
    assert set(np.unique(weight)) == {0, 1, expressions.FEATURES}
    mouth = expressions.mouth_texels(head, 128)
    assert (weight[mouth & (weight > 0)] == expressions.FEATURES).all()


def test_a_picture_of_places_is_read_where_they_are(head):
    """A picture whose colour is its pixel position comes back as the projection itself."""
    camera = portrait_camera(200, 200)
    y, x = np.mgrid[:200, :200] + 0.5
    picture = (np.stack([x, y, 0 * x], -1) / 200).astype(np.float32)
    texture, seen = expressions.read_texture(picture, camera, head, head.mean, None, 64)
    atlas = expressions.expression_atlas(head, 64)
    pixels = cameras.project(atlas.at(head.mean), camera)
    wanted = atlas.paint(np.concatenate([pixels / 200, 0 * pixels[:, :1]], 1).astype(np.float32))
    sure = seen > 0.999
    assert sure.mean() > 0.3
    np.testing.assert_allclose(texture[sure], to_encoded(wanted[sure]), atol=0.01)


def test_what_a_mask_hides_is_not_seen(head):
    camera = portrait_camera(120, 120)
    left = np.ones((120, 120), np.float32)
    left[:, 60:] = 0
    picture = np.full((120, 120, 3), 0.3, np.float32)

    def seen(known):
        return expressions.read_texture(picture, camera, head, head.mean, None, 64, known)[1]

    whole, half = seen(None), seen(left)
    np.testing.assert_array_equal(half[:40, :28], whole[:40, :28])
    assert min(whole[:40, :28].sum(), whole[:40, 36:].sum()) > 20, "both halves are seen"
    assert half[:40, 36:].max() < 0.01
