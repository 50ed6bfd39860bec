"""Where hair grows on a head, before any photo is looked at."""

from collections.abc import Callable

import cv2
import numpy as np

from bakery.geometry.sample import bilinear
from bakery.heads.base import HeadModel

RADIUS = 85.0  # mm, of the cylinder around the mean head that is unrolled
# Landmarks: end of the left brow, its outer eye corner, hairline, before the left ear.
BROW, EYE, TOP, TRAGUS = 293, 263, 10, 454
# mm from TRAGUS, of the near lower and the far upper corner of the built-in head's ear.
LEAST_EAR = np.array([[3.2, -23.7], [31.9, 26.9]])
SOFT = 5.0  # mm, of the hairline's blur
MARGIN = 25.0  # mm that the chart goes on beyond both its ends, more than the blur reaches
BACK = np.pi * RADIUS + MARGIN  # mm, the chart's end at the middle of the nape


def scalp(head):
    """Share [V] float32 0..1 of the scalp at each vertex: above the hairline, around the ears.

    The line is drawn on the mean head unrolled to a cylinder and placed by landmarks and ears, both
    sides alike.
    """
    skin = head.mean[head.part_vertices("skin")]
    unroll = unrolled(head)
    marks = unroll(head.landmarks(head.mean))
    top, brow, eye = marks[TOP, 1], marks[BROW, 1], marks[EYE, 1]
    front, behind, low, high = ear_box(head)
    back, peak = BACK, skin[:, 1].max() + MARGIN
    line = [
        [-MARGIN, top + 9], [16, top + 7], [32, top + 3], [48, top - 6], [63, top - 18],
        [77, brow + 4], [front - 24, brow - 8], [front - 18, eye - 4], [front - 4, eye - 14],
        [front + 1, high - 1], [front + 12, high + 6], [front + 30, high + 5],
        [behind + 2, high - 8], *zip(*_nape(behind, low)),
        [back, peak], [-MARGIN, peak],
    ]  # fmt: skip
    corner = np.array([-MARGIN, skin[:, 1].min() - MARGIN])
    width, height = (np.array([back, peak]) - corner).astype(int)
    chart = np.zeros((height, width), np.float32)
    cv2.fillPoly(chart, [np.round(np.array(line) - corner).astype(np.int32)], 1)
    chart = cv2.GaussianBlur(chart, (0, 0), SOFT)
    places = unroll(head.mean)
    ear = ear_depth(places, (front, behind, low, high)) < 1
    share = np.clip(2 * bilinear(chart, (places - corner).astype(np.float32)) - 0.5, 0, 1)
    return np.where(ear, 0, share).astype(np.float32)


def nape_line(head: HeadModel, across: np.ndarray) -> np.ndarray:
    """Height [N] mm of the line behind the ears on which the scalp ends, at places [N] mm of `unrolled`."""
    _, behind, low, _ = ear_box(head)
    out: np.ndarray = np.interp(across, *_nape(behind, low))
    return out


def _nape(behind, low):
    """Places and heights of that line, mm, by where the ear ends."""
    return [behind + 5, behind + 22, BACK], [low + 12, low - 12, low - 18]


def unrolled(head: HeadModel) -> Callable[[np.ndarray], np.ndarray]:
    """The map of points [..., 3] onto the mean head unrolled to a cylinder [..., 2] mm.

    Across from the face's middle, both sides alike, and up.
    """
    axis = _axis(head)

    def unroll(points: np.ndarray) -> np.ndarray:
        across = np.arctan2(np.abs(points[..., 0]), points[..., 2] - axis) * RADIUS
        return np.stack([across, points[..., 1]], -1)

    return unroll


def ear_box(head: HeadModel) -> tuple[float, float, float, float]:
    """The left ear on the unrolled head: nearest and farthest across, lowest and highest, mm.

    Ears are what stands further out than the skull above them, and no smaller than the built-in head's:
    of ears that lie close to a broad skull little stands out. Their place is behind the landmark before
    the ear.
    """
    skin = head.mean[head.part_vertices("skin")]
    side = skin[(skin[:, 1] > -70) & (skin[:, 1] < 40)]
    tip = side[side[:, 0].argmax()]
    above = skin[(skin[:, 1] > tip[1] + 22) & (skin[:, 1] < tip[1] + 45)]
    ear = side[(side[:, 0] > above[:, 0].max() + 2.5) & (side[:, 2] < _axis(head) + 25)]
    unroll = unrolled(head)
    usual = unroll(head.landmarks(head.mean)[TRAGUS]) + LEAST_EAR
    across, up = np.concatenate([usual, unroll(ear)]).T
    return across.min(), across.max(), up.min(), up.max()


def ear_depth(
    flat: np.ndarray, box: tuple[float, float, float, float], square: float = 8.0
) -> np.ndarray:
    """Below 1 on an ear, where the unrolled points [N, 2] lie in its box (`ear_box`).

    Args:
        square: exponent; of the box's corners nothing is left out at infinity, of an oval at 2.
    """
    front, behind, low, high = box
    across = (flat[:, 0] - (front + behind) / 2) / ((behind - front) / 2 + 2)
    up = (flat[:, 1] - (low + high) / 2) / ((high - low) / 2 + 3)
    depth: np.ndarray = np.abs(across) ** square + np.abs(up) ** square
    return depth


def _axis(head):
    """Where the cylinder's axis stands, mm along z: in the middle of the skull."""
    upper = head.mean[head.part_vertices("skin")]
    upper = upper[upper[:, 1] > 20]
    return float((upper[:, 2].min() + upper[:, 2].max()) / 2)
