"""Where skin ends and the mouth and the eye sockets begin on a surface, and which lip or lid is which.

The registered built-in head says roughly where the contours run. On the surface each becomes a closed
line of edges: the cheapest cut between what surely lies outside and what surely lies inside.
"""

from dataclasses import dataclass

import cv2
import numpy as np

from bakery.geometry.cut import SURELY, minimum_cut
from bakery.geometry.mesh import boundary_loops, face_normals
from bakery.geometry.raster import rasterize
from bakery.heads.embed import skin_rims
from bakery.heads.mesh.search import Nearest

OPENINGS = ("mouth", "left eye", "right eye")
PART = {"mouth": "mouth_cavity", "left eye": "eye_socket", "right eye": "eye_socket"}
LOCAL = 16.0  # mm around a contour in which the cut is looked for
SURE = 2.5  # mm from the contour on which a face's side is taken from the built-in head
LEAST = 60.0  # mm2 inside a contour that make it an opening and not a crease
POCKET = 4.0  # mm that it reaches behind its contour; what is only filled does not
AWAY = 6.0  # mm from the built-in head's contour that the one found may lie, on the mean
ALONG = 0.005  # what a mm along the line costs; a mm across, 2 mm off it, costs 1
REACH = 14.0  # mm along the surface that a lip or lid reaches from its contour
DEEP = 3.0  # mm that an open eye lies behind its lids
PIXEL = 0.25  # mm in which eyes are looked into
SHORTEST = 12  # vertices of a contour; `embed.skin_rims` asks for as many


@dataclass(frozen=True)
class Openings:
    """Mouth and eyes of a surface of one piece."""

    inside: np.ndarray  # [F] 0 skin, 1 + number in OPENINGS behind that opening
    rings: tuple  # for each of OPENINGS the contour, vertices in order, or None where it is sealed

    @property
    def sealed(self):
        """Names of those that are not there."""
        return [name for name, ring in zip(OPENINGS, self.rings) if ring is None]


def guide(laid):
    """The contours of the built-in head: (upper, lower) vertices of each opening, as `halves`."""
    lips, (left, right) = skin_rims(laid.head)
    return [halves(laid.head.mean, ring) for ring in (lips, left, right)]


def find(skin, laid):
    """Find the openings of a surface that the built-in head was laid over.

    Args:
        skin: Surface in head space, the skin with what is connected to it; laid: Laid.

    Returns:
        Openings.
    """
    vertices, faces = skin.vertices, skin.faces
    middle = vertices[faces].mean(1)
    normals = face_normals(vertices, faces)
    area = np.linalg.norm(normals, axis=1) / 2
    normals = normals / np.maximum(2 * area, 1e-12)[:, None]
    adjacent = _neighbours(faces)
    inside, rings = np.zeros(len(faces), int), []
    for number, (name, halves) in enumerate(zip(OPENINGS, guide(laid))):
        line = laid.vertices[np.concatenate([halves[0], halves[1][-2:0:-1]])]
        behind, near = _behind(name, line, laid, middle, normals)
        found = None
        if name != "mouth" and not _looks_in(vertices, faces, line):
            rings.append(None)
            continue
        if area[behind == 1].sum() > LEAST:
            side = _cut(vertices, faces, adjacent, line, behind, near)
            hidden = _enclosed(len(faces), adjacent, side, near, area)
            reach = vertices[faces[hidden], 2].min(initial=np.inf)
            if reach < line[:, 2].min() - POCKET:
                found = _contour(vertices, faces[~hidden & (inside == 0)], line)
            if found is not None:
                inside[hidden & (inside == 0)] = 1 + number
        if found is None:  # nothing behind it: perhaps the skin ends here
            found = _contour(vertices, faces[inside == 0], line)
        rings.append(found)
    return Openings(inside, tuple(rings))


def _looks_in(vertices, faces, line):
    """Whether one sees, from the front, in between the lids that a closed line runs along."""
    low, high = line.min(0), line.max(0)
    size = tuple(np.ceil((high - low)[1::-1] / PIXEL).astype(int) + 1)
    near = faces[(np.abs(vertices[faces].mean(1) - line.mean(0)) < 3 * LOCAL).all(1)]
    pixels = (vertices[:, :2] - [low[0], high[1]]) * [1, -1] / PIXEL
    seen = rasterize(pixels, 1000 - vertices[:, 2], near, size)
    opening = np.zeros(size, np.uint8)
    outline = (line[:, :2] - [low[0], high[1]]) * [1, -1] / PIXEL
    cv2.fillPoly(opening, [np.round(outline).astype(np.int32)], 1)
    # Where the lids are, at each place of the opening: as deep as the line at that height and side.
    columns = np.arange(size[1]) * PIXEL + low[0]
    order = np.argsort(line[:, 0])
    lids = np.interp(columns, line[order, 0], line[order, 2])
    behind = lids - (1000 - seen.depth)  # infinite where nothing is
    return bool(np.median(behind[opening > 0]) > DEEP)


def _behind(name, line, laid, middle, normals):
    """Sides of faces by the built-in head: ([F] 1 behind, -1 before, 0 not sure; [F] bool near)."""
    head = laid.head
    away = _distance(middle, line)
    near = np.flatnonzero(away < LOCAL)
    side = np.zeros(len(middle), int)
    labels = {"skin": -1, PART[name]: 1}
    part = np.concatenate([np.full(len(head.part_faces(p)), s) for p, s in labels.items()])
    chosen = head.faces[np.concatenate([head.part_faces(p) for p in labels])]
    close = _distance(laid.vertices[chosen].mean(1), line) < 2 * LOCAL
    found, _, far = Nearest(laid.vertices, chosen[close]).query(middle[near], normals[near], 0.3)
    sure = (away[near] > SURE) & (far < 6.0)
    side[near[sure]] = part[close][found[sure]]
    mask = np.zeros(len(middle), bool)
    mask[near] = True
    return side, mask


def _distance(points, line):
    """Distance [N] mm of points from the vertices of a closed line, refined to 0.5 mm steps."""
    from scipy.spatial import cKDTree

    ends = np.roll(line, -1, axis=0)
    dense = np.concatenate([line + s * (ends - line) for s in np.linspace(0, 1, 5)[:-1]])
    return cKDTree(dense).query(points)[0]


def _neighbours(faces):
    """Pairs of faces [N, 2] that share an edge, and that edge's vertices [N, 2]."""
    from trimesh.graph import face_adjacency

    return face_adjacency(faces, return_edges=True)


def _cut(vertices, faces, adjacent, line, behind, near):
    """Which faces [F] lie on the inner side of the cheapest closed cut near a line."""
    pairs, edges = adjacent
    number = np.full(len(faces), -1)
    local = np.flatnonzero(near)
    number[local] = np.arange(len(local))
    within = near[pairs].all(1)
    a, b = number[pairs[within]].T
    ends = vertices[edges[within]]
    length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    off = _distance(ends.mean(1), line)
    price = np.maximum(np.round(1000 * length * (ALONG + (off / 2.0) ** 2)), 1)
    settled = SURELY * np.stack([behind[local] > 0, behind[local] < 0])
    out = np.zeros(len(faces), bool)
    out[local] = minimum_cut(np.stack([a, b], 1), price.astype(np.int64), *settled)
    return out


def _enclosed(count, adjacent, side, near, area):
    """Faces [F] that the cut parts from the largest piece."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    pairs, _ = adjacent
    kept = ~(near[pairs].all(1) & (side[pairs[:, 0]] != side[pairs[:, 1]]))
    a, b = pairs[kept].T
    graph = coo_matrix((np.ones(len(a)), (a, b)), (count, count))
    label = connected_components(graph, directed=False)[1]
    main = int(np.bincount(label, area).argmax())
    return np.isin(label, np.unique(label[side])) & (label != main)


def _contour(vertices, faces, line):
    """The border of some faces that runs along a closed line: vertices in order, or None."""
    best, off = None, AWAY
    for loop in boundary_loops(faces):
        if len(loop) < SHORTEST:
            continue
        away = max(_distance(vertices[loop], line).mean(), _distance(line, vertices[loop]).mean())
        if away < off:
            best, off = loop, away
    return best


def halves(vertices, ring):
    """Split a contour at its corners, where it is widest.

    Args:
        vertices: [V, 3] mm, head space; ring: vertices in order.

    Returns:
        (upper, lower): vertices from the subject's right to the left, corners in both.
    """
    ring = np.asarray(ring)
    ring = np.roll(ring, -int(vertices[ring, 0].argmin()))
    end = int(vertices[ring, 0].argmax())
    one, two = ring[: end + 1], np.concatenate([ring[end:], ring[:1]])[::-1]
    across = np.linspace(vertices[ring[0], 0], vertices[ring[end], 0], 32)[1:-1]
    heights = [np.interp(across, *vertices[half, :2].T).mean() for half in (one, two)]
    return (one, two) if heights[0] > heights[1] else (two, one)


def regions(vertices, faces, contours):
    """Which lip or lid each vertex [V] belongs to, along the surface: 0 none, else 1 + 2 k + lower.

    Args:
        contours: list of (upper, lower) vertices or None, in the order of OPENINGS.
    """
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import dijkstra

    edges = np.unique(
        np.sort(np.concatenate([faces[:, :2], faces[:, 1:], faces[:, [2, 0]]]), 1), axis=0
    )
    length = np.linalg.norm(vertices[edges[:, 0]] - vertices[edges[:, 1]], axis=1) + 1e-9
    graph = coo_matrix((length, (edges[:, 0], edges[:, 1])), (len(vertices),) * 2).tocsr()
    out, best = np.zeros(len(vertices), int), np.full(len(vertices), REACH)
    for number, pair in enumerate(contours):
        for lower, half in enumerate(pair or ()):
            inner = half[1:-1] if len(half) > 2 else half
            away = dijkstra(graph, directed=False, indices=inner, min_only=True, limit=REACH)
            nearer = away < best
            out[nearer], best[nearer] = 1 + 2 * number + lower, away[nearer]
    return out


def other_side(region):
    """The region across the opening."""
    return region + 1 if region % 2 else region - 1
