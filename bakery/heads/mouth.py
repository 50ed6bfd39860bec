"""The piece of a head around its mouth: it deforms several times faster than all of it."""

import numpy as np

from bakery.heads.base import MOUTH, HeadModel
from bakery.landmarks import LIPS_INNER, LIPS_OUTER

LIPS = np.concatenate([LIPS_OUTER, LIPS_INNER])


def around_mouth(head: HeadModel, neutral: np.ndarray, reach: float) -> HeadModel:
    """The faces of the mouth's interior, and those within `reach` mm of the lips; a `HeadModel.cut`.

    Args:
        neutral: [V, 3] mm.
    """
    lips = head.landmarks(neutral)[LIPS].mean(0)
    near = np.linalg.norm(neutral - lips, axis=1) < reach
    near[head.part_vertices(*MOUTH, "mouth_sheet")] = True
    return head.cut(np.flatnonzero(near[head.faces].all(1)))
