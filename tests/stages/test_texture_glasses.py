"""Frames of glasses as a layer over the skin."""

import numpy as np
from numpy.testing import assert_allclose

from bakery.stages.atlas import Visibility, make_atlas
from bakery.stages.texture.glasses import frame_layer, laid_over


def test_a_frame_lies_on_the_skin_that_sees_the_camera(head):
    atlas = make_atlas(head, 128).take("skin")
    count = len(atlas.index)
    pixels = np.full((count, 2), 5.5, np.float32)
    pixels[: count // 2] = 20.5
    cosine = np.ones(count)
    cosine[::2] = 0.0
    picture = np.full((32, 32, 3), 0.2, np.float32)
    frame = np.zeros((32, 32), np.float32)
    frame[16:, 16:] = 1
    seen = Visibility(pixels, cosine, np.ones(count, np.float32))
    layer = frame_layer(picture, frame, atlas, seen).reshape(-1, 4)[atlas.index]
    assert_allclose(layer[: count // 2][1::2], [[0.2, 0.2, 0.2, 1.0]] * (count // 4), atol=1e-6)
    assert layer[: count // 2][::2].max() == 0, "what is turned away shows none"
    assert layer[count // 2 :].max() == 0, "nor does what lies beside the frame"


def test_laid_over():
    hair = np.array([[[0.4, 0.4, 0.4, 0.8]]], np.float32)
    none, full = np.zeros((1, 1, 4), np.float32), np.array([[[0.1, 0.2, 0.3, 1.0]]], np.float32)
    assert_allclose(laid_over(hair, none), hair)
    assert_allclose(laid_over(hair, full), full)
    assert_allclose(laid_over(hair, 0.5 * full), [[[0.25, 0.3, 0.35, 0.9]]])
