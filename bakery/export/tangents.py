"""Tangents of surfaces that wear a normal map, as glTF has them."""

from dataclasses import replace

import numpy as np

from bakery.export.glb import Surface
from bakery.geometry.mesh import scatter_add


def tangents(
    vertices: np.ndarray, normals: np.ndarray, uv: np.ndarray, faces: np.ndarray
) -> np.ndarray:
    """The direction of growing u at each vertex, in the plane across its normal: [V, 3] unit.

    Triangles count by how much of the chart they take.

    Args:
        vertices: [V, 3]; normals: [V, 3] unit; uv: [V, 2]; faces: [F, 3].
    """
    edges = vertices[faces[:, 1:]] - vertices[faces[:, :1]]  # [F, 2, 3]
    steps = uv[faces[:, 1:]] - uv[faces[:, :1]]  # [F, 2, 2]
    turned = np.sign(steps[:, 0, 0] * steps[:, 1, 1] - steps[:, 0, 1] * steps[:, 1, 0])
    along = edges[:, 0] * steps[:, 1, 1, None] - edges[:, 1] * steps[:, 0, 1, None]
    along *= turned[:, None]
    summed = scatter_add(np.repeat(along, 3, 0), faces.ravel(), len(vertices))
    flat = summed - (summed * normals).sum(1, keepdims=True) * normals
    lost = np.linalg.norm(flat, axis=1) < 1e-12  # vertices of no triangle, or of folded charts
    other = np.eye(3)[np.abs(normals[lost]).argmin(1)]
    flat[lost] = other - (other * normals[lost]).sum(1, keepdims=True) * normals[lost]
    return flat / np.linalg.norm(flat, axis=1, keepdims=True)


def with_tangents(surface: Surface) -> Surface:
    """A surface with bends, with tangents and what each shape at weight 1 adds to them.

    The chart may be mirrored: w of a tangent says which way v goes, +1 where cross(normal, tangent)
    points against v, as in a picture that is not mirrored.
    """
    vertices, uv, faces = surface.vertices.astype(np.float64), surface.uv, surface.faces
    normals = surface.normals.astype(np.float64)
    rest = tangents(vertices, normals, uv, faces)
    twists = np.zeros_like(surface.shapes)
    for twist, shape, bend in zip(twists, surface.shapes, surface.bends):
        if shape.any():
            bent = normals + bend
            bent /= np.linalg.norm(bent, axis=1, keepdims=True)
            twist[:] = tangents(vertices + shape, bent, uv, faces) - rest
    found = np.concatenate([rest, _handedness(vertices, normals, uv, faces, rest)[:, None]], 1)
    return replace(surface, tangents=found.astype(np.float32), twists=twists)


def _handedness(vertices, normals, uv, faces, rest):
    """w [V] of tangents [V, 3]."""
    swapped = tangents(vertices, normals, uv[:, ::-1], faces)  # the direction of growing v
    down = (np.cross(normals, rest) * swapped).sum(1)
    return np.where(down > 0, -1.0, 1.0)
