"""Does the avatar look like the person: back in its own photo, and smiling as the person smiles."""

from dataclasses import dataclass, fields

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
from bakery.landmarks import LIPS_OUTER

CROP = 512  # pixels; the face's height takes 78% of it (metrics.face_crop)


@dataclass(frozen=True)
class Score:
    """One picture against the truth."""

    hull_psnr: float  # dB, inside the convex hull of the landmarks
    hull_ssim: float
    hull_mse: float  # of values 0..255
    lips_psnr: float  # dB, inside the outer lips
    face_psnr: (
        float  # dB, inside the hull where the avatar shows the face (`render --mask`): no hair
    )


def compare(picture, truth, points, face):
    """Score a picture [H, W, 3] against the photo it should equal, both sRGB-encoded.

    Args:
        points: [L, 2] pixels, landmarks of the truth.
        face: [H, W] 0..1, pixels of the truth in which the avatar shows the face.
    """
    matrix = face_crop(points)
    a, b = (warp_pixels(np.asarray(p, np.float32), matrix, CROP) for p in (picture, truth))
    moved = points @ matrix[:, :2].T + matrix[:, 2]
    return _score(a, b, moved, warp_pixels(np.asarray(face, np.float32), matrix, CROP))


def _score(made, truth, points, face):
    """Score of two crops; points [L, 2] and face [CROP, CROP] in the crop."""
    hull = hull_mask(points, CROP, CROP)
    return Score(
        psnr(made, truth, hull),
        ssim(made, truth, hull),
        mse(made, truth, hull) * 255**2,
        psnr(made, truth, polygon_mask(points[LIPS_OUTER])),
        psnr(made, truth, hull & (face > 0.5)),
    )


def polygon_mask(points):
    """Boolean [CROP, CROP]: inside a closed polygon [n, 2]."""
    mask = np.zeros((CROP, CROP), np.uint8)
    cv2.fillPoly(mask, [np.round(points * 16).astype(np.int32)], 1, shift=4)
    return mask.astype(bool)


def plain_warp(neutral, neutral_points, truth, points, face):
    """Score of the baseline: the neutral photo warped by the true landmarks, triangle by triangle."""
    source, target = face_crop(neutral_points), face_crop(points)
    picture = warp_pixels(np.asarray(neutral, np.float32), source, CROP)
    goal = warp_pixels(np.asarray(truth, np.float32), target, CROP)
    start = neutral_points @ source[:, :2].T + source[:, 2]
    end = points @ target[:, :2].T + target[:, 2]
    made = piecewise_affine(picture, start[:468], end[:468])
    return _score(made, goal, end, warp_pixels(np.asarray(face, np.float32), target, CROP))


def mean_score(scores):
    """Mean of each figure over pictures."""
    table = np.array([[getattr(score, field.name) for field in fields(Score)] for score in scores])
    return Score(*table.mean(0).tolist())
