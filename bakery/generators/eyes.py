"""Eyeballs as pictures over directions: one that turns with the gaze, one that stays.

A map covers the front of the ball: azimuthal equidistant around +z, the border at FIELD degrees,
+x to the right (the subject's left) and +y up.
"""

from dataclasses import dataclass

import numpy as np

from bakery.geometry import rotation
from bakery.geometry.sample import bilinear

FIELD = 100.0  # degrees from the optical axis at the middle of each border


@dataclass(frozen=True)
class EyeMaps:
    """Both eyes of one person, left first."""

    ball: np.ndarray  # [2, n, n, 3] float32 linear: iris, pupil, sclera; turns with the gaze
    glint: np.ndarray  # [2, n, n, 3] float32 linear, added: corneal highlights, stays in place
    iris: np.ndarray  # [2] degrees: angular radius of the iris seen from the eyeball's centre


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
