"""The texture atlas of a head at one resolution: which surface point each texel shows."""

from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np

from bakery.geometry.camera import project_camera, to_camera
from bakery.geometry.mesh import vertex_normals
from bakery.geometry.raster import rasterize
from bakery.geometry.sample import bilinear
from bakery.heads.base import CARRIERS, PARTS

GUTTER = 6  # texels that charts grow into the space between them, at any resolution


@dataclass(frozen=True)
class Atlas:
    """Texels of a head's atlas that lie on a face, in rows of `index`."""

    size: int  # T
    index: np.ndarray  # [N] flat texel numbers
    face: np.ndarray  # [N] int32
    barycentric: np.ndarray  # [N, 3] float32
    corners: np.ndarray  # [N, 3] int32, vertices of the face
    part: np.ndarray  # [N] uint8 into PARTS

    def at(self, values):
        """Per-vertex values [V, C] at the texels: [N, C] float32."""
        weights = self.barycentric
        values = np.asarray(values, np.float32)
        return (
            values[self.corners[:, 0]] * weights[:, :1]
            + values[self.corners[:, 1]] * weights[:, 1:2]
            + values[self.corners[:, 2]] * weights[:, 2:]
        )

    def paint(self, values, background=0):
        """Texel values [N, ...] as a picture [T, T, ...]."""
        values = np.asarray(values)
        out = np.full((self.size * self.size,) + values.shape[1:], background, values.dtype)
        out[self.index] = values
        return out.reshape((self.size, self.size) + values.shape[1:])

    def rows(self, *parts):
        """Boolean [N]: texels of the named parts."""
        return np.isin(self.part, [PARTS.index(part) for part in parts])

    @cached_property
    def _nearest(self):
        """Flat number of the nearest texel on a face, for every texel within the gutter."""
        empty = np.ones(self.size * self.size, np.uint8)
        empty[self.index] = 0
        distance, label = cv2.distanceTransformWithLabels(
            empty.reshape(self.size, self.size),
            cv2.DIST_L2,
            cv2.DIST_MASK_5,
            labelType=cv2.DIST_LABEL_PIXEL,
        )
        of_label = np.zeros(int(label.max()) + 1, np.int64)
        of_label[label.ravel()[self.index]] = self.index
        wanted = np.flatnonzero((distance.ravel() > 0) & (distance.ravel() <= GUTTER))
        return wanted, of_label[label.ravel()[wanted]]

    def fill_gutter(self, texture):
        """Grow the charts of a texture [T, T, ...] by GUTTER texels, so that filters find colour."""
        wanted, source = self._nearest
        flat = texture.reshape((-1,) + texture.shape[2:]).copy()
        flat[wanted] = flat[source]
        return flat.reshape(texture.shape)


def make_atlas(head, size):
    """Rasterise the uv layout of a head at `size` texels a side (carriers left out)."""
    keep = np.flatnonzero(~np.isin(head.face_part, [PARTS.index(name) for name in CARRIERS]))
    fragments = rasterize(head.uv * size, None, head.uv_faces[keep], (size, size))
    index = np.flatnonzero(fragments.face.ravel() >= 0)
    face = keep[fragments.face.ravel()[index]].astype(np.int32)
    barycentric = fragments.barycentric.reshape(-1, 3)[index]
    return Atlas(size, index, face, barycentric, head.faces[face], head.face_part[face])


@dataclass(frozen=True)
class View:
    """A shape seen by a camera: what unwrapping needs of it."""

    camera: object
    points: np.ndarray  # [V, 3] camera space
    normals: np.ndarray  # [V, 3] camera space, unit
    nearest: np.ndarray  # [H, W] float32 mm, z-buffer
    edge: np.ndarray  # [H, W] float32 0..1: 0 on and near silhouettes, 1 away from them


def make_view(vertices, head, camera, edge=2.5, hidden=CARRIERS):
    """Prepare a shape [V, 3] (head space) for `unwrap` through `camera`.

    Args:
        edge: pixels that visibility shrinks at depth edges (PITFALLS: nostril and jaw staircases).
        hidden: parts that do not occlude.
    """
    points = to_camera(vertices, camera)
    drawn = np.flatnonzero(
        ~np.isin(head.face_part, [PARTS.index(name) for name in (*hidden, "lashes", "tear")])
    )
    pixels = project_camera(points, camera)
    fragments = rasterize(
        pixels, -points[:, 2], head.faces[drawn], (camera.height, camera.width), cull=True
    )
    nearest = np.where(np.isfinite(fragments.depth), fragments.depth, 1e5).astype(np.float32)
    kernel = np.ones((3, 3), np.uint8)
    jump = (cv2.dilate(nearest, kernel) - cv2.erode(nearest, kernel)) > 8
    distance = cv2.distanceTransform((~jump).astype(np.uint8), cv2.DIST_L2, 3)
    return View(
        camera,
        points,
        vertex_normals(points, head.faces),
        nearest,
        np.clip((distance - edge) / 2, 0, 1).astype(np.float32),
    )


def see(atlas, rows, view, grazing=80.0, full=50.0, tolerance=2.0):
    """Where a camera sees texels and how well.

    Args:
        rows: [n] rows of the atlas.
        grazing, full: degrees between normal and sight: weight 0 from `grazing`, 1 up to `full`.
        tolerance: mm that a visible texel may lie behind the z-buffer.

    Returns:
        pixels [n, 2] and weight [n] float32 0..1.
    """
    part = Atlas(
        atlas.size, atlas.index[rows], atlas.face[rows], atlas.barycentric[rows],
        atlas.corners[rows], atlas.part[rows],
    )  # fmt: skip
    points = part.at(view.points)
    normals = part.at(view.normals)
    pixels = project_camera(points, view.camera).astype(np.float32)
    toward = -points / np.linalg.norm(points, axis=1, keepdims=True)
    cosine = (normals * toward).sum(1) / np.maximum(np.linalg.norm(normals, axis=1), 1e-6)
    low, high = np.cos(np.radians(grazing)), np.cos(np.radians(full))
    facing = np.clip((cosine - low) / (high - low), 0, 1)
    facing = facing * facing * (3 - 2 * facing)
    x, y = pixels[:, 0], pixels[:, 1]
    inside = (x > 1) & (y > 1) & (x < view.camera.width - 1) & (y < view.camera.height - 1)
    column = np.clip(x.astype(int), 0, view.camera.width - 1)
    row = np.clip(y.astype(int), 0, view.camera.height - 1)
    slack = tolerance + 1.5 * np.sqrt(np.maximum(1 - cosine**2, 0)) / np.maximum(cosine, 0.1)
    seen = inside & (-points[:, 2] < view.nearest[row, column] + slack)
    weight = facing * seen * bilinear(view.edge, pixels)
    return pixels, weight.astype(np.float32)
