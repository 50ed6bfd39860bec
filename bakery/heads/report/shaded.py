"""Shaded previews of head models."""

import cv2
import numpy as np

from bakery.geometry import rotation
from bakery.geometry.mesh import vertex_normals
from bakery.geometry.raster import rasterize
from bakery.geometry.sample import interpolate
from bakery.heads.base import PARTS, PROXIES
from bakery.heads.eyes import iris_vertices
from bakery.heads.report.penetrate import singles

COLORS = {
    "skin": (0.85, 0.66, 0.55),
    "eye_socket": (0.6, 0.3, 0.3),
    "mouth_cavity": (0.5, 0.2, 0.2),
    "teeth_upper": (0.95, 0.93, 0.85),
    "teeth_lower": (0.95, 0.93, 0.85),
    "gums_upper": (0.8, 0.4, 0.4),
    "gums_lower": (0.8, 0.4, 0.4),
    "tongue": (0.75, 0.35, 0.38),
}
WHITE, IRIS, PUPIL = (0.9, 0.9, 0.92), (0.32, 0.45, 0.6), (0.1, 0.1, 0.12)
HIDDEN = (*PROXIES, "lashes", "tear")
BACKGROUND = 0.13
LAMPS = (((-0.4, 0.5, 0.75), 0.72), ((0.7, 0.1, 0.5), 0.25))
DISTANCE = 700.0  # mm from the camera to the middle of the picture


def preview(head, vertices, yaw=0.0, pitch=0.0, center=(0.0, -28.0, 0.0), width=180.0, size=300):
    """A shaded preview of a shape [V, 3] with coloured eyes and teeth.

    Args:
        yaw, pitch: degrees the head is turned to its left and up.
        center: mm, what lies in the middle of the picture; width: mm across at that depth.
        size: pixels.

    Returns:
        [size, size, 3] float32, encoded 0..1.
    """
    shown = ~np.isin(head.face_part, [PARTS.index(name) for name in HIDDEN])
    faces = head.faces[shown]
    turn = rotation.yaw_pitch(yaw, pitch)
    points = (vertices - np.asarray(center)) @ turn.T
    depth = DISTANCE - points[:, 2]
    scale = size / width * DISTANCE / depth
    pixels = np.stack([size / 2 + points[:, 0] * scale, size / 2 - points[:, 1] * scale], -1)
    seen = rasterize(pixels, depth, faces, (size, size))
    normals = interpolate(seen, (vertex_normals(vertices, faces) @ turn.T)[faces])
    normals /= np.maximum(np.linalg.norm(normals, axis=-1, keepdims=True), 1e-6)
    light = 0.18
    for direction, strength in LAMPS:
        light = light + strength * np.clip(normals @ direction / np.linalg.norm(direction), 0, 1)
    color = interpolate(seen, colors(head)[shown])
    picture = np.where((seen.face >= 0)[..., None], color * light[..., None], BACKGROUND)
    return (np.clip(picture, 0, 1) ** (1 / 1.6)).astype(np.float32)


def colors(head):
    """Colour of each corner of each face [F, 3, 3]."""
    out = np.array([COLORS.get(name, WHITE) for name in PARTS])[head.face_part]
    out = np.repeat(out[:, None], 3, axis=1)
    for side in ("left", "right"):
        pole, ring = iris_vertices(head, side)
        inner = np.arange(pole, ring[-1] + 1)
        out[np.isin(head.faces, inner).all(1)] = IRIS
        out[np.isin(head.faces, inner[: 1 + 2 * len(ring)]).all(1)] = PUPIL
    return out


def tile(pictures, columns):
    """Put pictures of one size beside and below each other."""
    blank = np.full_like(pictures[0], BACKGROUND ** (1 / 1.6))
    pictures = pictures + [blank] * (-len(pictures) % columns)
    rows = [np.concatenate(pictures[k : k + columns], 1) for k in range(0, len(pictures), columns)]
    return np.concatenate(rows)


def shapes(head, yaw=0.0, columns=8):
    """All 52 shapes at weight 1 (`penetrate.singles`), with their names."""
    pictures = []
    for name, expression in singles().items():
        picture = preview(head, head.vertices(head.mean, expression), yaw, size=220)
        pictures.append(labelled(picture, name))
    return tile(pictures, columns)


def labelled(picture, text):
    """The picture [H, W, 3] with white text in its top left corner."""
    label = np.zeros(picture.shape, np.uint8)  # OpenCV writes text on bytes only
    cv2.putText(label, text, (4, 13), 0, 0.38, (255, 255, 255), 1, cv2.LINE_AA)
    return np.maximum(picture, label.astype(np.float32) / 255)


def people(head, rng, count=24, columns=6):
    """Random identities, three from the front to one from the side."""
    pictures = []
    for k in range(count):
        shape = head.neutral(rng.normal(size=len(head.identity_basis)))
        yaw = (0.0, 35.0, 0.0, -35.0)[k % 4]
        pictures.append(preview(head, shape, yaw, center=(0, -15, 0), width=270.0))
    return tile(pictures, columns)
