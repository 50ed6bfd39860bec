"""Light in the mouth of programs that know nothing of it: it gets dark behind the lips.

Players of bakery show baked pictures of the mouth. Others draw teeth, tongue and cavity as they are,
most of them without light, so that all would be as bright as the incisors.
"""

import numpy as np

from bakery.heads.base import HeadModel
from bakery.landmarks import LIPS_INNER, MOUTH_CORNERS
from bakery.stages.atlas import make_atlas

PARTS = {  # part -> mm over which light falls to 1/e behind its front, and colour at its front
    "teeth_upper": (17.0, (1.0, 0.99, 0.97)),
    "teeth_lower": (17.0, (0.92, 0.90, 0.87)),
    "gums_upper": (15.0, (0.95, 0.72, 0.72)),
    "gums_lower": (15.0, (0.88, 0.66, 0.66)),
    "tongue": (16.0, (1.35, 1.0, 1.02)),
    "mouth_cavity": (9.0, (1.0, 0.85, 0.85)),
}
LEAST = 0.08  # of the light, in the throat
# Beside the corners of the lips hardly any light comes in: from this share of their distance from the
# middle to that one it falls to SIDE.
CORNERS, SIDE = (0.62, 1.08), 0.12
NECK = (0.35, 6.0)  # of the light that crowns lose at the gums, and mm from their edge over which


def mouth_light(head: HeadModel, neutral: np.ndarray, size: int) -> np.ndarray:
    """What light is left on teeth, gums, tongue and cavity of a mouth that opens.

    Args:
        neutral: [V, 3] mm.
        size: texels on a side, T.

    Returns:
        [T, T, 3] float32: factor on linear colour, 1 off these parts.
    """
    neutral = np.asarray(neutral, np.float64)
    marks = np.asarray(head.landmarks(neutral), np.float64)
    behind = _behind_lips(neutral, marks[LIPS_INNER])
    corner = np.abs(marks[MOUTH_CORNERS, 0]).mean()
    aside = np.clip((np.abs(neutral[:, 0]) / corner - CORNERS[0]) / (CORNERS[1] - CORNERS[0]), 0, 1)
    sideways = 1 - (1 - SIDE) * aside**2 * (3 - 2 * aside)
    light = np.ones((len(neutral), 3))
    for part, (fall, color) in PARTS.items():
        mine = head.part_vertices(part)
        if not len(mine):
            continue
        depth = behind[mine]
        first = max(np.percentile(depth, 5), 0) if part != "mouth_cavity" else 0.0
        level = np.exp(-np.maximum(depth - first, 0) / fall)
        if part != "mouth_cavity":  # its rim goes on as lips
            level *= sideways[mine]
        if part.startswith("teeth"):
            level *= 1 - NECK[0] * np.clip(_from_edge(neutral[mine], part) / NECK[1], 0, 1)
        light[mine] = np.maximum(level, LEAST)[:, None] * color
        if part == "mouth_cavity":
            light[mine] = 1 + (light[mine] - 1) * np.clip(depth / 3, 0, 1)[:, None]
    atlas = make_atlas(head, size)
    rows = atlas.rows(*PARTS)
    picture = np.ones((size * size, 3), np.float32)
    picture[atlas.index[rows]] = atlas.at(light)[rows]
    return atlas.fill_gutter(picture.reshape(size, size, 3))


def _behind_lips(points, lips):
    """How far points [V, 3] lie behind the seam of the lips [n, 3] beside the same column: [V] mm."""
    order = np.argsort(np.abs(lips[:, 0]))
    seam = np.interp(np.abs(points[:, 0]), np.abs(lips[order, 0]), lips[order, 2])
    return seam - points[:, 2]


def _from_edge(points, part):
    """How far points [n, 3] of crowns lie from their biting edges: [n] mm."""
    height = points[:, 1] if part == "teeth_upper" else -points[:, 1]
    return height - np.percentile(height, 10)
