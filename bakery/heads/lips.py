"""Lip shapes that the source draws wrong, mended on the control mesh. Build-time only: needs scipy.

Rows count vertices outward from the inner lip contour; the mesh has the same columns in all of them.
The red of the lips ends at row BORDER.
"""

from dataclasses import replace

import numpy as np

from bakery.geometry.fill import smoothstep
from bakery.heads.carriers import split_ring
from bakery.heads.control import lip_ring, rings, spread_from
from bakery.types import EXPRESSION_INDEX

BORDER = 6.5
ROWS = 14
# The source parts or pushes the lips but leaves the corners nearly where they are; people draw them
# in by 40% (pucker) and 30% (funnel): shape -> (share of the width taken, mm forward at the corners
# and beyond that in the middle). mouthRollUpper only comes forward, off the incisors.
ROUNDED = {
    "mouthPucker": (0.3, 0.5, 1.5),
    "mouthFunnel": (0.2, 1.5, 0.0),
    "mouthRollUpper": (0.0, 1.2, 0.0),
}
# Narrower lips are fuller, for flesh has to go somewhere: shape -> mm that the border of the upper
# and of the lower lip moves away from the contour between them.
FULLER = {"mouthPucker": (1.2, 1.8), "mouthFunnel": (1.5, 3.0)}
FUNNEL = 0.75  # of the height that the source opens it
SHRUG = (2.6, 0.8)  # mm that mouthShrugUpper brings the upper lip outward; share of its lift kept


def round_lips(raw):
    """The head whose mouthPucker and mouthFunnel draw in the corners; the funnel's hole is round."""
    ring = lip_ring(raw)
    x, y = raw.mean[:, 0], raw.mean[:, 1]
    half, middle = np.abs(x[ring]).max(), y[ring].mean()
    arc = np.polyfit(x[ring] ** 2, raw.mean[ring, 2], 1)[0]  # 1/mm, negative: corners lie back
    tall = np.where(y > middle, 0.5, 0.9) * half  # the nose keeps its width
    radius = np.hypot(x / (1.25 * half), (y - middle) / tall)
    fade = 1 - smoothstep(0.8, 2.0, radius)
    fade[~np.isin(np.arange(len(x)), raw.quads[np.isin(raw.parts, ["skin", "mouth_cavity"])])] = 0
    fade[raw.mean[:, 2] < raw.mean[ring, 2].min() - 15] = 0
    dome = np.clip(1 - (x / half) ** 2, 0, 1)
    expression = raw.expression.copy()
    for name, (share, forward, more) in ROUNDED.items():
        shape = expression[EXPRESSION_INDEX[name]]
        across = x + shape[:, 0]
        drawn = across * (1 - share * fade)
        shape[:, 0] += drawn - across
        shape[:, 2] += (arc * (drawn**2 - across**2) + forward + more * dome) * fade
    funnel = expression[EXPRESSION_INDEX["mouthFunnel"]]
    funnel[:, 1] *= 1 - (1 - FUNNEL) * fade
    _round_hole(raw, ring, funnel)
    row, above = rows(raw, ring)
    for name, (up, down) in FULLER.items():
        share = smoothstep(2, BORDER, row) * (1 - smoothstep(BORDER, ROWS, row)) * np.sqrt(dome)
        expression[EXPRESSION_INDEX[name], :, 1] += np.where(above, up, -down) * share
    return replace(raw, expression=expression)


def _round_hole(raw, ring, funnel):
    """Make the opening of a shape [V, 3] an ellipse, in place."""
    x = raw.mean[:, 0]
    upper, lower = split_ring(ring, raw.mean, raw.expression[EXPRESSION_INDEX["jawOpen"]])
    at = raw.mean + funnel
    half = np.abs(at[ring, 0]).max()
    gap = at[upper, 1] - np.interp(at[upper, 0], at[lower, 0], at[lower, 1])
    hole = gap.max() * np.sqrt(np.clip(1 - (at[upper, 0] / half) ** 2, 0, 1))
    more = np.maximum(hole - gap, 0) / 2
    move = np.zeros((len(x), 1))
    move[upper, 0] = more
    move[lower, 0] = -np.interp(at[lower, 0], at[upper, 0], more)
    funnel[:, 1] += spread_from(raw, ring, move)[:, 0]


def shrug_upper(raw):
    """The head whose mouthShrugUpper brings the upper lip outward, its red more than its border."""
    ring = lip_ring(raw)
    row, above = rows(raw, ring)
    out, kept = SHRUG
    x = raw.mean[:, 0]
    across = 1 - smoothstep(0.55, 1.15, np.abs(x) / np.abs(x[ring]).max())
    share = across * above * (1 - smoothstep(3, ROWS - 2, row))
    shape = raw.expression[EXPRESSION_INDEX["mouthShrugUpper"]]
    wanted = shape * [1, kept, 1]
    wanted[:, 2] = np.maximum(wanted[:, 2], 0) + out
    skin = np.unique(raw.quads[raw.parts == "skin"])
    move = spread_from(raw, skin, (wanted - shape) * share[:, None])
    expression = raw.expression.copy()
    expression[EXPRESSION_INDEX["mouthShrugUpper"]] += move
    return replace(raw, expression=expression)


def rows(raw, ring):
    """Row [V] of each skin vertex around the mouth, ROWS where farther; whether it lies above [V]."""
    skin = raw.quads[raw.parts == "skin"]
    near = rings(skin, ring, ROWS)
    row = np.full(len(raw.mean), ROWS)
    np.minimum.at(row, skin, near[:, None] + 1)
    row[ring] = 0
    upper, lower = split_ring(ring, raw.mean, raw.expression[EXPRESSION_INDEX["jawOpen"]])
    above = raw.mean[:, 1] > raw.mean[ring, 1].mean()
    above[upper], above[lower] = True, False
    return row, above
