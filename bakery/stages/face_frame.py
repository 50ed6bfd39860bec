"""A photo cut to the face, as the generator looks at it."""

import cv2
import numpy as np

from bakery.generators.channels import BLOT
from bakery.geometry import camera as cameras
from bakery.geometry.color import to_encoded
from bakery.heads.base import HeadModel
from bakery.landmarks import LIPS_INNER, open_mouth
from bakery.stages.condition import FACE_RATIO, SIZE, condition, finer, shrunk
from bakery.types import Camera, Fit


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
    scale = 1.0 if out.dtype == np.uint8 else 1 / 255
    ring = np.round(points[LIPS_INNER]).astype(np.int32)
    cv2.fillPoly(out, [ring], (BLOT * scale).tolist())
    return out


def neutral_picture(
    encoded: np.ndarray,
    points: np.ndarray,
    fit: Fit,
    head: HeadModel,
    neutral: np.ndarray,
    texture: np.ndarray,
    size: int = SIZE,
) -> np.ndarray:
    """The neutral face where the photo shows it, black outside the head: [S, S, 3] uint8 sRGB.

    It is the photo itself where lips are closed, which tells most. A photo of an open mouth shows no neutral
    face: then the texture is drawn at rest (docs/log-pagan.md, "One photo channel for all").

    Args:
        encoded: [H, W, 3] float32 sRGB-encoded, the photo.
        points: [L, 2] pixels, its landmarks.
        fit: its Fit.
        neutral: [V, 3] mm, the fitted neutral shape.
        texture: [T, T, 3] linear, T_0.
    """
    camera, affine = face_frame(fit, points, size)
    if open_mouth(points):
        still = np.zeros_like(fit.expression)
        drawn = condition(head, neutral, texture, still, (0.0, 0.0), finer(camera))
        picture = shrunk(to_encoded(np.clip(drawn.deformed_neutral, 0, 1)), camera)
    else:
        blank = np.zeros((8, 8, 3), np.float32)
        drawn = condition(head, neutral, blank, fit.expression, fit.gaze, camera)
        picture = cut(encoded, affine, size) * np.isfinite(drawn.depth)[..., None]
    return np.round(np.clip(picture, 0, 1) * 255).astype(np.uint8)
