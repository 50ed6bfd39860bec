"""Triangle meshes: normals, areas, neighbours."""

import numpy as np


def face_normals(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Normals [F, 3], as long as twice the face's area."""
    a, b, c = vertices[faces[:, 0]], vertices[faces[:, 1]], vertices[faces[:, 2]]
    return np.cross(b - a, c - a)


def scatter_add(values: np.ndarray, index: np.ndarray, count: int) -> np.ndarray:
    """Sum rows `values` [N, C] into `count` bins by `index` [N]: [count, C] float64."""
    return np.stack([np.bincount(index, values[:, c], count) for c in range(values.shape[1])], 1)


def vertex_normals(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Unit normals [V, 3], weighted by area; a vertex without faces gets +z."""
    normals = face_normals(vertices, faces)
    total = sum(scatter_add(normals, faces[:, corner], len(vertices)) for corner in range(3))
    length = np.linalg.norm(total, axis=1, keepdims=True)
    return np.where(length > 0, total / np.maximum(length, 1e-20), [0.0, 0.0, 1.0])


def edges(faces: np.ndarray) -> np.ndarray:
    """The undirected edges [N, 2], each once, lower index first."""
    pairs = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    return np.unique(np.sort(pairs, axis=1), axis=0)


def boundary_loops(faces: np.ndarray) -> list[list[int]]:
    """The open borders, as lists of vertices in the direction of their faces, longest first."""
    directed = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    here, back = (directed.astype(np.int64) @ m for m in ([1 << 32, 1], [1, 1 << 32]))
    follow = dict(directed[~np.isin(here, back)].tolist())
    loops = []
    while follow:
        start, vertex = next(iter(follow.items()))
        loop = [start]
        del follow[start]
        while vertex != start and vertex in follow:
            loop.append(vertex)
            vertex = follow.pop(vertex)
        loops.append(loop)
    return sorted(loops, key=len, reverse=True)


def closest_barycentric(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """The closest point of each triangle, as barycentric coordinates.

    Args:
        points: [N, 3].
        triangles: [N, 3, 3] corners.

    Returns:
        [N, 3], not negative, sum 1.

    References:
        Ericson, "Real-Time Collision Detection", sec. 5.1.5: the plane's point where it lies
        inside, else the closest point of the three edges.
    """
    a, b, c = triangles[:, 0], triangles[:, 1], triangles[:, 2]
    best = np.full(len(points), np.inf)
    out = np.zeros((len(points), 3))
    for start, end in ((0, 1), (1, 2), (2, 0)):
        edge = triangles[:, end] - triangles[:, start]
        length = np.maximum((edge**2).sum(1), 1e-20)
        along = np.clip(((points - triangles[:, start]) * edge).sum(1) / length, 0, 1)
        off = ((triangles[:, start] + along[:, None] * edge - points) ** 2).sum(1)
        nearer = off < best
        best[nearer] = off[nearer]
        out[nearer] = 0
        out[nearer, start] = 1 - along[nearer]
        out[nearer, end] = along[nearer]
    normal = np.cross(b - a, c - a)
    area = np.maximum((normal**2).sum(1), 1e-20)
    plane = (
        np.stack(
            [
                (np.cross(c - b, points - b) * normal).sum(1),
                (np.cross(a - c, points - c) * normal).sum(1),
                (np.cross(b - a, points - a) * normal).sum(1),
            ],
            1,
        )
        / area[:, None]
    )
    inside = (plane >= 0).all(1) & ((normal**2).sum(1) > 1e-20)
    out[inside] = plane[inside] / plane[inside].sum(1, keepdims=True)
    return out
