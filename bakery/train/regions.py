"""Regions of a face that are hidden, to see how well they are completed."""

import cv2
import numpy as np

from bakery.heads.base import HeadModel
from bakery.landmarks import BROWS, FACE, NOSE_BASE, OVAL
from bakery.stages.atlas import Atlas, uv_polygon

REGIONS = ("mouth", "forehead", "half")


def hidden_region(name: str, head: HeadModel, atlas: Atlas) -> np.ndarray:
    """What is hidden [T, T] float32 0..1: mouth and chin, forehead, or the subject's left half."""
    points = atlas.at(head.mean)
    marks = head.landmarks(head.mean)[:FACE]
    within = {
        "mouth": points[:, 1] < marks[NOSE_BASE, 1].mean() - 2,
        "forehead": points[:, 1] > marks[BROWS, 1].max() + 2,
        "half": points[:, 0] > 0,
    }[name]
    hidden = atlas.paint(within.astype(np.float32))
    # To beyond the edges of the charts, so that lips leave no line at the mouth's hole.
    hidden = cv2.dilate(hidden, np.ones((atlas.size // 64,) * 2))
    if name == "mouth":  # a hand or a mask, not the neck below it
        hidden *= uv_polygon(head, OVAL, 1.15, atlas.size)
    return np.clip(cv2.GaussianBlur(hidden, (0, 0), atlas.size / 300), 0, 1)
