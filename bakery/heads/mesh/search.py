"""Nearest places on a surface.

trimesh's own nearest-surface and ray queries need rtree, which is not among our packages; a k-d tree
over places on the triangles (scipy) finds the same, and rays from a camera are a z-buffer.
"""

import numpy as np

from bakery.geometry.mesh import closest_barycentric, face_normals

SPACING = 5.0  # mm between the places of a triangle that stand for it in the tree
NEAR = 12  # triangles that are looked at for each point


class Nearest:
    """Finds the nearest place on some triangles."""

    def __init__(self, vertices, faces):
        """vertices: [V, 3] mm; faces: [F, 3]."""
        from scipy.spatial import cKDTree
        from trimesh.remesh import subdivide_to_size

        self.triangles = np.asarray(vertices, np.float64)[faces]  # [F, 3, 3]
        normals = face_normals(vertices, faces)
        length = np.linalg.norm(normals, axis=1, keepdims=True)
        self.normals = normals / np.maximum(length, 1e-20)  # [F, 3]
        points, split, self.owner = subdivide_to_size(
            vertices, faces, SPACING, max_iter=12, return_index=True
        )
        self.tree = cKDTree(points[split].mean(1))

    def query(self, points, normals=None, cosine=0.5):
        """The nearest place for each of N points.

        Args:
            points: [N, 3] mm.
            normals: [N, 3] unit; a place whose normal is off by more than `cosine` does not count.

        Returns:
            (face [N], barycentric [N, 3], distance [N] mm, infinite where no place counts).
        """
        count = min(NEAR, len(self.owner))
        found = self.tree.query(points, count)[1].reshape(len(points), count)
        faces = self.owner[found]  # [N, count]
        flat = faces.ravel()
        weights = closest_barycentric(np.repeat(points, count, axis=0), self.triangles[flat])
        at = np.einsum("nk,nkc->nc", weights, self.triangles[flat])
        far = np.linalg.norm(at - np.repeat(points, count, axis=0), axis=1).reshape(faces.shape)
        if normals is not None:
            off = np.einsum("nkc,nc->nk", self.normals[faces], normals) < cosine
            far = np.where(off, np.inf, far)
        rows, best = np.arange(len(points)), far.argmin(1)
        return faces[rows, best], weights.reshape(*faces.shape, 3)[rows, best], far[rows, best]
