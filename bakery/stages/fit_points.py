"""Which of the 468 landmarks mean what, and which expressions exclude each other."""

import numpy as np

from bakery.types import EXPRESSION_INDEX, EXPRESSIONS

FACE = 468  # landmarks on the skin; the ten behind them are the irises
RIGHT_IRIS, LEFT_IRIS = slice(468, 473), slice(473, 478)  # the subject's right, left
EYE_CORNERS = (33, 263)  # outer, right and left
EYE_INNER = (133, 362)
NOSE_BASE, CHIN = (2, 97, 326), (152, 148, 377, 175)

# The face contour, clockwise in the picture from the top of the forehead.
OVAL = np.array(
    [10, 338, 297, 332, 284, 251, 389, 356, 454, 323, 361, 288, 397, 365, 379, 378, 400, 377, 152]
    + [148, 176, 149, 150, 136, 172, 58, 132, 93, 234, 127, 162, 21, 54, 103, 67, 109]
)
LIPS_INNER_UPPER = np.array([78, 191, 80, 81, 82, 13, 312, 311, 310, 415, 308])
LIPS_INNER_LOWER = np.array([78, 95, 88, 178, 87, 14, 317, 402, 318, 324, 308])
LIPS_OUTER_UPPER = np.array([61, 185, 40, 39, 37, 0, 267, 269, 270, 409, 291])
LIPS_OUTER_LOWER = np.array([61, 146, 91, 181, 84, 17, 314, 405, 321, 375, 291])
LIPS = np.unique(
    np.concatenate([LIPS_INNER_UPPER, LIPS_INNER_LOWER, LIPS_OUTER_UPPER, LIPS_OUTER_LOWER])
)
# Lid rims from the outer to the inner corner.
LID_RIGHT_UPPER = np.array([33, 246, 161, 160, 159, 158, 157, 173, 133])
LID_RIGHT_LOWER = np.array([33, 7, 163, 144, 145, 153, 154, 155, 133])
LID_LEFT_UPPER = np.array([263, 466, 388, 387, 386, 385, 384, 398, 362])
LID_LEFT_LOWER = np.array([263, 249, 390, 373, 374, 380, 381, 382, 362])
LIDS_RIGHT = np.unique(np.concatenate([LID_RIGHT_UPPER, LID_RIGHT_LOWER]))
LIDS_LEFT = np.unique(np.concatenate([LID_LEFT_UPPER, LID_LEFT_LOWER]))
BROWS = np.array(
    [70, 63, 105, 66, 107, 46, 53, 52, 65, 55, 300, 293, 334, 296, 336, 276, 283, 282, 295, 285]
)

# Expressions that the picture cannot show, or that gaze sets on its own.
UNSEEN = ("jawForward", "mouthClose", "tongueOut")
FITTED = np.array(
    [
        index
        for index, name in enumerate(EXPRESSIONS)
        if name not in UNSEEN and not name.startswith("eyeLook")
    ]
)
# Rare in portraits, or easily mistaken for identity (thin lips, a crooked jaw): they need more
# evidence before they count.
RELUCTANT = (
    "cheekPuff jawLeft jawRight mouthFunnel mouthLeft mouthPressLeft mouthPressRight mouthPucker "
    "mouthRight mouthRollLower mouthRollUpper mouthShrugLower mouthShrugUpper noseSneerLeft "
    "noseSneerRight"
).split()
# Times the usual cost of an expression, in the order of FITTED. Brows stay at 1: at 2 a raised brow
# of 0.8 is taken for identity.
RELUCTANCE = np.array([3.0 if EXPRESSIONS[index] in RELUCTANT else 1.0 for index in FITTED])


def _sides(*pairs):
    return [(a + side, b + side) for a, b in pairs for side in ("Left", "Right")]


_ANTAGONISTS = _sides(
    ("eyeWide", "eyeSquint"),
    ("eyeWide", "eyeBlink"),
    ("browDown", "browOuterUp"),
    ("mouthSmile", "mouthFrown"),
    ("mouthStretch", "mouthSmile"),
) + [
    ("jawLeft", "jawRight"),
    ("mouthLeft", "mouthRight"),
    ("mouthPucker", "mouthSmileLeft"),
    ("mouthPucker", "mouthSmileRight"),
    ("mouthFunnel", "mouthPressLeft"),
    ("mouthFunnel", "mouthPressRight"),
    ("mouthRollLower", "mouthLowerDownLeft"),
    ("mouthRollLower", "mouthLowerDownRight"),
    ("mouthRollUpper", "mouthUpperUpLeft"),
    ("mouthRollUpper", "mouthUpperUpRight"),
]
_PLACE = {int(index): place for place, index in enumerate(FITTED)}


def _places(pairs):
    return [(_PLACE[EXPRESSION_INDEX[a]], _PLACE[EXPRESSION_INDEX[b]]) for a, b in pairs]


RIVALS = _places(_ANTAGONISTS)  # positions in FITTED
TWINS = _places(  # the same expression on both sides: portraits are mostly symmetric
    [
        (name, name[: -len("Left")] + "Right")
        for name in EXPRESSIONS
        if name.endswith("Left")
        and name not in ("jawLeft", "mouthLeft")
        and not name.startswith("eyeLook")
    ]
)


def face_size(points):
    """Distance of the outer eye corners [.., L, 2] in pixels: the unit of landmark errors."""
    return np.linalg.norm(points[..., 33, :] - points[..., 263, :], axis=-1)
