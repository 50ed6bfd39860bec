"""Unwrapping: texels, cameras and what a camera sees of them."""

import numpy as np
import pytest

from bakery.geometry.camera import project
from bakery.geometry.sample import bilinear
from bakery.stages.atlas import make_atlas, make_view, visibility_of
from bakery.stages.texture.proxies import eye_proxies, make_proxy
from bakery.types import Camera

FRONT = Camera(
    2000.0, np.array([256.0, 256.0]), np.zeros(3), np.array([0.0, 20.0, -1500.0]), 512, 512
)


@pytest.fixture(scope="module")
def atlas(head):
    return make_atlas(head, 256)


@pytest.fixture(scope="module")
def skin(atlas):
    return atlas.take("skin")


def test_texels_lie_where_their_uv_says(head, atlas):
    """Interpolating uv itself over the atlas gives each texel's own centre."""
    row, column = np.divmod(atlas.index, atlas.size)
    corners = head.uv[head.uv_faces[atlas.face]]
    uv = np.einsum("nk,nkc->nc", atlas.barycentric, corners)
    np.testing.assert_allclose(uv * atlas.size, np.stack([column, row], 1) + 0.5, atol=1e-3)


def test_a_picture_of_positions_unwraps_to_the_projection(head, skin):
    """A photo whose colour is its pixel position comes back as the projected surface point."""
    y, x = np.mgrid[:512, :512] + 0.5
    photo = np.stack([x, y, 0 * x], -1).astype(np.float32)
    visibility = visibility_of(skin, make_view(head.mean, head, FRONT))
    seen = visibility.weight() > 0.9
    assert seen.sum() > 2000
    want = project(skin.at(head.mean)[seen].astype(float), FRONT)
    # Bilinear sampling of a linear ramp is exact; remap's fixed-point weights are 1/32 of a pixel.
    np.testing.assert_allclose(bilinear(photo, visibility.pixels)[seen, :2], want, atol=0.05)


def test_only_the_near_side_is_seen(head, skin):
    weight = visibility_of(skin, make_view(head.mean, head, FRONT)).weight()
    points = skin.at(head.mean)
    behind = points[:, 2] < points[:, 2].min() + 40  # mm: the back of the head
    assert behind.any() and weight[behind].max() == 0
    nose = np.linalg.norm(points - head.landmarks(head.mean)[4], axis=1) < 6
    assert np.median(weight[nose]) > 0.9


def test_gutter_takes_the_nearest_colour(head, atlas):
    texture = atlas.paint(np.ones((len(atlas.index), 3), np.float32))
    filled = atlas.fill_gutter(texture)
    assert (filled[texture > 0] == 1).all()
    assert (filled > 0).sum() > (texture > 0).sum()
    assert set(np.unique(filled)) <= {0.0, 1.0}


def test_proxies_fill_their_rectangles(head):
    """A proxy's own uv, interpolated, runs over its rectangle; the sheet nearly fills it."""
    sheet = make_proxy(head, "mouth_sheet", 1024)
    assert sheet.inside.mean() > 0.9
    for cap in eye_proxies(head, 1024):
        assert 0.6 < cap.inside.mean() < 0.85  # a disc in a square: pi / 4
