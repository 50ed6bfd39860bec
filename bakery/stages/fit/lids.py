"""Lids that close on this person's eyes: a correction of eyeBlink for one neutral shape.

A blink that closes the mean eye leaves a slit in a wide one and overshoots in a narrow one. Each
column of the upper lid gets the gain at which it overlaps the lower lid by a little (PITFALLS 6).
"""

from dataclasses import replace

import numpy as np

from bakery import landmarks as marks
from bakery.heads.base import FOLLOW, HeadModel
from bakery.types import EXPRESSION_INDEX

# Upper and lower lid margins from the outer to the inner corner, column by column, left eye first.
UPPER = tuple(rim[1:-1] for rim in marks.LIDS_UPPER)
LOWER = tuple(rim[1:-1] for rim in marks.LIDS_LOWER)
# Shares of the widest opening from the outer to the inner column: enough to hide the eye, and not yet
# squeezed. At the nose the lower lid lies deep, and from the side one looks in under the upper lid.
OVERLAP = (0.03, 0.04, 0.05, 0.05, 0.055, 0.07, 0.075)
CLEAR_UPPER, CLEAR_LOWER = (
    0.5,
    0.15,
)  # mm above the white of the eye; the upper lid lies on the lower
GAIN = (0.5, 1.8)  # limits of what a column may be scaled by
ROUNDS = 6  # of correction: after four no column changes its overlap by more than 0.5%


def close_lids(head: HeadModel, neutral: np.ndarray) -> HeadModel:
    """The head with eyeBlinkLeft and eyeBlinkRight fitted to a neutral shape.

    Args:
        head: HeadModel.
        neutral: [V, 3] mm, one person's neutral shape.

    Returns:
        HeadModel with its own expression_basis; the one given is not changed.
    """
    basis = head.expression_basis.copy()
    centers = head.eye_centers(neutral)
    skin = np.zeros(len(neutral), bool)
    skin[head.part_vertices("skin", "eye_socket")] = True
    for eye, side in enumerate(("Left", "Right")):
        shape = EXPRESSION_INDEX["eyeBlink" + side]
        ball = neutral[head.follow == FOLLOW.index("eye_" + side.lower())] - centers[eye]
        radius = float(np.median(np.linalg.norm(ball, axis=1)))
        basis[shape] = _closed(head, neutral, basis[shape], eye, centers[eye], radius, skin)
    return replace(head, expression_basis=basis)


def _closed(head, neutral, blink, eye, center, radius, skin):
    """One blink [V, 3] mm, corrected."""
    rest, shut = head.landmarks(neutral), head.landmarks(neutral + blink)
    upper, lower = UPPER[eye], LOWER[eye]
    travel = rest[upper, 1] - shut[upper, 1]
    if travel.max() < 1.0:  # mm: this head has no blink
        return blink
    opening = rest[upper, 1] - rest[lower, 1]
    wanted = np.multiply(OVERLAP, opening.max())
    # Columns run along x; beyond the corners the blink stays as it is.
    columns = np.concatenate([rest[upper, 0], rest[marks.LIDS_UPPER[eye][[0, -1]], 0]])
    order = np.argsort(columns)
    moving = skin & (np.abs(blink).max(1) > 0.05)
    falling = skin & (blink[:, 1] < -0.1)
    gain, out = np.ones(len(upper)), blink
    for _ in range(ROUNDS):
        now = head.landmarks(neutral + out)
        missing = wanted - (now[lower, 1] - now[upper, 1])
        gain = np.clip(gain + 0.8 * missing / np.maximum(travel, 0.3 * travel.max()), *GAIN)
        smooth = np.convolve(np.pad(gain, 1, "edge"), [0.2, 0.6, 0.2], "valid")  # no spikes
        gains = np.concatenate([smooth, [1.0, 1.0]])
        scale = np.interp(neutral[:, 0], columns[order], gains[order])
        out = blink * np.where(falling, scale, 1)[:, None]
        out = _off_the_ball(neutral, out, center, radius, moving)
    return out


def _off_the_ball(neutral, blink, center, radius, moving):
    """Push lids that the blink draws into the eyeball back onto it."""
    position = neutral + blink - center
    distance = np.linalg.norm(position, axis=1)
    before = np.linalg.norm(neutral - center, axis=1)
    clear = radius + np.where(blink[:, 1] < -0.5, CLEAR_UPPER, CLEAR_LOWER)
    # What was inside at rest, the lining behind the lid, stays behind by as much.
    least = np.minimum(clear, np.maximum(before, radius - 2) + CLEAR_LOWER)
    sunk = moving & (distance < least) & (position[:, 2] > 0)
    factor = np.where(sunk, least / np.maximum(distance, 1e-6), 1)
    return (blink + position * (factor - 1)[:, None]).astype(np.float32)
