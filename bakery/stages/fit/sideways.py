"""How far plain skin lies to a side: no photo shows it, so a head hardly turns by it.

Detectors place landmarks on cheeks, forehead and jaw where a face usually has them, nearly as if it
looked straight ahead. Eyes, brows, nose and lips are seen. On portraits turned by 10 degrees a fit to
all of them alike turned too little, by 3 to 5 degrees, and the warp bent the nose to the side by as
many millimetres (docs/log-fit.md). So of plain landmarks the two of a pair count by what they differ
in, which tells how wide the face is, and hardly by how far both lie to a side.
"""

from collections.abc import Sequence

import numpy as np

from bakery import landmarks as marks
from bakery.heads.base import HeadModel
from bakery.memo import once_per_object

# Degrees between photos of one person, from which on they tell it, and tell all of it.
SIDES = (15.0, 45.0)
ASIDE = np.array([1.0, 0.0, 0.0])  # to the subject's left, in head space


@once_per_object
def twins(head: HeadModel) -> np.ndarray:
    """The landmark on the other side for each of the 468; in the middle its own."""
    points = head.landmarks(head.mean)[: marks.FACE]
    other = np.linalg.norm(points[:, None] - points * [-1, 1, 1], axis=-1)
    found: np.ndarray = other.argmin(1)
    return found


def share_of(turns: Sequence[float], share: float) -> float:
    """The share that is believed of photos of one person: from two sides they do tell it.

    Args:
        turns: degrees that the head is turned by in each.
        share: that is believed of one photo.
    """
    return float(np.interp(np.ptp(turns), SIDES, (share, 1.0)))


def believed(
    values: np.ndarray, twin: np.ndarray, share: float, aside: np.ndarray = ASIDE
) -> np.ndarray:
    """Displacements of landmarks, with a share of what plain pairs have in common to a side.

    Args:
        values: [468, D] or, of derivatives, [468, D, U].
        twin: [468], of `twins`.
        share: 0..1; 1 leaves them as they are.
        aside: [D] unit vector to a side.
    """
    out = values.copy()
    pairs = (values[marks.PLAIN] + values[twin[marks.PLAIN]]) / 2
    common = np.einsum("ki...,i->k...", pairs, aside)
    out[marks.PLAIN] -= (1 - share) * np.einsum("k...,i->ki...", common, aside)
    return out
