"""A photo cut to the face, as the generator looks at it."""

import cv2
import numpy as np

from bakery.geometry import camera as cameras
from bakery.geometry.color import to_encoded
from bakery.heads.base import HeadModel
from bakery.landmarks import LIPS_INNER
from bakery.stages.condition import FACE_RATIO, SIZE, condition
from bakery.types import Camera, Fit

BLOT = np.array([0.10, 0.03, 0.03], np.float32)  # linear, what hides a mouth: that of a dark one


def face_frame(fit: Fit, points: np.ndarray, size: int = SIZE) -> tuple[Camera, np.ndarray]:
    """The camera of a photo's fit cut to the face.

    Args:
        points: [L, 2] pixels, landmarks in the photo.
        size: pixels a side.

    Returns:
        Camera, and the affine [2, 3] from the photo's pixels to its own.
    """
    low, high = points.min(0), points.max(0)
    scale = FACE_RATIO * size / (high[1] - low[1])
    corner = (low + high) / 2 - size / 2 / scale
    camera = cameras.crop(fit.camera, corner[0], corner[1], size, size, scale)
    return camera, np.column_stack([np.eye(2) * scale, -corner * scale])


def cut(picture: np.ndarray, affine: np.ndarray, size: int = SIZE) -> np.ndarray:
    """A picture [H, W(, C)] float32 resampled by an affine of pixel positions; black outside."""
    matrix = affine.copy()
    matrix[:, 2] += 0.5 * matrix[:, :2].sum(1) - 0.5  # pixel centres lie at +0.5
    scale = affine[0, 0]
    if scale < 1:  # what is made smaller is blurred first, or it aliases
        picture = cv2.GaussianBlur(picture, (0, 0), 0.5 * np.sqrt(1 / scale**2 - 1) + 1e-3)
    return cv2.warpAffine(picture, matrix, (size, size), flags=cv2.INTER_LINEAR)


def blotted(encoded: np.ndarray, points: np.ndarray) -> np.ndarray:
    """A photo [H, W, 3] whose mouth is a dark blot between the inner lips.

    Args:
        encoded: sRGB-encoded, float 0..1 or uint8.
        points: [478, 2] pixels.
    """
    out = encoded.copy()
    white = 255.0 if out.dtype == np.uint8 else 1.0
    ring = np.round(points[LIPS_INNER]).astype(np.int32)
    cv2.fillPoly(out, [ring], (to_encoded(BLOT) * white).tolist())
    return out


def head_photo(
    encoded: np.ndarray,
    points: np.ndarray,
    fit: Fit,
    head: HeadModel,
    neutral: np.ndarray,
    size: int = SIZE,
) -> np.ndarray:
    """The photo cut to the face, black where the fitted head is not: [S, S, 3] uint8 sRGB.

    Args:
        encoded: [H, W, 3] float32 sRGB-encoded, the photo.
        points: [L, 2] pixels, its landmarks.
        fit: its Fit.
        neutral: [V, 3] mm, the fitted neutral shape.
    """
    camera, affine = face_frame(fit, points, size)
    blank = np.zeros((8, 8, 3), np.float32)
    drawn = condition(head, neutral, blank, fit.expression, fit.gaze, camera)
    picture = np.clip(cut(encoded, affine, size), 0, 1) * np.isfinite(drawn.depth)[..., None]
    return np.round(picture * 255).astype(np.uint8)
