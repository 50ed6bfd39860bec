"""Smooth values on a mesh: close to what is known, and nowhere far from their neighbours'."""

import numba
import numpy as np

from bakery.geometry.mesh import edges as edges_of
from bakery.geometry.mesh import face_normals, scatter_add

SWEEPS = 80
FASTER = 1.7  # over-relaxation, 1 to 2
EQUAL = 1 / np.sqrt(3)  # cotangent weight of an edge between equilateral triangles


class Surface:
    """Neighbours and areas of a mesh, for `relaxed`."""

    def __init__(self, vertices: np.ndarray, faces: np.ndarray) -> None:
        """
        Args:
            vertices: [V, 3] mm; faces: [F, 3].
        """
        count = len(vertices)
        self.edges = edges_of(faces)  # [M, 2]
        ends = self.edges.T.ravel()
        order = np.argsort(ends, kind="stable")
        self.near = self.edges.T[::-1].ravel()[order].astype(np.int32)  # [2 M]
        self.start = np.zeros(count + 1, np.int64)
        np.cumsum(np.bincount(ends, minlength=count), out=self.start[1:])
        area = np.linalg.norm(face_normals(vertices, faces), axis=1) / 6  # a third of each face
        self.area = scatter_add(np.repeat(area, 3)[:, None], faces.ravel(), count)[:, 0]  # mm^2

    def relaxed(
        self, known: np.ndarray, trust: np.ndarray, fixed: np.ndarray, reach: float
    ) -> np.ndarray:
        """Values that minimise sum (x_u - x_v)^2 over edges + sum trust (x - known)^2, begun at `known`.

        Args:
            known: [V, C].
            trust: [V] how much each is believed; 1 is as much as evens out over `reach`.
            fixed: [V] bool, where the values stay as `known` has them.
            reach: mm over which a step of `known` is spread.

        Returns:
            [V, C] float32.
        """
        hold = (self.area / EQUAL * trust / reach**2).astype(np.float32)
        out = np.array(known, np.float32)
        _relax(self.start, self.near, np.asarray(known, np.float32), hold, fixed, out)
        return out


@numba.njit(cache=True, nogil=True)
def _relax(start, near, known, hold, fixed, out):
    """Gauss-Seidel sweeps, forth and back in turns."""
    count, channels = known.shape
    for sweep in range(SWEEPS):
        for k in range(count):
            v = k if sweep % 2 == 0 else count - 1 - k
            mass = hold[v] + (start[v + 1] - start[v])
            if fixed[v] or mass <= 0:
                continue
            for c in range(channels):
                total = hold[v] * known[v, c]
                for n in range(start[v], start[v + 1]):
                    total += out[near[n], c]
                out[v, c] += FASTER * (total / mass - out[v, c])
