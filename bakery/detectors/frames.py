"""Where a face lies in a picture, and the upright crop a network sees of it.

Positions are continuous pixels: the origin is the top left corner of the picture, pixel centres
lie at +0.5. Points are in the public 478-point face-mesh order.
"""

from dataclasses import dataclass

import cv2
import numpy as np

from bakery.landmarks import LEFT_EYE_OUTER, RIGHT_EYE_OUTER

POINTS = 478
CROP_MARGIN = 1.25  # side of a crop / size of the face in it
PADDING = 127  # grey level outside the picture


@dataclass(frozen=True)
class FaceFrame:
    """An upright square around a face."""

    center: np.ndarray  # [2] x, y, pixels
    size: float  # longer side of the face's bounding box once upright, pixels
    roll: float  # radians; positive where the subject's left eye lies lower in the picture


def frame_of_points(points: np.ndarray) -> FaceFrame:
    """The frame that belongs to 478 points.

    Args:
        points: [478, 2+] x, y, pixels.

    Returns:
        FaceFrame
    """
    points = np.asarray(points, np.float64)[:, :2]
    across = points[LEFT_EYE_OUTER] - points[RIGHT_EYE_OUTER]
    roll = float(np.arctan2(across[1], across[0]))
    turn = rotation(-roll)
    upright = points @ turn.T
    low, high = upright.min(0), upright.max(0)
    return FaceFrame((low + high) / 2 @ turn, float((high - low).max()), roll)


def rotation(angle):
    """[2, 2] matrix that turns x towards y by `angle` radians."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s], [s, c]])


def crop_matrix(frame, crop_size, margin=CROP_MARGIN):
    """[2, 3] affine map from picture pixels to pixels of the frame's square crop."""
    linear = rotation(-frame.roll) * (crop_size / (frame.size * margin))
    offset = crop_size / 2 - linear @ frame.center
    return np.concatenate([linear, offset[:, None]], 1)


def apply_affine(matrix, points):
    """Map points [..., 2] by a [2, 3] affine matrix."""
    return points @ matrix[:, :2].T + matrix[:, 2]


def invert_affine(matrix):
    """The [2, 3] inverse of a [2, 3] affine map."""
    linear = np.linalg.inv(matrix[:, :2])
    return np.concatenate([linear, (-linear @ matrix[:, 2])[:, None]], 1)


def take_crop(image, matrix, crop_size):
    """Resample a picture through `matrix` (picture pixels -> crop pixels), grey outside.

    Args:
        image: [H, W, 3] uint8.
        matrix: [2, 3] as from `crop_matrix`.
        crop_size: side of the crop, pixels.

    Returns:
        [crop_size, crop_size, 3] uint8
    """
    shifted = matrix.copy()
    shifted[:, 2] += matrix[:, :2].sum(1) * 0.5 - 0.5  # OpenCV puts pixel centres at integers
    size = (crop_size, crop_size)
    return cv2.warpAffine(image, shifted, size, flags=cv2.INTER_LINEAR, borderValue=(PADDING,) * 3)
