"""Boundaries of lids and lips on a head: points that rays from photographs cannot settle.

A ray lands wherever the fitted mesh happens to be, so the rim of a lid embedded a millimetre too
high stays there, round after round, and every eye is fitted half shut. These points are put on the
rims as seen from the front instead; how far along a rim each lies is learned.
"""

import numpy as np

from bakery import landmarks as marks
from bakery.geometry.raster import rasterize
from bakery.heads.base import PARTS, PROXIES, weights

SCALE = 16.0  # pixels per mm
# Upper and lower rim of each opening, from the subject's right to the left.
LIDS = {
    "right": (marks.LID_RIGHT_UPPER, marks.LID_RIGHT_LOWER),
    "left": (marks.LID_LEFT_UPPER[::-1], marks.LID_LEFT_LOWER[::-1]),
}
LIPS = (marks.LIPS_INNER_UPPER, marks.LIPS_INNER_LOWER)
OPENING = {"jawOpen": 0.3}  # parts the lips so that their rims are seen


def shares_along(points, rim):
    """How far [N - 2] along from corner to corner the inner points of a rim lie, mean of faces.

    Args:
        points: [N, >= 468, 2] pixels.
    """
    rim = list(rim)
    first, last = points[:, rim[0]], points[:, rim[-1]]
    axis = last - first
    rest = points[:, rim[1:-1]] - first[:, None]
    return (np.einsum("pnc,pc->pn", rest, axis) / (axis**2).sum(1)[:, None]).mean(0)


class Front:
    """A head seen from the front without perspective."""

    def __init__(self, head, vertices, box):
        """box: left, bottom, right, top in mm."""
        hidden = [PARTS.index(name) for name in (*PROXIES, "lashes", "tear")]
        self.head, self.box = head, box
        self.shown = np.flatnonzero(~np.isin(head.face_part, hidden))
        pixels = np.stack(
            [(vertices[:, 0] - box[0]) * SCALE, (box[3] - vertices[:, 1]) * SCALE], -1
        )
        size = (int((box[3] - box[1]) * SCALE), int((box[2] - box[0]) * SCALE))
        self.seen = rasterize(pixels, 500 - vertices[:, 2], head.faces[self.shown], size, True)
        face = self.seen.face
        self.face = np.where(face >= 0, self.shown[np.maximum(face, 0)], -1)

    def column(self, x):
        """Faces [H] seen down the column of pixels at x mm."""
        at = int(np.clip((x - self.box[0]) * SCALE, 0, self.face.shape[1] - 1))
        return at, self.face[:, at]

    def on_mean(self, row, column):
        """The seen surface point [3] mm, on the mean head."""
        corners = self.head.mean[self.head.faces[self.face[row, column]]]
        return self.seen.barycentric[row, column] @ corners


def rim_points(head, allowed_above, allowed_below, view, xs):
    """The last point above and the first below an opening, at columns xs: two lists of [3] or None.

    Args:
        allowed_above, allowed_below: [F] bool, the faces of the two sides.
    """
    above, below = [], []
    for x in xs:
        column, faces = view.column(x)
        seen = np.maximum(faces, 0)
        skin = head.face_part[seen] == PARTS.index("skin")
        inside = np.flatnonzero((faces >= 0) & ~skin)
        if len(inside) == 0:
            above.append(None)
            below.append(None)
            continue
        top = np.flatnonzero(allowed_above[seen[: inside[0]]] & skin[: inside[0]])
        bottom = np.flatnonzero(allowed_below[seen[inside[-1] + 1 :]] & skin[inside[-1] + 1 :])
        above.append(view.on_mean(top[-1], column) if len(top) else None)
        below.append(view.on_mean(inside[-1] + 1 + bottom[0], column) if len(bottom) else None)
    return above, below


def pinned(head, points, positions, rims, sides):
    """Places of the rim points on the mean head.

    Args:
        points: [N, 478, 2] pixels of neutral or other faces; positions: [468, 3] mm so far.
        rims: (lip ring, (left, right lid rings)), vertices.
        sides: {"lips": (upper faces, lower faces), "left": ..., "right": ...}, [F] bool each.

    Returns:
        {point: [3] mm}.
    """
    out = {}
    opened = head.vertices(head.mean, weights(OPENING))
    lips = head.mean[np.array(rims[0])]
    low, high = lips.min(0), lips.max(0)
    openings = [("lips", LIPS, opened, (low[0] - 2, low[1] - 25, high[0] + 2, high[1] + 12))]
    for side, ring in zip(("left", "right"), rims[1]):
        low, high = head.mean[np.array(ring)].min(0), head.mean[np.array(ring)].max(0)
        box = (low[0] - 3, low[1] - 8, high[0] + 3, high[1] + 8)
        openings.append((side, LIDS[side], head.mean, box))
    for name, pair, shape, box in openings:
        view = Front(head, shape, box)
        for k, rim in enumerate(pair):
            first, last = positions[rim[0]], positions[rim[-1]]
            shares = shares_along(points, rim)
            xs = first[0] + shares * (last[0] - first[0])
            found = rim_points(head, *sides[name], view, xs)[k]
            have = [(0.0, first)] + [(s, p) for s, p in zip(shares, found) if p is not None]
            have.append((1.0, last))
            at, places = np.array([s for s, _ in have]), np.array([p for _, p in have])
            for point, share in zip(rim[1:-1], shares):  # near the corners nothing shows: between
                out[point] = np.array([np.interp(share, at, places[:, c]) for c in range(3)])
    return out
