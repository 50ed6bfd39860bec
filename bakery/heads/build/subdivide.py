"""Catmull-Clark subdivision as a matrix, and meshes that use it only where it is needed.

Build-time only.

References:
    Catmull, Clark, "Recursively generated B-spline surfaces on arbitrary topological meshes",
    Computer-Aided Design 10(6), 1978.
"""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Level:
    """One round: new vertices are the old ones, then one a face, then one an edge."""

    matrix: object  # scipy csr [V', V]: new positions from old
    quads: np.ndarray  # [4 F, 4]: the four children of face f are rows 4 f .. 4 f + 3
    face_point: np.ndarray  # [F] vertex numbers
    edge_point: dict  # (low, high) -> vertex number


def catmull_clark(quads, count):
    """Subdivide once.

    Args:
        quads: [F, 4] int; count: number of vertices V. Open borders stay cubic curves.

    Returns:
        Level.
    """
    from scipy.sparse import coo_matrix

    F = len(quads)
    sides = np.stack([quads, np.roll(quads, -1, axis=1)], -1).reshape(-1, 2)  # [4 F, 2]
    edges, inverse = np.unique(np.sort(sides, axis=1), axis=0, return_inverse=True)
    inverse = inverse.ravel()
    E = len(edges)
    owner = np.repeat(np.arange(F), 4)
    uses = np.bincount(inverse, minlength=E)
    border = uses == 1
    face_point = count + np.arange(F)
    edge_number = count + F + np.arange(E)
    rows, columns, values = [], [], []

    def put(row, column, value):
        row, column = np.broadcast_arrays(row, column)
        rows.append(row.ravel())
        columns.append(column.ravel())
        values.append(np.broadcast_to(value, row.shape).ravel())

    put(face_point[:, None], quads, 0.25)
    put(edge_number[border][:, None], edges[border], 0.5)
    put(edge_number[~border][:, None], edges[~border], 0.25)
    inner = ~border[inverse]
    put(edge_number[inverse[inner]][:, None], quads[owner[inner]], 0.0625)

    valence = np.bincount(edges.ravel(), minlength=count)
    rim = np.zeros(count, bool)
    rim[edges[border].ravel()] = True
    inside = np.flatnonzero(~rim & (valence > 0))
    n = valence.astype(float)
    put(inside, inside, (n[inside] - 3) / n[inside])
    for a, b in ((0, 1), (1, 0)):  # 2 R / n, R the mean of the edge middles
        at = edges[:, a]
        keep = ~rim[at]
        put(at[keep], at[keep], 1 / n[at[keep]] ** 2)
        put(at[keep], edges[keep, b], 1 / n[at[keep]] ** 2)
    at = quads.ravel()  # Q / n, Q the mean of the face points
    keep = ~rim[at]
    put(at[keep][:, None], quads[owner[keep]], (0.25 / n[at[keep]] ** 2)[:, None])
    on = np.flatnonzero(rim)
    put(on, on, 0.75)
    for a, b in ((0, 1), (1, 0)):
        put(edges[border, a], edges[border, b], 0.125)
    alone = np.flatnonzero(valence == 0)
    put(alone, alone, 1.0)
    total = count + F + E
    matrix = coo_matrix(
        (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))), (total, count)
    ).tocsr()
    side = edge_number[inverse].reshape(F, 4)
    children = np.stack(
        [quads, side, np.repeat(face_point[:, None], 4, 1), np.roll(side, 1, axis=1)], -1
    ).reshape(-1, 4)
    table = {(int(a), int(b)): int(e) for (a, b), e in zip(edges, edge_number)}
    return Level(matrix, children, face_point, table)


def refine(quads, count, levels):
    """Subdivide each quad 0, 1 or 2 times without cracks, and cut it into triangles.

    All vertices lie where two full rounds would put them, so neighbours of different levels meet.

    Args:
        quads: [F, 4]; count: V; levels: [F] 0, 1 or 2.

    Returns:
        (matrix csr [V', V], faces [N, 3] into V', owner [N] the quad each triangle came from).
    """
    one = catmull_clark(quads, count)
    two = catmull_clark(one.quads, one.matrix.shape[0])
    finest = {}
    for quad, level in zip(quads.tolist(), levels):
        for a, b in zip(quad, quad[1:] + quad[:1]):
            key = (min(a, b), max(a, b))
            finest[key] = max(finest.get(key, 0), int(level))

    def between(a, b, table):
        return table[(min(a, b), max(a, b))]

    def half(a, b):
        """Points strictly between a corner and the middle of a side, if the side is that fine."""
        return [between(a, b, two.edge_point)]

    triangles, owners = [], []

    def fill(polygon, hub, owner):
        if len(polygon) == 4:
            a, b, c, d = polygon
            new = [(a, b, c), (a, c, d)]
        else:
            new = [(p, q, hub) for p, q in zip(polygon, polygon[1:] + polygon[:1])]
        triangles.extend(new)
        owners.extend([owner] * len(new))

    for f, (quad, level) in enumerate(zip(quads.tolist(), levels)):
        if level == 2:
            for child in range(4 * f, 4 * f + 4):
                for grandchild in range(4 * child, 4 * child + 4):
                    fill(two.quads[grandchild].tolist(), None, f)
        elif level == 1:
            for k, child in enumerate(range(4 * f, 4 * f + 4)):
                a, after, center, before = one.quads[child].tolist()
                following, previous = quad[(k + 1) % 4], quad[(k - 1) % 4]
                polygon = [a]
                if finest[(min(a, following), max(a, following))] == 2:
                    polygon += half(a, after)
                polygon += [after, center, before]
                if finest[(min(a, previous), max(a, previous))] == 2:
                    polygon += half(before, a)
                fill(polygon, int(two.face_point[child]), f)
        else:
            polygon = []
            for a, b in zip(quad, quad[1:] + quad[:1]):
                polygon.append(a)
                fine = finest[(min(a, b), max(a, b))]
                if fine:
                    middle = between(a, b, one.edge_point)
                    polygon += (
                        [middle] if fine == 1 else [*half(a, middle), middle, *half(middle, b)]
                    )
            fill(polygon, int(one.face_point[f]), f)
    matrix = (two.matrix @ one.matrix).tocsr()
    faces = np.array(triangles)
    used, faces = np.unique(faces, return_inverse=True)
    return matrix[used], faces.reshape(-1, 3), np.array(owners)
