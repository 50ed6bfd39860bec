"""Shaded previews of surfaces, and where their pixels lie."""

from dataclasses import dataclass
from itertools import product

import cv2
import numpy as np

from bakery.geometry.mesh import vertex_normals
from bakery.geometry.raster import rasterize
from bakery.geometry.sample import interpolate
from bakery.heads.embed import beneath
from bakery.landmarks import face_size

SIZE = 720  # pixels of a drawn view
AXES = {
    mark + name: sign * np.eye(3)["xyz".index(name)]
    for name, (mark, sign) in product("xyz", (("", 1.0), ("-", -1.0)))
}
FRONTS = {"y": ("z", "-z", "x", "-x"), "z": ("-y", "y", "x", "-x"), "x": ("z", "-z", "y", "-y")}
LENS = 8.0  # distance of the camera, in half widths of the picture
SKIN = np.array([0.80, 0.58, 0.47])  # linear
LAMPS = (((-0.3, 0.5, 0.8), 0.65), ((0.6, 0.1, 0.6), 0.2))


@dataclass(frozen=True)
class View:
    """A drawn surface."""

    picture: np.ndarray  # [SIZE, SIZE, 3] uint8, sRGB
    face: np.ndarray  # [SIZE, SIZE] int, -1 where nothing is
    place: np.ndarray  # [SIZE, SIZE, 3] where on the surface, in the file's unit and axes
    facing: np.ndarray  # [SIZE, SIZE] cosine between normal and line of sight, negative from behind
    depth: np.ndarray  # [SIZE, SIZE] from the camera, in the file's unit
    turn: np.ndarray  # [3, 3] from the file's axes to the picture's
    middle: np.ndarray  # [3] what lies in the middle of the picture
    half: float  # half of what the picture is wide there

    @property
    def eye(self):
        """Where it was drawn from, [3] in the file's unit and axes."""
        return self.middle + LENS * self.half * self.turn[2]

    def pixels(self, points):
        """Where points [N, 3] are drawn: [N, 2]."""
        return _project((points - self.middle) @ self.turn.T / self.half)[0]

    def rays(self, points):
        """Directions [N, 3] from the eye through pixels [N, 2], in the file's axes."""
        x, y = (2 * points / SIZE - 1).T
        rays = np.stack([x, -y, np.full(len(x), -LENS)], -1)
        return rays / np.linalg.norm(rays, axis=1, keepdims=True) @ self.turn


def draw(surface, turn, middle, half, color=None):
    """Draw a shaded preview of a surface.

    Args:
        turn: [3, 3] from the file's axes to the picture's: right, up, toward the camera.
        middle: [3] what lies in the middle of the picture; half: half of what it is wide there.
        color: [F, 3] linear colour of each face; None for SKIN.

    Returns:
        View.
    """
    points = (surface.vertices - middle) @ turn.T / half
    pixels, depth = _project(points)
    seen = rasterize(pixels, depth, surface.faces, (SIZE, SIZE))
    normals = interpolate(seen, vertex_normals(points, surface.faces)[surface.faces])
    normals /= np.maximum(np.linalg.norm(normals, axis=-1, keepdims=True), 1e-6)
    facing = normals[..., 2]
    normals *= np.where(facing < 0, -1, 1)[..., None]
    light = 0.25 + sum(
        strength * np.clip(normals @ direction / np.linalg.norm(direction), 0, 1)
        for direction, strength in LAMPS
    )
    shown = seen.face >= 0
    base = SKIN if color is None else color[np.maximum(seen.face, 0)]
    lit = np.where(shown[..., None], light[..., None] * base, 0.25)
    picture = np.round(255 * np.clip(lit, 0, 1) ** (1 / 2.2)).astype(np.uint8)
    place = interpolate(seen, surface.vertices[surface.faces])
    return View(picture, seen.face, place, facing, seen.depth * half, turn, middle, half)


def _project(points):
    """Pixels [N, 2] and depth [N] of points [N, 3] in half widths about the middle."""
    depth = LENS - points[:, 2]
    scale = SIZE / 2 * LENS / depth
    x, y = points[:, 0] * scale, points[:, 1] * scale
    return np.stack([SIZE / 2 + x, SIZE / 2 - y], -1), depth


def cast(view, points):
    """Where pixels [N, 2] of a view lie on the surface.

    Returns:
        (places [N, 3], weight [N] 0..1: 0 beside the surface, small where it turns away).
    """
    unit = 90.0 / max(face_size(points), 1.0)  # mm a pixel, near enough
    there = (view.face >= 0) & ~beneath(view.depth, 1 / unit)
    _, label = cv2.distanceTransformWithLabels(
        (~there).astype(np.uint8), cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL
    )
    rows, columns = np.nonzero(there)
    table = np.zeros((label.max() + 1, 2), int)
    table[label[rows, columns]] = np.stack([rows, columns], 1)
    column, row = np.clip(points, 0, SIZE - 1).astype(int).T
    near_row, near_column = table[label[row, column]].T
    off = np.hypot(near_row - row, near_column - column) * unit
    facing = np.abs(view.facing[near_row, near_column])
    return view.place[near_row, near_column], facing**2 * np.clip(1.5 - off / 6.0, 0, 1)


def frames(up=None):
    """Axes to look at a file from, likeliest first: matrices [3, 3] as `draw` takes them."""
    tried = [up] if up else ["y", "z", "x", "-y", "-z", "-x"]
    for name in tried:
        for front in FRONTS[name[-1]]:
            yield np.stack([np.cross(AXES[name], AXES[front]), AXES[name], AXES[front]])


def first_view(surface, turn):
    """The whole of a surface as `draw` shows it along some axes."""
    points = surface.vertices @ turn.T
    low, high = points.min(0), points.max(0)
    return draw(surface, turn, turn.T @ ((low + high) / 2), 0.55 * (high - low)[:2].max())
