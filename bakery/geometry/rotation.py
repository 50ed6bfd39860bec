"""Axis-angle rotations."""

import cv2
import numpy as np
from numpy.typing import ArrayLike


def matrix(axis_angle: ArrayLike) -> np.ndarray:
    """Rotation vector [3] radians to matrix [3, 3] (Rodrigues)."""
    return cv2.Rodrigues(np.asarray(axis_angle, np.float64))[0]


def vector(rotation: ArrayLike) -> np.ndarray:
    """Rotation matrix [3, 3] to rotation vector [3] radians."""
    return cv2.Rodrigues(np.asarray(rotation, np.float64))[0][:, 0]


def skew(points: ArrayLike) -> np.ndarray:
    """[..., 3] to the matrices [..., 3, 3] with skew(a) b = a x b."""
    points = np.asarray(points)
    out = np.zeros(points.shape + (3,), points.dtype)
    x, y, z = points[..., 0], points[..., 1], points[..., 2]
    out[..., 0, 1], out[..., 0, 2], out[..., 1, 2] = -z, y, -x
    out[..., 1, 0], out[..., 2, 0], out[..., 2, 1] = z, -y, x
    return out


def yaw_pitch(yaw: float, pitch: float) -> np.ndarray:
    """Matrix [3, 3] that turns +z to a direction: yaw to the subject's left, pitch up, degrees."""
    y, p = np.radians(yaw), np.radians(pitch)
    about_y = np.array([[np.cos(y), 0, np.sin(y)], [0, 1, 0], [-np.sin(y), 0, np.cos(y)]])
    about_x = np.array([[1, 0, 0], [0, np.cos(p), np.sin(p)], [0, -np.sin(p), np.cos(p)]])
    return about_y @ about_x


def yaw_pitch_roll(yaw: float, pitch: float, roll: float) -> np.ndarray:
    """Matrix [3, 3] of a head: `yaw_pitch` after a tilt by `roll` towards its left shoulder, degrees."""
    return yaw_pitch(yaw, pitch) @ matrix([0, 0, -np.radians(roll)])


def angles_of(turn: np.ndarray) -> np.ndarray:
    """Yaw, pitch and roll [3] in degrees of a matrix [3, 3]; the inverse of `yaw_pitch_roll`."""
    x, y, z = turn @ [0.0, 0.0, 1.0]
    yaw, pitch = np.degrees(np.arctan2(x, z)), np.degrees(np.arcsin(np.clip(y, -1, 1)))
    tilt = yaw_pitch(yaw, pitch).T @ turn
    return np.array([yaw, pitch, -np.degrees(np.arctan2(tilt[1, 0], tilt[0, 0]))])
