"""Smooth completion and seamless noise."""

import cv2
import numpy as np
import pytest

from bakery.geometry.fill import (
    around,
    blurred,
    diffuse,
    enclosed,
    normalized_blur,
    normalized_blur_reference,
    smoothstep,
    sparse_blur,
)
from bakery.geometry.noise import value_noise


def test_diffuse_keeps_what_is_known_and_continues_it():
    y, x = np.mgrid[:64, :64]
    values = np.stack([x, y], -1).astype(np.float32) / 64
    weight = np.ones((64, 64), np.float32)
    weight[20:40, 20:40] = 0
    out = diffuse(np.where(weight[..., None] > 0, values, 9.0), weight)
    np.testing.assert_array_equal(out[weight > 0], values[weight > 0])
    # A plane over a hole a third of the picture wide: pull-push is no exact solver, 0.1 is 6 pixels.
    np.testing.assert_allclose(out, values, atol=0.1)


def test_diffuse_of_a_constant_is_the_constant():
    weight = np.zeros((50, 70), np.float32)
    weight[3, 4] = 1
    out = diffuse(np.full((50, 70, 1), 0.25, np.float32), weight)
    np.testing.assert_allclose(out, 0.25, rtol=1e-4)


def test_smoothstep_may_fall():
    np.testing.assert_allclose(smoothstep(1, 0, np.array([0, 0.5, 1])), [1, 0.5, 0])


def test_value_noise_has_unit_variance_and_is_a_function_of_place():
    points = np.random.default_rng(0).uniform(-100, 100, (50_000, 3))
    noise = value_noise(points, 3.0, seed=5)
    assert abs(noise.mean()) < 0.03 and abs(noise.var() - 1) < 0.05  # 50,000 samples, correlated
    np.testing.assert_array_equal(noise[:10], value_noise(points[:10], 3.0, seed=5))
    assert np.abs(noise - value_noise(points, 3.0, seed=6)).mean() > 0.5


def test_around_holds_the_mask_and_a_margin():
    mask = np.zeros((40, 60), bool)
    mask[10:12, 50:58] = True
    rows, columns = around(mask, 2.5)
    assert (rows.start, rows.stop) == (7, 15)
    assert (columns.start, columns.stop) == (47, 61)  # beyond the picture: it ends with it
    assert mask[rows, columns].sum() == mask.sum()


def test_what_is_enclosed():
    """A ring's inside is; a bay that is open to the picture's edge is not."""
    mask = np.zeros((12, 12), bool)
    mask[:, 8:] = True
    mask[2:5, 2:5] = True
    mask[10, 8:] = mask[7, 4] = True
    found = enclosed(mask)
    assert found[2:5, 2:5].all() and found[7, 4] and found.sum() == 10
    assert not enclosed(np.ones((4, 4), bool)).any() and not enclosed(np.zeros((4, 4), bool)).any()


def test_weights_that_rounding_leaves_below_nothing_say_nothing():
    """1 - 1.0000001 as a weight made colours of 1e3 beside a beard, which then were taken for shadows."""
    values = np.random.default_rng(0).uniform(0, 1, (32, 32, 1)).astype(np.float32)
    weight = np.zeros((32, 32), np.float32)
    weight[4:8, 4:8] = 1
    wanted = diffuse(values, weight)
    weight[weight == 0] = -1.2e-7
    np.testing.assert_array_equal(diffuse(values, weight), wanted)


WIDE = 8.0  # pixels; from there on blurs are done at a smaller size


@pytest.mark.parametrize("sigma", [0.6, 2.0, 5.3, 17.0])
@pytest.mark.parametrize(
    "place", [np.s_[30:52, 40:45], np.s_[:9, 70:], np.s_[:, 50:51], np.s_[:0, :0]]
)
def test_blurs_look_only_where_there_is_something(place, sigma):
    """What a blur of the whole picture gives, at its borders too: to the bit, if it is narrow."""
    rng = np.random.default_rng(5)
    weight = np.zeros((96, 83), np.float32)
    weight[place] = rng.random(weight[place].shape)
    values = rng.normal(size=(96, 83, 3)).astype(np.float32)
    colors = values * weight[..., None]
    for some in (weight, colors):
        np.testing.assert_array_equal(sparse_blur(some, sigma), blurred(some, sigma))
    if sigma < WIDE:
        for some in (weight, colors):
            np.testing.assert_array_equal(
                blurred(some, sigma), cv2.GaussianBlur(some, (0, 0), sigma)
            )
    for some in (values, values[..., 0], values.astype(np.float64)):
        found = normalized_blur(some, weight, sigma)
        wanted = normalized_blur_reference(some, weight, sigma)
        assert found.dtype == wanted.dtype
        if sigma < WIDE:
            np.testing.assert_array_equal(found, wanted)


@pytest.mark.parametrize("sigma", [8.0, 9.0, 14.6, 41.0])
def test_wide_blurs_are_those_of_the_full_size(sigma):
    border = int(4 * sigma)  # how what lies beyond the picture is mirrored is not looked at
    y, x = np.mgrid[-border : 301 + border, -border : 240 + border]
    for edge in (x > 97, np.hypot(x - 110, y - 140) < 60, (y + x) % 160 < 80):
        picture = edge.astype(np.float32)
        off = blurred(picture, sigma) - cv2.GaussianBlur(picture, (0, 0), sigma)
        assert np.abs(off[border:-border, border:-border]).max() < 0.005
    noise = np.random.default_rng(2)
    values = noise.normal(size=(301, 240, 3)).cumsum(0).astype(np.float32)
    known = np.zeros((301, 240), np.float32)
    known[20:280, 30:200] = 1
    made, exact = (
        blur(values, known, sigma) for blur in (normalized_blur, normalized_blur_reference)
    )
    # A small picture's pixel is a quarter of the blur wide; the steepest slopes are those at the border.
    assert np.abs(made - exact)[known > 0].max() < 0.05 * values.std()
