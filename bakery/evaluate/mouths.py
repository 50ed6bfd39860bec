"""Lips of a fitted head, moved by expression weights alone, against the points of its photo.

The warp of a fit carries every landmark to its point, so it hides what the weights cannot say. Here
it is left out, or it is that of another photo of the person: as a user sees it who drives an avatar.
"""

from collections.abc import Sequence

import numpy as np

from bakery.evaluate.detection import lips
from bakery.geometry import camera as cameras
from bakery.heads.base import HeadModel
from bakery.types import Fit

CLOSED = 0.01  # openings below this share of the mouth's width are closed lips


def lip_error(head: HeadModel, neutral: np.ndarray, fit: Fit, points: np.ndarray) -> dict:
    """How a shape's lips differ from a photo's, moved and seen as its fit says.

    Args:
        neutral: [V, 3] mm, with the warp that is wanted.
        fit: of the photo; only expression, gaze and camera are taken.
        points: [478, 2] pixels of the photo.

    Returns:
        percent of the mouth's width: `opening` and `width`, how far they are off; `gap`, the opening
        that is left where the points have closed lips, None elsewhere.
    """
    shape = head.vertices(neutral, fit.expression, fit.gaze)
    seen = cameras.project(head.landmarks(shape).astype(np.float64), fit.camera)
    across = lips.width(points)
    made, true = lips.gap(seen) / across, lips.gap(points) / across
    return {
        "opening": 100 * abs(made - true),
        "width": 100 * abs(lips.width(seen) / across - 1),
        "gap": 100 * made if true < CLOSED else None,
    }


def mean_lip_error(rows: Sequence[dict]) -> dict:
    """Means over photos, how many show closed lips, and the widest gap of those."""
    gaps = [row["gap"] for row in rows if row["gap"] is not None]
    return {
        "opening": round(float(np.mean([row["opening"] for row in rows])), 3),
        "width": round(float(np.mean([row["width"] for row in rows])), 3),
        "closed": len(gaps),
        "gap": round(float(np.mean(gaps)), 3) if gaps else None,
        "gap_worst": round(max(gaps), 3) if gaps else None,
    }
