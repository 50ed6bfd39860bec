"""Where the eyes look, from the iris landmarks and the fitted eyeballs."""

import numpy as np

from bakery import landmarks as marks
from bakery.geometry import camera as cameras
from bakery.geometry import rotation
from bakery.heads.base import EYES, once_a_mean
from bakery.types import EXPRESSION_INDEX

IRISES = {"left": marks.LEFT_IRIS, "right": marks.RIGHT_IRIS}
IRIS_RADIUS = 10.5  # mm from the eyeball's centre, where a head model places no iris landmarks
LIMIT = np.array([35.0, 30.0])  # degrees an eye can turn
CLOSED = 0.6  # blink weight from which an iris is not believed


def sphere_hit(pixel, center, radius, camera):
    """Where the ray of a pixel meets a sphere (head space, mm): [3], nearest to the camera.

    A ray that misses gives the point of the sphere that it passes closest to.
    """
    turn = rotation.matrix(camera.rotation)
    offset = (np.asarray(pixel) - camera.center) / camera.focal
    ray = turn.T @ np.array([offset[0], -offset[1], -1.0])
    ray /= np.linalg.norm(ray)
    start = cameras.position(camera) - center
    along = ray @ start
    nearest = start - along * ray
    inside = radius**2 - nearest @ nearest
    hit = nearest - ray * np.sqrt(inside) if inside > 0 else nearest
    return center + hit * (radius / max(np.linalg.norm(hit), 1e-9))


def angles(direction):
    """Yaw and pitch [2] in degrees of a direction [3] (+z is straight ahead)."""
    x, y, z = direction / np.linalg.norm(direction)
    return np.degrees([np.arctan2(x, z), np.arcsin(np.clip(y, -1, 1))])


@once_a_mean
def _straight(head):
    """From each eyeball's centre to its iris, eyes straight ahead: (vector [3] mm, length) each."""
    mean = head.mean.astype(np.float64)
    rest, found = head.landmarks(mean), []
    for eye, center in zip(EYES, head.eye_centers(mean)):
        straight = rest[IRISES[eye]].mean(0) - center
        radius = np.linalg.norm(straight)
        if not 5 < radius < 20:  # mm; the head has no iris landmarks
            straight, radius = np.array([0, 0, 1.0]), IRIS_RADIUS
        found.append((straight, radius))
    return found


def fit_gaze(head, neutral, camera, points, confidence, expression):
    """Gaze [2] degrees (yaw to the subject's left, pitch up), head space, both eyes together.

    Args:
        head: HeadModel.
        neutral: [V, 3] mm, the person's neutral shape.
        points: [L, 2] pixels; confidence: [L] 0..1.
        expression: [E] weights; a closed eye is left out.

    Returns:
        [2]; zeros when no iris is seen.
    """
    centers = head.eye_centers(neutral)
    found, weight = [], []
    for row, (eye, (straight, radius)) in enumerate(zip(EYES, _straight(head))):
        iris = IRISES[eye]
        hit = sphere_hit(points[iris].mean(0), centers[row], radius, camera)
        found.append(angles(hit - centers[row]) - angles(straight))
        blink = expression[EXPRESSION_INDEX["eyeBlink" + eye.title()]]
        weight.append(confidence[iris].mean() * max(0.0, 1 - blink / CLOSED))
    weight = np.array(weight)
    if weight.sum() < 1e-3:
        return np.zeros(2)
    return np.clip(weight @ np.array(found) / weight.sum(), -LIMIT, LIMIT)
