"""What a browser must know of a head to play it."""

import numpy as np

from bakery.export.lod import cut_surface, shape_displacements, simplify
from bakery.formats.record import camera_to_table, numbers
from bakery.heads.base import CARDS, GAZE_PITCH, GAZE_YAW, PROXIES, gaze_of
from bakery.heads.eyes import CAP_ANGLE
from bakery.stages.condition import face_camera
from bakery.stages.texture.mouth import mouth_landmarks
from bakery.types import EXPRESSIONS

PIECES = {  # name of the material -> parts; the proxies, then what lies behind the lips, then cards
    "skin": ("skin",),
    **{name: (name,) for name in PROXIES},
    "eye_socket": ("eye_socket",),
    "inside": ("mouth_cavity",),
    "teeth": ("teeth_upper", "teeth_lower", "gums_upper", "gums_lower"),
    "tongue": ("tongue",),
    **{name: (name,) for name in CARDS[::-1]},  # the tear line, then the lashes before it
}
FRAME = (512, 0.6)  # pixels of the front view's side, and the ratio of it that the face takes


def surfaces(head, neutral, ratio=1.0):
    """The pieces of the head that a browser shows.

    Args:
        head: HeadModel.
        neutral: [V, 3] mm.
        ratio: of the skin's triangles; the rest is small and stays.

    Returns:
        list of glb.Surface.
    """
    neutral = np.asarray(neutral, np.float32)
    shapes = shape_displacements(head, neutral)
    made = [cut_surface(head, neutral, shapes, name, parts) for name, parts in PIECES.items()]
    return [simplify(piece, ratio) if piece.name == "skin" else piece for piece in made if piece]


def facts(head, neutral, fit):
    """Cameras, eyes, and the lips as a linear function of the weights.

    Args:
        head: HeadModel.
        neutral: [V, 3] mm.
        fit: Fit of the portrait.

    Returns:
        table for formats.web.describe. Lips are [80]: x and y of the 40 landmarks.
    """
    rest = mouth_landmarks(head, neutral, neutral)
    lips = [
        mouth_landmarks(head, neutral, head.vertices(neutral, one, (0.0, 0.0))) - rest
        for one in np.eye(len(EXPRESSIONS), dtype=np.float32)
    ]
    size, ratio = FRAME
    points = head.landmarks(neutral)[:468]
    return {
        "uv": {name: [round(x, 6) for x in box] for name, box in head.uv_rectangles.items()},
        "photo_camera": camera_to_table(fit.camera),
        "front_camera": camera_to_table(face_camera(fit, head, neutral, 0, 0, size, ratio)),
        "pivot": numbers(np.array([0.0, *points[:, 1:].mean(0)]), 4),
        "eyes": {
            "centers": numbers(head.eye_centers(neutral), 4),
            "degrees": [GAZE_YAW, GAZE_PITCH],
            "cap": CAP_ANGLE,
        },
        "pose": {
            "weights": numbers(fit.expression, 6),
            "gaze": numbers(gaze_of(fit.expression).mean(0), 4),
        },
        "light": numbers(fit.light, 6),
        "lips": {
            "rest": numbers(rest.ravel(), 7),
            "shapes": numbers(np.reshape(lips, (len(EXPRESSIONS), -1)), 7),
        },
    }
