"""How an expression stretches and presses the skin, as channels for the network.

Skin that loses length folds across that direction; where it does is the strongest hint at the lines of
an expression, and normals and the deformed texture say it only between the lines. The strain is that
of the mean head at the landmarks and is drawn over their triangles.
"""

import cv2
import numpy as np

from bakery.geometry.delaunay import delaunay
from bakery.geometry.mesh import scatter_add
from bakery.geometry.raster import rasterize
from bakery.geometry.sample import interpolate
from bakery.landmarks import EYES, FACE, LIPS_INNER
from bakery.memo import once_per_object

CHANNELS = 2  # across the face and along it
FULL = 0.4  # log of the stretch that a byte reaches
SMOOTH = 0.008  # of the picture's side: no corner of a triangle shows


def landmark_fragments(head, pixels, shape):
    """Which triangle of the 468 landmarks each pixel shows: none over the mouth and the eyes.

    Args:
        head: HeadModel.
        pixels: [>= 468, 2] where the landmarks lie in the picture.
        shape: (height, width) of the picture.

    Returns:
        Fragments, faces numbered as in `landmark_faces`.
    """
    where = np.asarray(pixels, float)[:FACE]
    return rasterize(where, None, landmark_faces(head), shape, cull=True)


def landmark_faces(head):
    """Triangles [F, 3] of the 468 landmarks, none over the mouth and the eyes."""
    return _model(head).faces


def strain_channels(head, expression, pixels, found):
    """Log stretch of the skin across and along the face: [H, W, 2] uint8, 128 where there is none.

    Args:
        head: HeadModel.
        expression: [E] weights.
        pixels: [>= 468, 2] where the landmarks lie in the picture.
        found: their `landmark_fragments`.
    """
    model = _model(head)
    values = model.at_landmarks(np.asarray(expression, np.float32))
    drawn = interpolate(found, values[model.faces])
    face = np.ptp(np.asarray(pixels, float)[:FACE], axis=0).max()
    drawn = cv2.GaussianBlur(drawn, (0, 0), SMOOTH * max(face, 1.0))
    return np.round(128 + 127 * np.clip(drawn / FULL, -1, 1)).astype(np.uint8)


class _Strain:
    """The landmarks' triangles of one head, and how its shapes move their corners."""

    def __init__(self, head):
        corners, weight = head.landmark_vertices[:FACE], head.landmark_barycentric[:FACE]
        self.rest = head.landmarks(head.mean)[:FACE].astype(np.float32)
        self.moves = np.einsum("elkc,lk->elc", head.expression_basis[:, corners], weight)
        faces = delaunay(self.rest[:, :2])
        openings = [np.isin(faces, ring).all(1) for ring in (LIPS_INNER, *EYES)]
        faces = faces[~np.any(openings, 0)]
        a, b, c = self.rest[faces].transpose(1, 0, 2)
        turned = np.cross(b - a, c - a)[:, 2] < 0  # seen from the front a face turns one way
        self.faces = np.where(turned[:, None], faces[:, ::-1], faces)
        a, b, c = self.rest[self.faces].transpose(1, 0, 2)
        first, second = b - a, c - a
        normal = np.cross(first, second)
        self.area = np.linalg.norm(normal, axis=1)
        normal /= np.maximum(self.area, 1e-6)[:, None]
        # The face's own axes in each triangle's plane, and their coordinates in its edges.
        axes = np.eye(3, dtype=np.float32)[:CHANNELS, None] - normal.T[:CHANNELS, :, None] * normal
        axes /= np.maximum(np.linalg.norm(axes, axis=-1, keepdims=True), 1e-6)
        gram = np.einsum("fid,fjd->fij", *[np.stack([first, second], 1)] * 2)
        gram += 1e-4 * np.eye(2)
        right = np.einsum("afd,fid->afi", axes, np.stack([first, second], 1))
        self.coordinates = np.linalg.solve(gram[None], right[..., None])[..., 0]  # [2, F, 2]
        self.corners = self.faces.T.ravel()
        mass = np.bincount(self.corners, np.tile(self.area, 3), FACE)
        self.mass = np.maximum(mass, 1e-6)[:, None]  # of the faces around each landmark

    def at_landmarks(self, expression):
        """Log stretch [468, 2] across and along the face."""
        moved = self.rest + np.tensordot(expression, self.moves, 1)
        a, b, c = moved[self.faces].transpose(1, 0, 2)
        edges = np.stack([b - a, c - a], 1)
        length = np.linalg.norm(np.einsum("afi,fid->afd", self.coordinates, edges), axis=-1)
        values = np.log(np.maximum(length, 0.05)).T * self.area[:, None]
        total = scatter_add(np.tile(values, (3, 1)), self.corners, FACE)
        return (total / self.mass).astype(np.float32)


@once_per_object
def _model(head):
    return _Strain(head)
