"""Picture measures, against closed forms."""

import cv2
import numpy as np
import pytest

from bakery.evaluate.avatar import CROP, compare, mean_score, plain_warp
from bakery.evaluate.metrics import (
    face_crop,
    hull_mask,
    mse,
    piecewise_affine,
    psnr,
    ssim,
    warp_pixels,
)

EVERYWHERE = np.ones((40, 40), bool)


def test_psnr_of_a_known_error():
    a = np.full((40, 40, 3), 0.5)
    assert psnr(a + 0.1, a, EVERYWHERE) == pytest.approx(20.0)  # -10 log10(0.01)
    assert mse(a + 0.1, a, EVERYWHERE) == pytest.approx(0.01)


def test_only_the_mask_counts():
    a = np.zeros((40, 40, 3))
    b = a.copy()
    b[:, 20:] = 1
    left = np.zeros((40, 40), bool)
    left[:, :15] = True
    assert mse(a, b, left) == 0


def test_ssim_is_one_for_equal_pictures_and_falls_with_noise():
    rng = np.random.default_rng(0)
    a = rng.random((40, 40, 3))
    assert ssim(a, a, EVERYWHERE) == pytest.approx(1.0)
    assert ssim(a, rng.random((40, 40, 3)), EVERYWHERE) < 0.3


def test_hull_of_a_square():
    mask = hull_mask(np.array([[10.0, 10], [30, 10], [30, 30], [10, 30], [20, 20]]), 40, 40)
    assert mask[20, 20] and not mask[5, 5] and abs(mask.sum() - 400) < 90  # border pixels


def test_crop_gives_the_face_its_share():
    points = np.array([[100.0, 200], [300, 600]])
    matrix = face_crop(points)
    moved = points @ matrix[:, :2].T + matrix[:, 2]
    assert np.ptp(moved[:, 1]) == pytest.approx(0.78 * CROP)
    np.testing.assert_allclose(moved.mean(0), CROP / 2)


def test_warp_pixels_moves_centres():
    image = np.zeros((20, 20), np.float32)
    image[4, 6] = 1  # centre (6.5, 4.5) goes to (11.5, 6.5)
    moved = warp_pixels(image, np.array([[1.0, 0, 5], [0, 1, 2]]), 20)
    assert moved[6, 11] == pytest.approx(1)


def test_piecewise_affine_by_a_shift_is_a_shift():
    y, x = np.mgrid[:40, :40].astype(np.float32)
    image = np.stack([x, y, x + y], -1)
    source = np.array([[5.0, 5], [35, 5], [35, 35], [5, 35], [20, 18]])
    out = piecewise_affine(image, source, source + [2, 3])
    np.testing.assert_allclose(out[20, 20], image[17, 18], atol=0.05)  # remap's 1/32 pixel


def test_a_perfect_picture_scores_perfectly():
    rng = np.random.default_rng(1)
    picture = cv2.GaussianBlur(rng.random((600, 600, 3)).astype(np.float32), (0, 0), 8)
    points = rng.uniform(150, 450, (478, 2))
    face = np.ones((600, 600))
    score = compare(picture, picture, points, face)
    assert score.hull_psnr > 100 and score.face_psnr > 100 and score.hull_ssim > 0.999
    warp = plain_warp(picture, points, picture, points, face)
    assert warp.hull_psnr > 40  # resampled by remap's 1/32 of a pixel
    assert mean_score([score, score]) == score
