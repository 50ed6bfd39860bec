"""What the texture is made of lies where its camera says."""

from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from bakery.geometry import camera as cameras
from bakery.geometry.color import LUMA, to_encoded
from bakery.geometry.sample import bilinear
from bakery.stages.atlas import make_atlas
from bakery.stages.texture.hair import Mattes
from bakery.stages.texture.neutral import _cut_out, _lit_strip
from bakery.types import Camera, Fit, Photo

REST = np.zeros(52, np.float32)


@pytest.mark.parametrize("resolution", [512, 701, 1024])
def test_the_head_cut_out_of_a_photo(head, resolution):
    """Each colour of a ramp says its own place in the photo."""
    down, across = (np.mgrid[:1201, :1203] + 0.5) / 1204
    photo = Photo(to_encoded(np.stack([across, down, across], -1)).astype(np.float32), "")
    away = np.array([0.0, 0.0, -700.0])
    camera = Camera(3100.0, np.array([611.0, 583.0]), np.zeros(3), away, 1203, 1201)
    marks = cameras.project(head.landmarks(head.mean), camera)
    fit = Fit(
        head.name, camera, np.zeros(1), REST, np.zeros(2), np.zeros((9, 3)), np.zeros(0),
        np.zeros((468, 3)), marks,
    )  # fmt: skip
    bare = np.ones((1201, 1203), np.float32)
    image, mattes, points, local = _cut_out(
        photo, Mattes(*[bare] * 7), marks, fit, head, head.mean, resolution
    )
    assert image.shape[:2] == mattes.skin.shape == (local.camera.height, local.camera.width)
    assert local.camera.focal <= camera.focal
    here = cameras.project(head.landmarks(head.mean), local.camera)
    assert_allclose(here, points, atol=1e-6)
    # OpenCV's averages are off by 0.1 pixels; sides of whole pixels were by 0.9 to 1.8.
    assert_allclose(bilinear(image, here)[:, :2] * 1204, marks, atol=0.2)


def test_skin_shown_with_the_hair_is_lit_as_the_skin_beside_it(head):
    atlas = make_atlas(head, 64).take("skin")
    half = np.zeros((20, 20), np.float32)
    half[:, :10] = 1  # strip of skin on the left, strands on the right
    pixels = np.tile([[5.0, 10.0], [15.0, 10.0]], (len(atlas.index), 1))[: len(atlas.index)]
    view = SimpleNamespace(
        on_skin=atlas,
        visibility=SimpleNamespace(pixels=pixels, visible=np.ones(len(pixels))),
        mattes=SimpleNamespace(strip=half, hair=1 - half),
    )
    over, lift = np.full((64, 64, 4), 0.2, np.float32), np.zeros((64, 64), np.float32)
    lift[::8, ::8] = np.log(1.2)  # known here and there, continued between
    texture = np.full((64, 64, 3), 1.2, np.float32)  # grey as the layer is: the tint stays
    out = _lit_strip(over, lift, texture, view)
    rows = out.reshape(-1, 4)[atlas.index]
    np.testing.assert_allclose(rows[0::2, :3], 0.24, rtol=0.01)
    np.testing.assert_allclose(rows[1::2, :3], 0.2, rtol=0.01)
    np.testing.assert_allclose(out[..., 3], over[..., 3], rtol=1e-6)
    # Of a deep shadow the strip is not shown, for it would be red; the strands are.
    rows = _lit_strip(over, lift / np.log(1.2) * np.log(2), texture, view).reshape(-1, 4)[
        atlas.index
    ]
    np.testing.assert_allclose(rows[0::2], 0, atol=1e-6)
    np.testing.assert_allclose(rows[1::2], 0.2, rtol=0.01)
    # Its tint is that of the skin below, its lightness its own.
    texture *= np.array([1.5, 1.0, 0.8], np.float32)
    rows = _lit_strip(over, 0 * lift, texture, view).reshape(-1, 4)[atlas.index]
    np.testing.assert_allclose(rows[0::2, 0] / rows[0::2, 1], 1.5, rtol=0.02)
    np.testing.assert_allclose(np.exp(np.log(rows[0::2, :3]) @ LUMA), 0.2, rtol=0.02)
    np.testing.assert_allclose(rows[1::2], 0.2, rtol=0.01)
    # Glare of a lamp is taken down to a little more than the skin below, and is not shown where it is much.
    for log, left, shown in ((0.2, 0.2, 1), (0.4, 0.25, 0.86), (1.0, 0, 0)):
        grey = np.full_like(texture, np.exp(-log))
        rows = _lit_strip(over, 0 * lift, grey, view).reshape(-1, 4)[atlas.index]
        np.testing.assert_allclose(rows[0::2, 3], 0.2 * shown, atol=0.01)
        if shown:
            color = rows[0::2, :3] / rows[0::2, 3:]
            np.testing.assert_allclose(color, np.exp(left - log), rtol=0.01)
        np.testing.assert_allclose(rows[1::2], 0.2, rtol=0.01)
    # What lies behind the strip, on the back of the head, is none of it.
    view.visibility.visible[:] = 0
    np.testing.assert_array_equal(_lit_strip(over, lift, texture, view), over)


@pytest.mark.parametrize(
    "darker, hair, lifted", [(0.1, 0.0, 0.0), (0.25, 0.0, 0.13), (0.6, 0.0, 0.2), (0.6, 0.5, 0.0)]
)
def test_skin_beside_hair_is_no_stain_and_a_fringe_keeps_its_shade(head, darker, hair, lifted):
    atlas = make_atlas(head, 64).take("skin")
    strands = np.arange(len(atlas.index)) % 2 * hair * 2  # as much as one texel in two
    pixels = np.stack([np.where(strands > 0, 15.0, 5.0), np.full(len(strands), 10.0)], 1)
    half = np.zeros((20, 20), np.float32)
    half[:, :10] = 1
    view = SimpleNamespace(
        on_skin=atlas,
        visibility=SimpleNamespace(pixels=pixels, visible=np.ones(len(pixels))),
        mattes=SimpleNamespace(strip=half, hair=1 - half),
    )
    over = np.full((64, 64, 4), [0.2, 0.2, 0.2, 1.0], np.float32)
    texture = np.full((64, 64, 3), 0.2 * np.exp(darker), np.float32)
    out = _lit_strip(over, np.zeros((64, 64), np.float32), texture, view).reshape(-1, 4)
    strip = out[atlas.index][strands == 0]
    inner = np.median(np.log(strip[:, 0] / 0.2))  # beside the charts' borders less is around
    assert_allclose(inner, lifted, atol=0.01)
