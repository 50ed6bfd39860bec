"""What a head that was learned from the front owes to photographs of turned heads: depth.

How much it lacks is measured by `train.depths`. Only points that an edge or fold marks are asked;
others lie where a detector expects them (docs/log-fit.md). Build-time only.
"""

from dataclasses import dataclass

import numpy as np

from bakery import landmarks as marks
from bakery.heads.build.learn import cost_of_moves, profile_vertices, profile_weights, spread
from bakery.heads.place import at_landmarks

SEEN = np.setdiff1d(np.arange(marks.FACE), marks.PLAIN)
STEADY = np.setdiff1d(SEEN, marks.LIPS)  # what a smile moves least
# The front sees what they lie on edge-on, so where on it was a guess: they tell nothing of depth.
UNDER_NOSE = np.array([19, 94, 2, 97, 326])
SMILE = 0.5  # of what a smile's lips lack: with all of it the corners of a single-sided one reach the teeth
DEPTH = 1.5  # weight of the features' mean square depth, per mm2
FIRM = 5.0  # of the profile's convexity, per mm2


@dataclass(frozen=True)
class Depths:
    """What a head lacks in depth at its landmarks, up to a common offset."""

    rest: np.ndarray  # [468] mm, in people who do not smile
    smile: np.ndarray  # [468] mm more in a smile of weight 1
    turned: float  # root mean square of the turns that told it, degrees


def depth_shift(head, depths):
    """Identity [I] that gives the mean head the depth of people's features.

    The smallest move, in standard deviations of the modes, that makes up for `depths.rest` while
    the landmarks stay where the front sees them and the profile keeps its convexity.
    """
    _, basis, _ = at_landmarks(head)
    groups = [np.concatenate(marks.EYES), marks.BROWS, marks.NOSE, marks.LIPS_OUTER]
    groups = [np.setdiff1d(group, UNDER_NOSE) for group in groups]
    weights = np.zeros(marks.FACE)
    for group in groups:
        weights[group] += 1 / len(group) / len(groups)
    wanted = depths.rest - weights @ depths.rest
    depth = basis[..., 2] - (basis[..., 2] @ weights)[:, None]
    chosen = profile_vertices(head)
    profile = head.identity_basis[:, chosen, 2].astype(float) @ profile_weights(head, chosen)
    cost = cost_of_moves(head) + FIRM * np.outer(profile, profile)
    cost += DEPTH * (depth * weights) @ depth.T
    return np.linalg.solve(cost, DEPTH * (depth * weights) @ wanted)


def smile_depth(raw, matrix, depths):
    """What a smile of weight 1 moves the control mesh in depth by, beside what it does: [V] mm, forward.

    Lips of a smile lie near the teeth. From the front that is not seen, and the source's stand off them.

    Args:
        raw: the prepared Raw; matrix: from `learn.landmark_matrix`.
    """
    wanted = np.zeros((marks.FACE, 1))
    wanted[marks.LIPS, 0] = SMILE * (depths.smile[marks.LIPS] - depths.smile[STEADY].mean())
    return spread(raw, matrix[SEEN], wanted[SEEN])[:, 0]
