"""The expression texture of a face: what one frame shows of its skin, mouth and eyes, in one square.

    +-------------------------------+
    |  face skin, as in the atlas   |   the oval of the face and a little more
    +----------------+------+-------+
    |  mouth sheet   | eye  |  eye  |   what is seen between the lips and the lids
    +----------------+------+-------+

In the paper the mouth's interior is projected onto the skin between the lips. In the atlases of our
heads lips meet there in a slit of a few texels, so the sheet that spans the lips has a place of its own,
as the caps before the eyeballs have. Both are read wherever they lie, hidden or not: of a closed mouth
they show the lips, of a closed eye the lid, as in the paper.

References:
    Olszewski et al., "Realistic Dynamic Facial Textures from a Single Image using GANs", ICCV 2017,
    sections 4 and 5.4.
"""

from functools import partial
from operator import attrgetter

import cv2
import numpy as np

from bakery.geometry import rotation
from bakery.geometry.color import to_encoded
from bakery.geometry.fill import diffuse
from bakery.geometry.mesh import vertex_normals
from bakery.geometry.raster import rasterize
from bakery.geometry.sample import bilinear
from bakery.heads.base import PARTS, PROXIES, HeadModel
from bakery.landmarks import EYES, LIPS_OUTER, OVAL
from bakery.memo import once_per_object
from bakery.stages.atlas import Atlas, make_view, visibility_of
from bakery.stages.texture.unwrap import shading
from bakery.types import Camera

SIZE = 256  # texels on a side, as in the paper
MARGIN = 1.04  # of the face's oval
SKIN_HEIGHT = 0.635  # share of the square that is face skin; below it lie the proxies
# Left, top, width and height of the proxies in the square.
PLACES = {
    "mouth_sheet": (0.005, 0.655, 0.55, 0.33),
    "eye_cap_left": (0.565, 0.66, 0.21, 0.21),
    "eye_cap_right": (0.785, 0.66, 0.21, 0.21),
}
FEATURES = 10.0  # how much more a texel of mouth or eyes counts than one of skin (section 5.3)
AROUND = ((LIPS_OUTER, 1.15), (EYES[0], 1.5), (EYES[1], 1.5))  # rings of skin that count as much
# Heads that differ in their expressions alone share their places.
_once_a_mean = partial(once_per_object, anchor=attrgetter("mean"))


@_once_a_mean
def expression_atlas(head: HeadModel, size: int = SIZE) -> Atlas:
    """The texels of an expression texture of a head, as an Atlas of `size` texels a side."""
    corners, faces = _placed(head)
    found = rasterize(
        corners.reshape(-1, 2) * size,
        None,
        np.arange(3 * len(faces)).reshape(-1, 3),
        (size, size),
    )
    index = np.flatnonzero(found.face.ravel() >= 0)
    face = faces[found.face.ravel()[index]].astype(np.int32)
    return Atlas(
        size,
        index,
        face,
        found.barycentric.reshape(-1, 3)[index],
        head.faces[face],
        head.face_part[face],
    )


def _placed(head):
    """Corners [n, 3, 2] in the square, 0..1, of the faces [n] that it shows."""
    window = _window(head)
    skin = head.part_faces("skin")
    corners = _on_square(head.uv[head.uv_faces[skin]], window)
    inside = (corners.max((1, 2)) <= 1) & (corners.min((1, 2)) >= 0)
    inside &= corners[..., 1].max(1) <= SKIN_HEIGHT
    out, faces = [corners[inside]], [skin[inside]]
    for name in PROXIES:
        own = head.part_faces(name)
        left, top, width, height = head.uv_rectangles[name]
        share = (head.uv[head.uv_faces[own]] - [left, top]) / [width, height]
        place = np.array(PLACES[name])
        out.append(place[:2] + share * place[2:])
        faces.append(own)
    return np.concatenate(out).astype(np.float32), np.concatenate(faces)


def _window(head):
    """Left, top and side of the square of the head's atlas that holds the face, 0..1."""
    oval = head.landmark_uv()[OVAL]
    low, high = oval.min(0), oval.max(0)
    width, height = high - low
    side = MARGIN * max(width, height / SKIN_HEIGHT)
    return (low[0] + high[0] - side) / 2, low[1] - (SKIN_HEIGHT * side - height) / 2, side


def skin_window(head: HeadModel) -> tuple[float, float, float, float]:
    """Left, top, width and height, shares of the head's atlas, of what the skin's rows show."""
    left, top, side = _window(head)
    return left, top, side, side * SKIN_HEIGHT


def _on_square(uv, window):
    left, top, side = window
    return (uv - [left, top]) / side


def read_texture(
    linear: np.ndarray,
    camera: Camera,
    head: HeadModel,
    vertices: np.ndarray,
    light: np.ndarray | None,
    size: int = SIZE,
    known: np.ndarray | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Read the expression texture off a picture.

    Args:
        linear: [H, W, 3] float32.
        camera: that the head was fitted with in this picture.
        vertices: [V, 3] mm, the shape as it stands in the picture.
        light: [9, 3] irradiance of the fit, camera space; the skin is divided by it. None: not.
        size: texels on a side.
        known: [H, W] 0..1, where the picture shows the face; None: all of it.

    Returns:
        texture [T, T, 3] float32 sRGB-encoded 0..1, continued smoothly where nothing is seen, and
        seen [T, T] float32 0..1.
    """
    atlas = expression_atlas(head, size)
    view = make_view(vertices, head, camera)
    sight = visibility_of(atlas, view)
    skin = atlas.rows("skin")
    weight = np.where(skin, sight.weight(86.0, 70.0), 1).astype(np.float32)
    if known is not None:
        weight *= bilinear(known.astype(np.float32), sight.pixels)
    coarse = _texel_step(sight.pixels, atlas)
    soft = linear
    if coarse > 1:  # what is made smaller is blurred first, or it aliases
        soft = cv2.GaussianBlur(linear, (0, 0), 0.5 * np.sqrt(coarse**2 - 1) + 1e-3)
    color = np.where(skin[:, None], bilinear(soft, sight.pixels), bilinear(linear, sight.pixels))
    if light is not None:
        normals = atlas.at(
            vertex_normals(vertices, head.faces) @ rotation.matrix(camera.rotation).T
        )
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-6)
        color = np.where(skin[:, None], color / shading(normals, light), color)
    seen = atlas.paint(weight)
    texture = diffuse(atlas.paint(np.clip(color, 0, 1).astype(np.float32)), seen)
    return to_encoded(texture).astype(np.float32), seen


def _texel_step(pixels, atlas):
    """Pixels between neighbouring texels of skin in the middle of the face, as they lie."""
    grid = np.full((atlas.size * atlas.size, 2), np.nan, np.float32)
    rows = atlas.rows("skin")
    grid[atlas.index[rows]] = pixels[rows]
    grid = grid.reshape(atlas.size, atlas.size, 2)
    steps = np.linalg.norm(np.diff(grid, axis=1), axis=-1)
    return float(np.nanmedian(steps)) if np.isfinite(steps).any() else 1.0


@_once_a_mean
def feature_weight(head: HeadModel, size: int = SIZE) -> np.ndarray:
    """How much each texel counts [T, T] float32: FEATURES in mouth and eyes, 1 on skin, 0 elsewhere."""
    atlas = expression_atlas(head, size)
    marked = np.zeros((size, size), np.float32)
    places = _on_square(head.landmark_uv(), _window(head)) * size
    for ring, scale in AROUND:
        middle = places[ring].mean(0)
        polygon = middle + scale * (places[ring] - middle)
        cv2.fillPoly(marked, [np.round(polygon).astype(np.int32)], 1)
    flat = np.zeros(size * size, np.float32)
    skin = atlas.part == PARTS.index("skin")
    flat[atlas.index] = np.where(skin, 1 + (FEATURES - 1) * marked.ravel()[atlas.index], FEATURES)
    return flat.reshape(size, size)


def mouth_texels(head: HeadModel, size: int = SIZE) -> np.ndarray:
    """Where [T, T] bool the mouth is: its sheet, and the lips with the skin around them."""
    atlas = expression_atlas(head, size)
    sheet = atlas.paint((atlas.part == PARTS.index("mouth_sheet")).astype(np.uint8)) > 0
    places = _on_square(head.landmark_uv(), _window(head)) * size
    lips = np.zeros((size, size), np.uint8)
    middle = places[LIPS_OUTER].mean(0)
    ring = middle + AROUND[0][1] * (places[LIPS_OUTER] - middle)
    cv2.fillPoly(lips, [np.round(ring).astype(np.int32)], 1)
    out: np.ndarray = sheet | (lips > 0)
    return out
