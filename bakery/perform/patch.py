"""The part of a head's skin that may stand for the face of other footage, and where it may end."""

from dataclasses import dataclass

import cv2
import numpy as np

from bakery.geometry.relax import Surface
from bakery.heads.base import HeadModel, once_a_mean
from bakery.landmarks import BROWS, EYES, LIPS_OUTER, OVAL

AROUND = 1.12  # of the face's oval: what the patch holds
OUTER = 0.97  # of the oval: beyond it the footage is shown
INNER = 1.06  # of the hull of brows, eyes and mouth: within it the face is replaced
BELOW = np.array([18, 182, 406])  # landmarks below the lower lip, which the hull holds too
NEAR = 14.0  # mm, sigma of what the rim tells the inner face
EASE = 100.0  # mm, more than a face is wide: shapes change into each other from edge to edge


@dataclass(frozen=True, eq=False)
class Patch:
    """Skin of a head around its face, of P vertices."""

    vertices: np.ndarray  # [P] of the head
    faces: np.ndarray  # [F, 3] int32 into them
    surface: Surface  # of the mean head
    inner: np.ndarray  # [P] bool, replaced always
    outer: np.ndarray  # [P] bool, never
    own: np.ndarray  # [P, 1] 0..1: 1 in the inner part, 0 in the outer one, harmonic between
    free: np.ndarray  # [R] vertices of neither: the rim
    near: (
        np.ndarray
    )  # [P, R] float32, what each of the rim counts at each vertex: its area, by distance

    def at(self, values: np.ndarray) -> np.ndarray:
        """Of values [..., V, C] of the head's vertices the patch's: [..., P, C]."""
        return np.ascontiguousarray(values[..., self.vertices, :])


@once_a_mean
def patch_of(head: HeadModel) -> Patch:
    """The Patch of a head model."""
    places = head.landmark_uv()
    middle = places[OVAL].mean(0)

    def ring(points: np.ndarray, scale: float) -> np.ndarray:
        around: np.ndarray = points.mean(0) + scale * (points - points.mean(0))
        return around.astype(np.float32)

    uv = np.zeros((len(head.mean), 2), np.float32)
    skin = head.part_faces("skin")
    uv[head.faces[skin].ravel()] = head.uv[head.uv_faces[skin].ravel()]
    oval = middle + AROUND * (places[OVAL] - middle)
    kept = skin[within(uv, oval)[head.faces[skin]].all(1)]
    vertices, compact = np.unique(head.faces[kept], return_inverse=True)
    faces, here = compact.reshape(-1, 3).astype(np.int32), uv[vertices]
    features = places[np.concatenate([BROWS, *EYES, LIPS_OUTER, BELOW])].astype(np.float32)
    inner = within(here, ring(cv2.convexHull(features)[:, 0], INNER))
    outer = ~within(here, middle + OUTER * (places[OVAL] - middle))
    surface = Surface(head.mean[vertices], faces)
    own = surface.relaxed(
        inner[:, None], np.zeros(len(here)), inner | outer | (surface.area <= 0), EASE
    )
    free, places = np.flatnonzero(~(inner | outer)), np.float32(head.mean[vertices])
    square = (places**2).sum(1)
    apart = square[:, None] + square[free] - 2 * places @ places[free].T
    near = np.float32(surface.area[free]) * np.exp(-0.5 * np.maximum(apart, 0) / NEAR**2)
    return Patch(vertices, faces, surface, inner, outer, np.clip(own, 0, 1), free, near)


def within(points: np.ndarray, ring: np.ndarray) -> np.ndarray:
    """Which of points [N, 2] lie in a polygon [K, 2]: [N] bool."""
    x, y = points[:, 0, None], points[:, 1, None]
    ax, ay = ring.T
    bx, by = np.roll(ring, -1, 0).T
    rise = np.where(by == ay, 1, by - ay)
    crossed = ((ay > y) != (by > y)) & (x < ax + (bx - ax) * (y - ay) / rise)
    odd: np.ndarray = crossed.sum(1) % 2 == 1
    return odd
