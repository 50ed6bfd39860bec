"""Lip shapes that the source draws wrong, mended on the control mesh. Build-time only.

Rows count vertices outward from the inner lip contour; the mesh has the same columns in all of them.
The red of the lips ends at row BORDER.
"""

from dataclasses import replace

import numpy as np

from bakery.geometry.fill import smoothstep
from bakery.heads.build.control import lip_ring, rings, spread_from
from bakery.heads.proxies import split_ring
from bakery.types import EXPRESSION_INDEX

BORDER = 6.5
ROWS = 14
# The source parts or pushes the lips but leaves the corners nearly where they are; people draw them
# in by 40% (pucker) and 30% (funnel): shape -> (share of the width taken, mm forward at the corners
# and beyond that in the middle). mouthRollUpper only comes forward, off the incisors.
ROUNDED = {
    "mouthPucker": (0.28, 0.5, 1.5),
    "mouthFunnel": (0.23, 1.5, 0.0),
    "mouthRollUpper": (0.0, 3.2, 0.0),
}
# Narrower lips are fuller, for flesh has to go somewhere: shape -> mm that the border of the upper
# and of the lower lip moves away from the contour between them.
FULLER = {"mouthPucker": (1.1, 1.0), "mouthFunnel": (1.5, 2.2)}
FUNNEL = 0.75  # of the height that the source opens it
SHRUG = (2.6, 0.5)  # mm that mouthShrugUpper brings the upper lip outward; share of its lift kept
PRESS = 0.75  # of what mouthPress moves at the corners and beyond is left out: it is no smile


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
    row, lip = rows(raw, ring)
    for name, (up, down) in FULLER.items():
        share = smoothstep(2, BORDER, row) * (1 - smoothstep(BORDER, ROWS, row)) * np.sqrt(dome)
        expression[EXPRESSION_INDEX[name], :, 1] += (
            np.select([lip > 0, lip < 0], [up, -down]) * share
        )
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
    row, lip = rows(raw, ring)
    out, kept = SHRUG
    x = raw.mean[:, 0]
    across = 1 - smoothstep(0.55, 1.15, np.abs(x) / np.abs(x[ring]).max())
    share = across * (lip > 0) * (1 - smoothstep(3, ROWS - 2, row))
    shape = raw.expression[EXPRESSION_INDEX["mouthShrugUpper"]]
    wanted = shape * [1, kept, 1]
    wanted[:, 2] = np.maximum(wanted[:, 2], 0) + out
    skin = np.unique(raw.quads[raw.parts == "skin"])
    move = spread_from(raw, skin, (wanted - shape) * share[:, None])
    expression = raw.expression.copy()
    expression[EXPRESSION_INDEX["mouthShrugUpper"]] += move
    return replace(raw, expression=expression)


def press_lips(raw):
    """The head whose mouthPress leaves the corners nearly where they are; the source draws a smile."""
    ring = lip_ring(raw)
    x = np.abs(raw.mean[:, 0])
    kept = 1 - PRESS * smoothstep(0.35, 1.0, x / x[ring].max())
    expression = raw.expression.copy()
    for side in ("Left", "Right"):
        expression[EXPRESSION_INDEX["mouthPress" + side]] *= kept[:, None]
    return replace(raw, expression=expression)


def rows(raw, ring):
    """Row of each skin vertex around the mouth [V], ROWS where farther, and the lip it belongs to.

    The lip [V] is 1 for the upper, -1 for the lower, 0 at the corners and beyond the rows.
    """
    skin = raw.quads[raw.parts == "skin"]
    row = np.full(len(raw.mean), ROWS)
    np.minimum.at(row, skin, rings(skin, ring, ROWS)[:, None] + 1)
    row[ring] = 0
    upper, lower = split_ring(ring, raw.mean, raw.expression[EXPRESSION_INDEX["jawOpen"]])
    lip = np.zeros(len(row))
    lip[upper], lip[lower] = 1, -1
    lip[upper[[0, -1]]] = 0
    sides = np.stack([skin, np.roll(skin, -1, axis=1)], -1).reshape(-1, 2)
    sides = np.concatenate([sides, sides[:, ::-1]])
    for step in range(1, ROWS):
        inward = sides[(row[sides[:, 0]] == step) & (row[sides[:, 1]] == step - 1)]
        found = np.zeros(len(row))
        np.add.at(found, inward[:, 0], lip[inward[:, 1]])
        lip[row == step] = np.sign(found)[row == step]
    return row, lip
