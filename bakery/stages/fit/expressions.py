"""Which expressions are fitted, which are rare, and which exclude each other."""

import numpy as np

from bakery.types import EXPRESSION_INDEX, EXPRESSIONS

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
