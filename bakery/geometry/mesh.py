"""Triangle meshes: normals, areas, neighbours."""

import numpy as np


def face_normals(vertices, faces):
    """Normals [F, 3], as long as twice the face's area."""
    a, b, c = vertices[faces[:, 0]], vertices[faces[:, 1]], vertices[faces[:, 2]]
    return np.cross(b - a, c - a)


def scatter_add(values, index, count):
    """Sum rows `values` [N, C] into `count` bins by `index` [N]: [count, C] float64."""
    return np.stack([np.bincount(index, values[:, c], count) for c in range(values.shape[1])], 1)


def vertex_normals(vertices, faces):
    """Unit normals [V, 3], weighted by area; a vertex without faces gets +z."""
    normals = face_normals(vertices, faces)
    total = sum(scatter_add(normals, faces[:, corner], len(vertices)) for corner in range(3))
    length = np.linalg.norm(total, axis=1, keepdims=True)
    return np.where(length > 0, total / np.maximum(length, 1e-20), [0.0, 0.0, 1.0])


def edges(faces):
    """The undirected edges [N, 2], each once, lower index first."""
    pairs = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    return np.unique(np.sort(pairs, axis=1), axis=0)


def boundary_loops(faces):
    """The open borders, as lists of vertices in the direction of their faces, longest first."""
    directed = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    inner = {(int(b), int(a)) for a, b in directed}
    follow = {int(a): int(b) for a, b in directed if (int(a), int(b)) not in inner}
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
