"""Does the avatar look like the person: back in its own photo, and smiling as the person smiles."""

from dataclasses import dataclass

import cv2
import numpy as np

from bakery.evaluate.metrics import (
    face_crop,
    hull_mask,
    mse,
    piecewise_affine,
    psnr,
    ssim,
    warp_pixels,
)

OUTER_LIPS = (
    61, 146, 91, 181, 84, 17, 314, 405, 321, 375, 291, 409, 270, 269, 267, 0, 37, 39, 40, 185,
)  # fmt: skip
CROP = 512  # pixels; the face's height takes 78% of it (metrics.face_crop)


@dataclass(frozen=True)
class Score:
    """One picture against the truth."""

    hull_psnr: float  # dB, inside the convex hull of the landmarks
    hull_ssim: float
    hull_mse: float  # of values 0..255
    lips_psnr: float  # dB, inside the outer lips


def compare(picture, truth, points):
    """Score a picture [H, W, 3] against the photo it should equal, both sRGB-encoded.

    Args:
        points: [L, 2] pixels, landmarks of the truth.
    """
    matrix = face_crop(points)
    a, b = (warp_pixels(np.asarray(p, np.float32), matrix, CROP) for p in (picture, truth))
    moved = points @ matrix[:, :2].T + matrix[:, 2]
    hull = hull_mask(moved, CROP, CROP)
    lips = polygon_mask(moved[list(OUTER_LIPS)])
    return Score(psnr(a, b, hull), ssim(a, b, hull), mse(a, b, hull) * 255**2, psnr(a, b, lips))


def polygon_mask(points):
    """Boolean [CROP, CROP]: inside a closed polygon [n, 2]."""
    mask = np.zeros((CROP, CROP), np.uint8)
    cv2.fillPoly(mask, [np.round(points * 16).astype(np.int32)], 1, shift=4)
    return mask.astype(bool)


def plain_warp(neutral, neutral_points, truth, points):
    """Score of the baseline: the neutral photo warped by the true landmarks, triangle by triangle."""
    source, target = face_crop(neutral_points), face_crop(points)
    picture = warp_pixels(np.asarray(neutral, np.float32), source, CROP)
    goal = warp_pixels(np.asarray(truth, np.float32), target, CROP)
    start = neutral_points @ source[:, :2].T + source[:, 2]
    end = points @ target[:, :2].T + target[:, 2]
    made = piecewise_affine(picture, start[:468], end[:468])
    hull = hull_mask(end, CROP, CROP)
    lips = polygon_mask(end[list(OUTER_LIPS)])
    return Score(
        psnr(made, goal, hull), ssim(made, goal, hull), mse(made, goal, hull) * 255**2,
        psnr(made, goal, lips),
    )  # fmt: skip


def mean_score(scores):
    """Mean of each figure over pictures."""
    table = np.array([[s.hull_psnr, s.hull_ssim, s.hull_mse, s.lips_psnr] for s in scores])
    return Score(*table.mean(0).tolist())
