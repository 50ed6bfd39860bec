"""The face frame on a photo: warps into it, polygons in it. See `prior`."""

import cv2
import numpy as np

from bakery.errors import FitError
from bakery.stages.segment import prior


def apply(matrix, points):
    return points @ matrix[:, :2].T + matrix[:, 2]


def frame_box(to_frame, shape):
    """The part of the photo that the face frame covers: left, top, right, bottom."""
    corners = np.array([[0, 0], [1, 0], [0, 1], [1, 1]]) * prior.SIZE
    corners = apply(cv2.invertAffineTransform(to_frame), corners)
    limit = np.array([shape[1], shape[0]])
    low = np.clip(np.floor(corners.min(0)).astype(int), 0, limit)
    high = np.clip(np.ceil(corners.max(0)).astype(int), 0, limit)
    if (high <= low).any():
        raise FitError(
            "all landmarks lie outside the photo, pixels of this photo are needed; check the "
            "landmark file"
        )
    return *low, *high


def warp_matrix(matrix):
    """The same similarity for OpenCV, whose pixel centres lie on whole numbers."""
    shift = matrix[:, :2] @ [0.5, 0.5] - 0.5
    return np.column_stack([matrix[:, :2], matrix[:, 2] + shift])


def warp_down(part, to_frame):
    """The photo in the face frame, averaged where it shrinks."""
    scale = np.sqrt(abs(np.linalg.det(to_frame[:, :2])))
    if scale < 1:
        size = np.maximum(np.round(np.array(part.shape[1::-1]) * scale), 1).astype(int)
        ratio = np.array(part.shape[1::-1]) / size
        part = cv2.resize(part, tuple(size.tolist()), interpolation=cv2.INTER_AREA)
        to_frame = np.column_stack([to_frame[:, :2] * ratio, to_frame[:, 2]])
    return cv2.warpAffine(
        part,
        warp_matrix(to_frame),
        (prior.SIZE, prior.SIZE),
        flags=cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_REPLICATE,
    )


def draw_polygon(mask, points, value):
    """Fill a polygon [n, 2] of pixel coordinates."""
    cv2.fillPoly(mask, [np.round((points - 0.5) * 16).astype(np.int32)], value, shift=4)


def polygon(points):
    """[SIZE, SIZE] bool, the inside of a polygon of the face frame."""
    mask = np.zeros((prior.SIZE, prior.SIZE), np.uint8)
    draw_polygon(mask, points, 1)
    return mask > 0


def hull(points):
    return polygon(cv2.convexHull(points.astype(np.float32))[:, 0])
