"""Lips in the fit: closed ones touch, and opening and width count by themselves.

Where lips are closed, a photo shows one seam: points detectors put the rims of both lips on it. On a
head at rest the rims overlap instead, the upper one hidden behind the lower lip. A head whose rims
are both drawn to the seam has nothing left to overlap, and gapes at the least error of a weight.
"""

import numpy as np

from bakery import landmarks as marks

# Openings, over the mouth's width, up to which lips count as closed, and from which as open. In
# photographs closed lips lie within -0.3 and 0.6%, hardly any between 1 and 3%.
CLOSED, OPEN = 0.006, 0.02
UPPER, LOWER = marks.LIPS_INNER_UPPER[1:-1], marks.LIPS_INNER_LOWER[1:-1]


def mouth_axes(points):
    """Unit vectors [2] along the mouth to the subject's left and down across it, and its width.

    Args:
        points: [L, 2] pixels.
    """
    right, left = points[marks.MOUTH_CORNERS]
    width = float(np.linalg.norm(left - right))
    along = (left - right) / max(width, 1e-9)
    return along, np.array([-along[1], along[0]]), width


def seam_offsets(mean, points):
    """How far from its rim the upper lip is seen, where the lower lip hides the rim: [468, 3] mm.

    Args:
        mean: [468, 3] mm, landmarks of the head model's mean, lips at rest.
        points: [L, 2] pixels, as seen.

    Returns:
        mm in head space, to be added to the landmarks before they are compared with `points`.
    """
    out = np.zeros((marks.FACE, 3))
    rest = (mean[UPPER, 1] - mean[LOWER, 1]) / np.ptp(mean[marks.MOUTH_CORNERS, 0])
    _, down, width = mouth_axes(points)
    gap = (points[LOWER] - points[UPPER]) @ down / max(width, 1e-9)
    # Points that do overlap, as those of a rendered head, show the rim itself.
    hidden = np.interp(gap, (CLOSED, OPEN), (1.0, 0.0)) + np.clip(
        gap / np.maximum(-rest, 1e-9), -1, 0
    )
    hidden = np.where(rest < 0, np.clip(hidden, 0, 1), 0)
    out[UPPER] = hidden[:, None] * (mean[LOWER] - mean[UPPER])
    return out


def lip_rows(residual, jacobian, seen, weights):
    """Residual [10] and Jacobian [10, P] of the opening of nine columns and the mouth's width.

    Args:
        residual: [468, 2] pixels, and jacobian: [468, 2, P], of `landmark_residual`.
        seen: landmarks.Seen; weights: landmarks.Weights.

    Returns:
        outer-eye-corner distances, times the square roots of their weights.
    """
    along, down, _ = mouth_axes(seen.points)
    sure = np.sqrt(seen.confidence) / seen.size
    columns = np.sqrt(weights.opening / len(UPPER)) * np.minimum(sure[UPPER], sure[LOWER])
    right, left = marks.MOUTH_CORNERS
    across = np.sqrt(weights.width) * min(sure[right], sure[left])

    def rows(values):
        open_ = np.tensordot(values[LOWER] - values[UPPER], down, (1, 0))
        wide = np.tensordot(values[left] - values[right], along, (0, 0))
        scale = columns.reshape(-1, *[1] * (open_.ndim - 1))
        return np.concatenate([open_ * scale, np.asarray(wide * across)[None]])

    return rows(residual), rows(jacobian)
