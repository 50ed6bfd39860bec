"""Triangle meshes: normals, areas, neighbours."""

import numba
import numpy as np

LEAST = 1e-20  # of a squared length or area: less is none, and nothing is divided by it


def face_normals(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Normals [F, 3], as long as twice the face's area."""
    a, b, c = vertices[faces[:, 0]], vertices[faces[:, 1]], vertices[faces[:, 2]]
    return np.cross(b - a, c - a)


def scatter_add(values: np.ndarray, index: np.ndarray, count: int) -> np.ndarray:
    """Sum rows `values` [N, C] into `count` bins by `index` [N]: [count, C] float64."""
    return np.stack([np.bincount(index, values[:, c], count) for c in range(values.shape[1])], 1)


def vertex_normals(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Unit normals [V, 3], weighted by area; a vertex without faces gets +z."""
    total = np.zeros((3, len(vertices), 3))
    _add_normals(vertices, faces, total)
    total = total[0] + total[1] + total[2]
    length = np.linalg.norm(total, axis=1, keepdims=True)
    return np.where(length > 0, total / np.maximum(length, 1e-20), [0.0, 0.0, 1.0])


@numba.njit(cache=True, nogil=True)
def _add_normals(vertices, faces, total):
    """Add `face_normals` to each corner's vertex; each corner has sums of its own, as `scatter_add`."""
    for f in range(len(faces)):
        a, b, c = vertices[faces[f, 0]], vertices[faces[f, 1]], vertices[faces[f, 2]]
        ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
        vx, vy, vz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
        x, y, z = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        for corner in range(3):
            sums = total[corner, faces[f, corner]]
            sums[0] += x
            sums[1] += y
            sums[2] += z


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
    out = np.zeros((len(points), 3))
    _closest(
        np.ascontiguousarray(points, np.float64), np.ascontiguousarray(triangles, np.float64), out
    )
    return out


@numba.njit(cache=True, nogil=True)
def _minus(a, b):
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@numba.njit(cache=True, nogil=True)
def _dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@numba.njit(cache=True, nogil=True)
def _cross(a, b):
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@numba.njit(cache=True, nogil=True)
def _closest(points, triangles, out):
    for n in range(len(points)):
        point, triangle = points[n], triangles[n]
        best = np.inf
        for first in range(3):
            start, end = triangle[first], triangle[(first + 1) % 3]
            edge, away = _minus(end, start), _minus(point, start)
            along = min(max(_dot(away, edge) / max(_dot(edge, edge), LEAST), 0.0), 1.0)
            off = (
                start[0] + along * edge[0] - point[0],
                start[1] + along * edge[1] - point[1],
                start[2] + along * edge[2] - point[2],
            )
            distance = _dot(off, off)
            if distance < best:
                best = distance
                out[n] = 0
                out[n, first], out[n, (first + 1) % 3] = 1 - along, along
        a, b, c = triangle[0], triangle[1], triangle[2]
        normal = _cross(_minus(b, a), _minus(c, a))
        area = _dot(normal, normal)
        if area > LEAST:
            u = _dot(_cross(_minus(c, b), _minus(point, b)), normal) / area
            v = _dot(_cross(_minus(a, c), _minus(point, c)), normal) / area
            w = _dot(_cross(_minus(b, a), _minus(point, a)), normal) / area
            if u >= 0 and v >= 0 and w >= 0:
                whole = u + v + w
                out[n, 0], out[n, 1], out[n, 2] = u / whole, v / whole, w / whole
