"""Eyeballs as pictures over directions: one that turns with the gaze, one that stays.

A map covers the front of the ball: azimuthal equidistant around +z, the border at FIELD degrees,
+x to the right (the subject's left) and +y up.
"""

from dataclasses import dataclass

import cv2
import numpy as np

from bakery.generators.shade import BLUR, EYES
from bakery.geometry import rotation
from bakery.geometry.fill import around
from bakery.geometry.sample import bilinear
from bakery.heads.base import PARTS

TONE = 1.2  # mm, over which a painted eye's tone is taken: lids shade it, no finer
TONES = (0.2, 2.0)  # of the photographed eye
FIELD = 100.0  # degrees from the optical axis at the middle of each border


@dataclass(frozen=True)
class EyeMaps:
    """Both eyes of one person, left first."""

    ball: np.ndarray  # [2, n, n, 3] float32 linear: iris, pupil, sclera; turns with the gaze
    glint: np.ndarray  # [2, n, n, 3] float32 linear, added: corneal highlights, stays in place
    iris: np.ndarray  # [2] degrees: angular radius of the iris seen from the eyeball's centre
    white: np.ndarray  # [2, 3] float32 linear: of the eye, in the open; 0 if the photo shows none


def to_map(directions, size):
    """Unit directions [..., 3] to map pixels [..., 2]."""
    x, y, z = directions[..., 0], directions[..., 1], directions[..., 2]
    angle = np.degrees(np.arctan2(np.hypot(x, y), z))
    scale = angle / FIELD / np.maximum(np.hypot(x, y), 1e-9) * (size / 2)
    return np.stack([size / 2 + x * scale, size / 2 - y * scale], -1)


def directions_of_map(size):
    """Unit directions [n, n, 3] of the map's pixel centres."""
    row, column = np.mgrid[:size, :size] + 0.5
    x, y = (column - size / 2) / (size / 2), (size / 2 - row) / (size / 2)
    angle = np.radians(np.hypot(x, y) * FIELD)
    scale = np.sin(angle) / np.maximum(np.hypot(x, y), 1e-9)
    return np.stack([x * scale, y * scale, np.cos(angle)], -1)


def look_up(eyes, which, directions, gaze):
    """Colour of an eye in fixed directions while it looks along `gaze`.

    Args:
        which: 0 for the left eye, 1 for the right.
        directions: [..., 3] unit, from the eyeball's centre, head space.
        gaze: [2] degrees yaw, pitch.

    Returns:
        ball [..., 3] and glint [..., 3], linear.
    """
    size = eyes.ball.shape[1]
    turned = directions @ rotation.yaw_pitch(*gaze)  # the inverse rotation, row vectors
    ball = bilinear(eyes.ball[which], to_map(turned, size))
    return ball, bilinear(eyes.glint[which], to_map(directions, size))


def seen_eye(subject, conditions, which, mine):
    """Ball and glint [n, 3], linear, at the pixels `mine` [H, W] that show one eye."""
    head, fragments = subject.head, conditions.fragments
    corners = head.faces[fragments.face[mine]]
    points = np.einsum("nk,nkc->nc", fragments.barycentric[mine], conditions.vertices[corners])
    direction = points - head.eye_centers(conditions.vertices)[which]
    direction /= np.maximum(np.linalg.norm(direction, axis=1, keepdims=True), 1e-6)
    return look_up(subject.eyes, which, direction, conditions.gaze)


def with_photographed_eyes(subject, conditions, image, per_mm):
    """Painted eyes with the detail of the photographed ones.

    A network trained on differences paints the mean of where highlights may be: no iris has an edge
    and no eye a glint. Its tone is right. So the photo's iris and white take on its smooth tone, and
    the highlight is laid over them.

    Args:
        image: [H, W, 3] linear, what was painted.
        per_mm: pixels a mm at the face.

    Returns:
        colour [H, W, 3] and where it counts [H, W], 0 or 1.
    """
    color, where = np.zeros_like(image), np.zeros(image.shape[:2], np.float32)
    for which, name in enumerate(EYES):
        mine = conditions.part == PARTS.index(name)
        if not mine.any():
            continue
        ball, glint = seen_eye(subject, conditions, which, mine)
        window = around(mine, BLUR * TONE * per_mm)
        eye = mine[window]
        sharp = np.zeros(eye.shape + (3,), np.float32)
        sharp[eye] = ball
        painted, plain = (
            cv2.GaussianBlur(picture * eye[..., None], (0, 0), TONE * per_mm)[eye]
            for picture in (image[window], sharp)
        )
        color[mine] = ball * np.clip(painted / np.maximum(plain, 1e-4), *TONES) + glint
        where[mine] = 1
    return color, where
