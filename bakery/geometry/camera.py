"""The pinhole camera of `bakery.geometry` and its Jacobian."""

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from bakery.geometry import rotation
from bakery.types import Camera


def to_camera(points: np.ndarray, camera: Camera) -> np.ndarray:
    """Head space [..., 3] mm to camera space [..., 3] mm."""
    return points @ rotation.matrix(camera.rotation).T + camera.translation


def project_camera(points: np.ndarray, camera: Camera) -> np.ndarray:
    """Camera space [..., 3] mm to pixels [..., 2]."""
    scale = camera.focal / -points[..., 2]
    return np.stack(
        [camera.center[0] + points[..., 0] * scale, camera.center[1] - points[..., 1] * scale], -1
    )


def project(points: np.ndarray, camera: Camera) -> np.ndarray:
    """Head space [..., 3] mm to pixels [..., 2]."""
    return project_camera(to_camera(points, camera), camera)


def projection_jacobian(points: np.ndarray, camera: Camera) -> np.ndarray:
    """Derivative [..., 2, 3] of the pixels by the camera-space points [..., 3]."""
    inverse = 1 / -points[..., 2]
    out = np.zeros(points.shape[:-1] + (2, 3), points.dtype)
    out[..., 0, 0] = camera.focal * inverse
    out[..., 0, 2] = camera.focal * points[..., 0] * inverse**2
    out[..., 1, 1] = -camera.focal * inverse
    out[..., 1, 2] = -camera.focal * points[..., 1] * inverse**2
    return out


def position(camera: Camera) -> np.ndarray:
    """Where the camera stands in head space, [3] mm."""
    return -rotation.matrix(camera.rotation).T @ camera.translation


def facing(points: np.ndarray, normals: np.ndarray, camera: Camera) -> np.ndarray:
    """Cosine [...] between normals [..., 3], of any length, and the line of sight at points [..., 3] mm."""
    toward = position(camera) - points
    toward /= np.linalg.norm(toward, axis=-1, keepdims=True)
    cosine: np.ndarray = (normals * toward).sum(-1) / np.maximum(
        np.linalg.norm(normals, axis=-1), 1e-6
    )
    return cosine


def pixels_per_mm(camera: Camera) -> float:
    """Pixels that a millimetre takes at the face, that is at the origin of head space."""
    return float(camera.focal / -to_camera(np.zeros(3), camera)[2])


def crop(camera: Camera, x: float, y: float, width: int, height: int, scale: float) -> Camera:
    """The camera of a picture cut at (x, y) from this camera's and then scaled.

    Args:
        x, y: pixels of this camera, top left corner of the cut; may lie outside.
        width, height: pixels of the new picture.
        scale: new pixels per old pixel.
    """
    return replace(
        camera,
        focal=camera.focal * scale,
        center=(np.asarray(camera.center, float) - [x, y]) * scale,
        width=int(width),
        height=int(height),
    )


def view(
    camera: Camera, yaw: float, pitch: float = 0.0, pivot: ArrayLike = (0.0, 0.0, 0.0)
) -> Camera:
    """This camera with the head turned to face (yaw, pitch) degrees, relative to its frontal view.

    The head keeps its distance and its place in the picture: `pivot` (head space, mm) stays where
    it is. yaw > 0 turns the face to the subject's left.
    """
    pivot = np.asarray(pivot, float)
    where = to_camera(pivot, camera)
    turn = rotation.yaw_pitch(yaw, pitch)
    return replace(camera, rotation=rotation.vector(turn), translation=where - turn @ pivot)
