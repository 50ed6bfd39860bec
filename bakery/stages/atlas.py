"""The texture atlas of a head at one resolution: which surface point each texel shows."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import ArrayLike

from bakery.geometry.camera import project_camera, to_camera
from bakery.geometry.fill import smoothstep
from bakery.geometry.mesh import vertex_normals
from bakery.geometry.raster import rasterize
from bakery.geometry.sample import at_corners, bilinear
from bakery.heads.base import PARTS, PROXIES, HeadModel
from bakery.memo import once_per_object
from bakery.types import Camera

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

    def at(self, values: ArrayLike) -> np.ndarray:
        """Per-vertex values [V, C] at the texels: [N, C] float32."""
        return at_corners(values, self.corners, self.barycentric)

    def take(self, *parts: str) -> "Atlas":
        """The atlas of the named parts alone."""
        return self.some(self.rows(*parts))

    def some(self, rows: np.ndarray) -> "Atlas":
        """The atlas of some of its texels: their rows, or a boolean for each."""
        return Atlas(
            self.size, self.index[rows], self.face[rows], self.barycentric[rows],
            self.corners[rows], self.part[rows],
        )  # fmt: skip

    def paint(self, values: ArrayLike, background: float = 0) -> np.ndarray:
        """Texel values [N, ...] as a picture [T, T, ...]."""
        values = np.asarray(values)
        out = np.full((self.size * self.size,) + values.shape[1:], background, values.dtype)
        out[self.index] = values
        return out.reshape((self.size, self.size) + values.shape[1:])

    def rows(self, *parts: str) -> np.ndarray:
        """Boolean [N]: texels of the named parts."""
        return np.isin(self.part, [PARTS.index(part) for part in parts])

    @property
    @once_per_object
    def _nearest(self) -> tuple[np.ndarray, np.ndarray]:
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

    def fill_gutter(self, texture: np.ndarray) -> np.ndarray:
        """Grow the charts of a texture [T, T, ...] by GUTTER texels, so that filters find colour."""
        wanted, source = self._nearest
        flat = texture.reshape((-1,) + texture.shape[2:]).copy()
        flat[wanted] = flat[source]
        return flat.reshape(texture.shape)


def make_atlas(head: HeadModel, size: int) -> Atlas:
    """Rasterise the uv layout of a head at `size` texels a side (proxies left out)."""
    keep = np.flatnonzero(~np.isin(head.face_part, [PARTS.index(name) for name in PROXIES]))
    fragments = rasterize(head.uv * size, None, head.uv_faces[keep], (size, size))
    index = np.flatnonzero(fragments.face.ravel() >= 0)
    face = keep[fragments.face.ravel()[index]].astype(np.int32)
    barycentric = fragments.barycentric.reshape(-1, 3)[index]
    return Atlas(size, index, face, barycentric, head.faces[face], head.face_part[face])


@dataclass(frozen=True)
class View:
    """A shape seen by a camera: what unwrapping needs of it."""

    camera: Camera
    points: np.ndarray  # [V, 3] camera space
    normals: np.ndarray  # [V, 3] camera space, unit
    nearest: np.ndarray  # [H, W] float32 mm, z-buffer
    edge: np.ndarray  # [H, W] float32 0..1: 0 on and near silhouettes, 1 away from them


def make_view(
    vertices: np.ndarray,
    head: HeadModel,
    camera: Camera,
    edge: float = 2.5,
    hidden: Sequence[str] = PROXIES,
) -> View:
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


@dataclass(frozen=True)
class Visibility:
    """Where a camera sees the texels of an atlas, a row a texel."""

    pixels: np.ndarray  # [N, 2] float32
    cosine: np.ndarray  # [N] between normal and line of sight
    visible: np.ndarray  # [N] float32 0..1: not hidden, not at a silhouette

    def weight(self, grazing: float = 80.0, full: float = 50.0) -> np.ndarray:
        """How well a texel is seen [N] float32: 0 from `grazing` degrees on, 1 up to `full`."""
        facing = smoothstep(np.cos(np.radians(grazing)), np.cos(np.radians(full)), self.cosine)
        return (facing * self.visible).astype(np.float32)


def visibility_of(atlas: Atlas, view: View, tolerance: float = 2.0) -> Visibility:
    """Where the camera of a View sees the texels of an atlas: Visibility.

    Args:
        tolerance: mm that a visible texel may lie behind the z-buffer.
    """
    points = atlas.at(view.points)
    normals = atlas.at(view.normals)
    pixels = project_camera(points, view.camera).astype(np.float32)
    toward = -points / np.linalg.norm(points, axis=1, keepdims=True)
    cosine = (normals * toward).sum(1) / np.maximum(np.linalg.norm(normals, axis=1), 1e-6)
    x, y = pixels[:, 0], pixels[:, 1]
    inside = (x > 1) & (y > 1) & (x < view.camera.width - 1) & (y < view.camera.height - 1)
    column = np.clip(x.astype(int), 0, view.camera.width - 1)
    row = np.clip(y.astype(int), 0, view.camera.height - 1)
    slack = tolerance + 1.5 * np.sqrt(np.maximum(1 - cosine**2, 0)) / np.maximum(cosine, 0.1)
    seen = inside & (-points[:, 2] < view.nearest[row, column] + slack)
    return Visibility(pixels, cosine, seen * bilinear(view.edge, pixels))


def texel_size(places: np.ndarray, index: np.ndarray) -> float:
    """Millimetres between neighbours in a row of texels: the median.

    Args:
        places: [N, 3] mm of texels; index: [N] theirs, as `Atlas.index`, rising.
    """
    steps = np.linalg.norm(np.diff(places, axis=0), axis=1)
    return float(np.median(steps[np.diff(index) == 1]))


def soften(weight: np.ndarray, inside: np.ndarray, blur: float = 1 / 400) -> np.ndarray:
    """Shrink and blur a weight [T, T] in the atlas so that no binary edge shows, keeping charts.

    Args:
        inside: [T, T] 1 on the charts.
        blur: share of T.
    """
    size = max(3, weight.shape[0] // 256 | 1)
    smallest = cv2.erode(np.where(inside > 0, weight, 1), np.ones((size, size), np.uint8))
    blurred = cv2.GaussianBlur(smallest * inside, (0, 0), weight.shape[0] * blur)
    mass = cv2.GaussianBlur(inside, (0, 0), weight.shape[0] * blur)
    return np.clip(np.minimum(blurred / np.maximum(mass, 1e-3), smallest * 1.5), 0, 1) * inside


def uv_polygon(head: HeadModel, ring: np.ndarray, scale: float, size: int) -> np.ndarray:
    """1 inside a ring of landmarks in the atlas [T, T] float32, scaled about its middle."""
    places = head.landmark_uv()[ring] * size
    places = places.mean(0) + scale * (places - places.mean(0))
    mask = np.zeros((size, size), np.float32)
    cv2.fillPoly(mask, [np.round(places).astype(np.int32)], 1)
    return mask
