"""Numbers that tell how far a photo and its fit can be trusted, for warnings."""

import cv2
import numpy as np

from bakery import landmarks as marks
from bakery.geometry import harmonics, rotation
from bakery.geometry.color import LUMA
from bakery.types import EXPRESSIONS

LIDS = {
    "left": (marks.LID_LEFT_UPPER, marks.LID_LEFT_LOWER),
    "right": (marks.LID_RIGHT_UPPER, marks.LID_RIGHT_LOWER),
}
FINEST = 160.0  # pixels between the outer eye corners, at which sharpness is measured


def head_angles(camera):
    """Yaw (to the subject's left), pitch (up) and roll (clockwise in the picture), degrees.

    They are of the head relative to the line from the camera to it.
    """
    turn = rotation.matrix(camera.rotation)
    away = -camera.translation / np.linalg.norm(camera.translation)
    ahead = np.arctan2(away[0], away[2]), np.arcsin(away[1])
    face = rotation.yaw_pitch(*np.degrees(ahead)).T @ turn
    yaw = np.degrees(np.arctan2(face[0, 2], face[2, 2]))
    pitch = np.degrees(np.arcsin(np.clip(face[1, 2], -1, 1)))
    level = rotation.yaw_pitch(yaw, pitch).T @ face
    roll = np.degrees(np.arctan2(-level[1, 0], level[0, 0]))
    return float(yaw), float(pitch), float(roll)


def eye_opening(points, eye):
    """Mean height of a lid opening over its width."""
    upper, lower = (points[line] for line in LIDS[eye])
    height = np.linalg.norm(upper[1:-1] - lower[1:-1], axis=1).mean()
    return float(height / max(np.linalg.norm(upper[0] - upper[-1]), 1e-6))


def sharpness(encoded, points):
    """Detail of the face finer than 2 pixels over detail of 2 to 8 pixels; blur brings it to 0.

    Args:
        encoded: [H, W, 3] sRGB-encoded; points: [L, 2] pixels.
    """
    low = np.maximum(points.min(0).astype(int), 0)
    high = np.minimum(points.max(0).astype(int) + 1, encoded.shape[1::-1])
    face = encoded[low[1] : high[1], low[0] : high[0]]
    if min(face.shape[:2]) < 8:
        return 0.0
    scale = min(1.0, FINEST / marks.face_size(points))
    size = tuple(max(8, round(n * scale)) for n in face.shape[1::-1])
    grey = cv2.resize(face, size, interpolation=cv2.INTER_AREA) @ LUMA
    fine, coarse = (cv2.GaussianBlur(grey, (0, 0), sigma) for sigma in (1.0, 4.0))
    return float((grey - fine).std() / max((fine - coarse).std(), 1e-6))


def light_contrast(light):
    """How one-sided a light [9, 3] is: 0 even, 1 leaves one cheek black."""
    cheeks = np.array([rotation.yaw_pitch(yaw, 0)[:, 2] for yaw in (-50, 50)])
    shade = np.maximum(harmonics.irradiance(cheeks, light) @ LUMA, 0)
    return float(abs(shade[0] - shade[1]) / max(shade.sum(), 1e-6))


def diagnose(photo, points, camera, shape, left, projected, photometry):
    """Measured numbers of a fit.

    Args:
        photo: Photo; points: [L, 2] pixels; camera: Camera; shape: fit_landmarks.Shape.
        left: [468, 2] pixels that the linear model left at the landmarks.
        projected: [L, 2] pixels, final.
        photometry: fit_photo.Photometry or None.

    Returns:
        dict of plain numbers.
    """
    size = marks.face_size(points)
    yaw, pitch, roll = head_angles(camera)
    final = np.linalg.norm(projected - points, axis=1)[: marks.FACE]
    weights = {
        name: weight
        for name, weight in zip(EXPRESSIONS, shape.expression)
        if not name.startswith("eyeLook")
    }
    strongest = max(weights, key=weights.get)
    out = {
        "face_height": float(np.ptp(points[marks.OVAL, 1])),
        "landmark_error_linear": float(np.linalg.norm(left, axis=1).mean() / size),
        "landmark_error": float(final.mean() / size),
        "yaw": yaw,
        "pitch": pitch,
        "roll": roll,
        "expression_sum": float(sum(weights.values())),
        "expression_strongest": strongest,
        "expression_most": float(weights[strongest]),
        "eye_opening_left": eye_opening(points, "left"),
        "eye_opening_right": eye_opening(points, "right"),
        "sharpness": sharpness(photo.encoded, points),
    }
    if photometry is not None:
        out |= {
            "photo_residual": photometry.residual,
            "photo_samples": photometry.samples,
            "shadow_share": photometry.shadow,
            "light_contrast": light_contrast(photometry.appearance.light),
        }
    return out
