"""The skin that the photometric fit compares: sample faces, image pyramid, visibility."""

from dataclasses import dataclass

import cv2
import numpy as np

from bakery import landmarks as marks
from bakery.geometry import camera as cameras
from bakery.geometry import mesh
from bakery.geometry.color import to_linear
from bakery.geometry.raster import rasterize
from bakery.memo import once_per_object
from bakery.stages.fit import albedo as fit_albedo
from bakery.stages.fit import expressions as groups

FACING = 0.25  # cosine of the flattest skin whose colour is believed
HIDDEN = 6.0  # mm behind what the camera sees there: occluded
CLEAR = 1.25  # contours of eyes and mouth are grown by this before skin inside them is left out
# Landmarks around what is darker than plain skin in any light, and by how much they are grown.
DARKER = (
    (np.concatenate([marks.BROW_LEFT, marks.EYE_LEFT]), 1.2),
    (np.concatenate([marks.BROW_RIGHT, marks.EYE_RIGHT]), 1.2),
    (marks.LIPS_OUTER, 1.25),
    (np.array([48, 49, 98, 2, 1, 327, 279, 278]), 1.15),
)
OPENINGS = (
    (marks.LID_LEFT_UPPER, marks.LID_LEFT_LOWER),
    (marks.LID_RIGHT_UPPER, marks.LID_RIGHT_LOWER),
    (marks.LIPS_INNER_UPPER, marks.LIPS_INNER_LOWER),
)


@dataclass(frozen=True)
class Samples:
    """The faces of skin whose colour is compared, and what their shape and albedo depend on."""

    corners: np.ndarray  # [N, 3] vertices
    basis: np.ndarray  # [N, 9, I + E'] float32: the corners' coordinates by the unknowns
    albedo_mean: np.ndarray  # [N, 3]
    albedo_modes: np.ndarray  # [N, 3, A]
    plain: np.ndarray  # [N] bool: well inside the face, off brows, eyes, nostrils and lips


@dataclass(frozen=True)
class Level:
    """One level of the image pyramid, around the face."""

    image: np.ndarray  # [h, w, 3] linear
    gradient: np.ndarray  # [h, w, 6] float32: d/dx of the three channels, then d/dy, per pixel
    skin: np.ndarray  # [h, w] 0..1
    left: float  # pixels of the photo
    top: float
    scale: float  # pixels of this level per pixel of the photo


@once_per_object
def choose_samples(head, modes, basis, count):
    """Spread about `count` sample faces evenly over the skin inside the landmarks.

    Args:
        modes: of identity that they know.
    """
    chosen = _even_faces(head, basis, count)
    mean, colours = fit_albedo.vertex_albedo(head, basis)
    moves = np.concatenate([head.identity_basis[:modes], head.expression_basis[groups.FITTED]])
    moves = moves[:, chosen]  # [P, N, 3, 3]
    moves = moves.transpose(1, 2, 3, 0).reshape(len(chosen), 9, -1)
    colours = colours[:, chosen].mean(2).transpose(1, 2, 0)
    return Samples(
        corners=chosen,
        basis=np.ascontiguousarray(moves, np.float32),
        albedo_mean=mean[chosen].mean(1).astype(np.float32),
        albedo_modes=np.ascontiguousarray(colours, np.float32),
        plain=plain_skin(fit_albedo.vertex_chart(head, basis)[chosen].mean(1), basis.layout),
    )


def _even_faces(head, basis, count):
    """Corners [N, 3] of front faces, one a cell of the finest grid with at most `count` cells."""
    faces = head.faces[head.part_faces("skin")]
    centers = fit_albedo.vertex_chart(head, basis)[faces].mean(1)
    normals = mesh.face_normals(head.mean.astype(np.float64), faces)
    usable = normals[:, 2] > 0.2 * np.linalg.norm(normals, axis=1)
    usable &= _within(centers, cv2.convexHull(basis.layout.astype(np.float32))[:, 0])
    for upper, lower in OPENINGS:
        ring = basis.layout[np.concatenate([upper, lower[::-1]])].astype(np.float32)
        usable &= ~_within(centers, (ring - ring.mean(0)) * CLEAR + ring.mean(0))
    candidates = np.flatnonzero(usable)

    def cells(fineness):
        return np.floor(centers[candidates] * fineness).astype(int) @ [1, 1000]

    low, high = 4, 400
    while high - low > 1:
        middle = (low + high) // 2
        few = len(np.unique(cells(middle))) <= count
        low, high = (middle, high) if few else (low, middle)
    return faces[candidates[np.unique(cells(low), return_index=True)[1]]]


def plain_skin(centers, layout):
    """Which places [N, 2] of the chart are plain skin: [N] bool."""

    def inside(landmarks, scale):
        ring = cv2.convexHull(layout[landmarks].astype(np.float32))[:, 0]
        return _within(centers, (ring - ring.mean(0)) * scale + ring.mean(0))

    return inside(marks.OVAL, 0.9) & ~np.any([inside(*what) for what in DARKER], 0)


def _within(points, polygon):
    """Which points [N, 2] lie inside a polygon [M, 2] (even-odd rule): [N] bool."""
    x, y = points.T
    inside = np.zeros(len(points), bool)
    for (ax, ay), (bx, by) in zip(polygon, np.roll(polygon, -1, 0)):
        if ay != by:
            inside ^= ((ay > y) != (by > y)) & (x < (bx - ax) * (y - ay) / (by - ay) + ax)
    return inside


def pyramid(photo, points, skin, widths):
    """Levels of the photo around the face, coarsest first.

    Args:
        photo: Photo; points: [L, 2] pixels; skin: [H, W] 0..1 or None.
        widths: outer-eye-corner distance in pixels at each level.
    """
    height, width = photo.encoded.shape[:2]
    size = marks.face_size(points)
    low = np.maximum(points.min(0) - 0.3 * size, 0).astype(int)
    high = np.minimum(points.max(0) + 0.3 * size, [width, height]).astype(int)
    window = (slice(low[1], high[1]), slice(low[0], high[0]))
    image = photo.encoded[window]
    mask = np.ones(image.shape[:2], np.float32) if skin is None else skin[window]
    levels = []
    for target in sorted(widths, reverse=True):
        scale = min(1.0, target / size)
        want = tuple(max(2, round(n * scale)) for n in image.shape[1::-1])
        first = image if not levels else levels[-1][0]
        small = cv2.resize(first, want, interpolation=cv2.INTER_AREA)
        levels.append((small, cv2.resize(mask, want, interpolation=cv2.INTER_AREA)))
    out = []
    for small, mask in levels:
        linear = to_linear(small)
        across = cv2.Sobel(linear, cv2.CV_32F, 1, 0, ksize=3, scale=1 / 8)
        down = cv2.Sobel(linear, cv2.CV_32F, 0, 1, ksize=3, scale=1 / 8)
        scale = small.shape[1] / image.shape[1]
        stack = np.concatenate([across, down], -1)
        out.append(Level(linear, stack, mask, float(low[0]), float(low[1]), scale))
    return out[::-1]


def sample(image, points):
    """Bilinear values [N, C] of an image [h, w, C] at pixels [N, 2], for a few thousand points."""
    height, width = image.shape[:2]
    place = np.clip(points - 0.5, 0, [width - 1.001, height - 1.001])
    corner = place.astype(int)
    fx, fy = (place - corner).T.astype(np.float32)[..., None]
    flat = image.reshape(height * width, -1)
    start = corner[:, 1] * width + corner[:, 0]
    upper = flat[start] * (1 - fx) + flat[start + 1] * fx
    lower = flat[start + width] * (1 - fx) + flat[start + width + 1] * fx
    return upper * (1 - fy) + lower * fy


def visible_samples(head, neutral, expression, camera, samples, level):
    """Which samples [N] the camera sees on bare skin: 0..1."""
    vertices = neutral + np.tensordot(
        expression[used := np.flatnonzero(expression)].astype(np.float32),
        head.expression_basis[used],
        1,
    )
    inside = cameras.to_camera(vertices, camera)
    pixels = cameras.project_camera(inside, camera)
    pixels = (pixels - [level.left, level.top]) * level.scale
    height, width = level.skin.shape
    faces = head.faces[head.part_faces("skin")]
    seen = rasterize(pixels, -inside[:, 2], faces, (height, width), cull=True)
    corner = inside[samples.corners]  # [N, 3, 3]
    center = corner.mean(1)
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    facing = -(normal * center).sum(1) / (
        np.linalg.norm(normal, axis=1) * np.linalg.norm(center, axis=1) + 1e-9
    )
    where = pixels[samples.corners].mean(1)
    column, row = where.astype(int).T
    within = (column >= 0) & (row >= 0) & (column < width) & (row < height)
    column, row = np.clip(column, 0, width - 1), np.clip(row, 0, height - 1)
    depth = seen.depth[row, column]
    trust = sample(level.skin[..., None], where)[:, 0]
    return trust * within * (facing > FACING) * (-center[:, 2] < depth + HIDDEN)
