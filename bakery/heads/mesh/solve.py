"""Sparse operators on a triangle mesh, and their solution."""

import numpy as np

from bakery.geometry.mesh import face_normals

SLIVER = 1e-3  # mm2: smaller triangles count as if they had this area


def gradient(vertices, faces):
    """The gradient of a function on the vertices in each triangle: (sparse [3 F, V], area [F]).

    Row 3 f + c is component c in triangle f.
    """
    from scipy.sparse import coo_matrix

    corners = np.asarray(vertices, np.float64)[faces]
    normal = face_normals(vertices, faces).astype(np.float64)
    twice = np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 2 * SLIVER)
    unit = normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    F = len(faces)
    values = np.empty((F, 3, 3))  # [F, corner, component]
    for k in range(3):
        opposite = corners[:, (k + 2) % 3] - corners[:, (k + 1) % 3]
        values[:, k] = np.cross(unit, opposite) / twice
    rows = 3 * np.arange(F)[:, None, None] + np.arange(3)[None, None, :] + np.zeros((1, 3, 1), int)
    columns = np.broadcast_to(faces[:, :, None], (F, 3, 3))
    shape = (3 * F, len(vertices))
    matrix = coo_matrix((values.ravel(), (rows.ravel(), columns.ravel())), shape).tocsr()
    return matrix, twice[:, 0] / 2


def stiffness(vertices, faces):
    """The cotangent matrix [V, V]: x' K x is the integral of the squared gradient of x."""
    from scipy.sparse import diags

    G, area = gradient(vertices, faces)
    return (G.T @ diags(np.repeat(area, 3)) @ G).tocsc()


def vertex_areas(vertices, faces):
    """Area [V] mm2 that belongs to each vertex: a third of its triangles'; little where none is."""
    area = np.linalg.norm(face_normals(vertices, faces), axis=1) / 2
    out = sum(np.bincount(faces[:, k], area / 3, len(vertices)) for k in range(3))
    return np.maximum(out, SLIVER)


def factorized(matrix):
    """A function that solves matrix x = b for a symmetric positive definite matrix."""
    from scipy.sparse.linalg import splu

    return splu(
        matrix.tocsc(),
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    ).solve
