"""Draw one target of a subject for the generator (paGAN section 4)."""

from collections.abc import Sequence

import cv2
import numba
import numpy as np

from bakery.geometry import camera as cameras
from bakery.geometry import rotation
from bakery.geometry.fill import smoothstep
from bakery.geometry.mesh import vertex_normals
from bakery.geometry.raster import rasterize
from bakery.geometry.sample import bilinear, interpolate
from bakery.heads.base import INTERIOR, PARTS, HeadModel
from bakery.types import Camera, Conditions, Fit

SIZE = 512  # pixels of the generator's picture
FACE_RATIO = 0.78  # forehead to chin over the picture's side, as the measurements cut it
DRAWN = ("skin", *INTERIOR)
IRIS = 5.85  # mm, radius of a mean iris
FINER = 1.5  # times the pixels of a picture a side, drawn and then shrunk: or edges and pores alias


def face_camera(
    fit: Fit,
    head: HeadModel,
    neutral: np.ndarray,
    yaw: float = 0.0,
    pitch: float = 0.0,
    size: int = SIZE,
    ratio: float = FACE_RATIO,
) -> Camera:
    """The camera of the generator's picture: the photo's lens and distance, head upright, centred.

    Args:
        yaw, pitch: degrees the head turns to the subject's left and up.
        ratio: height from the top to the bottom landmark over the picture's side.
    """
    points = head.landmarks(neutral)[:468]
    pivot = np.array([0.0, *points[:, 1:].mean(0)])
    straight = cameras.view(fit.camera, 0.0, 0.0, pivot)
    pixels = cameras.project(points, straight)
    low, high = pixels.min(0), pixels.max(0)
    scale = ratio * size / (high[1] - low[1])
    corner = (low + high) / 2 - size / 2 / scale
    framed = cameras.crop(straight, corner[0], corner[1], size, size, scale)
    return cameras.view(framed, yaw, pitch, pivot)


def finer(camera: Camera) -> Camera:
    """The camera that a picture is drawn with before it is `shrunk`."""
    width, height = (round(FINER * side) for side in (camera.width, camera.height))
    return cameras.crop(camera, 0, 0, width, height, FINER)


def shrunk(picture: np.ndarray, camera: Camera) -> np.ndarray:
    """A picture [h, w(, C)] seen by `finer(camera)` in the pixels of the camera: [H, W(, C)]."""
    return cv2.resize(picture, (camera.width, camera.height), interpolation=cv2.INTER_AREA)


def condition(
    head: HeadModel,
    neutral: np.ndarray,
    texture: np.ndarray,
    expression: np.ndarray,
    gaze: Sequence[float] | np.ndarray,
    camera: Camera,
    parts: Sequence[str] = DRAWN,
) -> Conditions:
    """Draw a target.

    Args:
        neutral: [V, 3] mm, neutral shape of the subject.
        texture: [T, T, 3] linear, T_0.
        expression: [E] weights.
        gaze: [2] degrees.
        camera: Camera; its width and height are the picture's.
        parts: names of the parts to draw.

    Returns:
        Conditions.
    """
    vertices = head.vertices(neutral, expression, gaze)
    points = cameras.to_camera(vertices, camera)
    pixels = cameras.project_camera(points, camera)
    faces = head.part_faces(*parts)
    found = rasterize(
        pixels, -points[:, 2], head.faces[faces], (camera.height, camera.width), cull=True
    )
    face, part = np.empty_like(found.face), np.empty(found.face.shape, np.uint8)
    _name_faces(found.face, faces, head.face_part, face, part)
    fragments = type(found)(face, found.barycentric, found.depth)
    normals = interpolate(
        fragments, vertex_normals(points, head.faces).astype(np.float32)[head.faces]
    )
    _make_unit(normals)
    uv = interpolate(fragments, head.uv[head.uv_faces])
    deformed = bilinear(texture, uv * texture.shape[0]) * (face >= 0)[..., None]
    return Conditions(
        camera,
        np.asarray(expression, np.float32),
        np.asarray(gaze, float),
        vertices,
        fragments,
        part,
        normals,
        found.depth,
        _gaze_mask(head, vertices, neutral, gaze, camera, fragments, part),
        deformed,
    )


@numba.njit(cache=True, nogil=True)
def _name_faces(found, faces, parts, face_out, part_out):
    """The face [H, W] of the head, -1 for none, and its part, 255 for none, of those that were drawn."""
    height, width = found.shape
    for y in range(height):
        for x in range(width):
            drawn = found[y, x] >= 0
            face_out[y, x] = faces[found[y, x]] if drawn else -1
            part_out[y, x] = parts[face_out[y, x]] if drawn else 255


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _make_unit(vectors):
    """Divide vectors [H, W, 3] by their length, in place."""
    for y in range(vectors.shape[0]):
        for x in range(vectors.shape[1]):
            a, b, c = vectors[y, x, 0], vectors[y, x, 1], vectors[y, x, 2]
            length = max(np.sqrt(a * a + b * b + c * c), np.float32(1e-6))
            vectors[y, x, 0], vectors[y, x, 1], vectors[y, x, 2] = (
                a / length,
                b / length,
                c / length,
            )


def _gaze_mask(head, vertices, neutral, gaze, camera, fragments, part):
    """Iris and sclera [H, W, 2] as far as the lids leave them open.

    paGAN encodes the gaze as a masked image; two soft masks say where the iris is and what is white.
    """
    out = np.zeros(part.shape + (2,), np.float32)
    axis = rotation.yaw_pitch(*gaze) @ [0.0, 0.0, 1.0]
    centers = head.eye_centers(neutral)
    for which, name in enumerate(("eye_left", "eye_right")):
        mine = part == PARTS.index(name)
        if not mine.any():
            continue
        corner = head.faces[fragments.face[mine]]
        points = np.einsum("nk,nkc->nc", fragments.barycentric[mine], vertices[corner])
        direction = points - centers[which]
        radius = np.linalg.norm(direction, axis=1)
        direction /= np.maximum(radius, 1e-6)[:, None]
        off_axis = np.linalg.norm(np.cross(direction, axis), axis=1) * radius
        iris = 1 - smoothstep(IRIS - 0.4, IRIS + 0.4, off_axis)
        out[mine] = np.stack([iris, 1 - iris], 1)
    return out
