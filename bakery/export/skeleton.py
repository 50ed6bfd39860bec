"""Joints for the head: a person's bones in the T pose, and which of them carry the skin.

Only neck and head carry vertices, the chest what lies below the neck; the other bones are there
since programs for whole people ask for them.
"""

from dataclasses import dataclass

import numpy as np

from bakery.heads.base import HeadModel
from bakery.landmarks import BEFORE_EARS, CHIN, OVAL

METRES = 0.001  # from millimetres
# Where the head's origin, between the eyes, comes to stand: metres above the ground, and before the
# spine. Proportions of an adult of 1.7 m (Drillis and Contini 1966: segment lengths over height).
STANDS = np.array([0.0, 1.59, 0.085])
LIMBS = {  # bone -> (parent, metres from the middle of the body at the ground), left side
    "Shoulder": ("chest", (0.03, 1.38, 0.0)),
    "UpperArm": ("Shoulder", (0.17, 1.38, 0.0)),
    "LowerArm": ("UpperArm", (0.48, 1.38, 0.0)),
    "Hand": ("LowerArm", (0.73, 1.38, 0.0)),
    "UpperLeg": ("hips", (0.09, 0.90, 0.0)),
    "LowerLeg": ("UpperLeg", (0.09, 0.48, 0.0)),
    "Foot": ("LowerLeg", (0.09, 0.07, 0.0)),
}
TRUNK = {"hips": (None, 0.93), "spine": ("hips", 1.05), "chest": ("spine", 1.22)}
SKINNED = ("chest", "neck", "head")  # that carry vertices, in the order of `joint_weights`
SOFT = 70.0  # mm of the neck over which the head's turn fades
UNDER = 2.0  # mm below the jaw's contour, that turn with it
CHEST = (-175.0, -130.0)  # mm: heights between which the neck passes into the chest


@dataclass(frozen=True)
class Joint:
    """A bone, by its upper end."""

    name: str
    parent: str | None
    place: np.ndarray  # [3] metres


def joints(head: HeadModel, neutral: np.ndarray) -> list[Joint]:
    """The bones of one person, parents first.

    The head turns about the joint of skull and spine, between the ears and a little behind and below
    the ear's opening; the neck's bone begins at its root.

    Args:
        neutral: [V, 3] mm.
    """
    ears, chin = _marks(head, neutral)
    turn = np.array([0.0, ears[1] - 15.0, ears[2] - 15.0])
    root = np.array([0.0, chin[1] - 45.0, turn[2] - 20.0])
    made = [Joint(name, parent, np.array([0.0, y, 0.0])) for name, (parent, y) in TRUNK.items()]
    made.append(Joint("neck", "chest", to_body(root)))
    made.append(Joint("head", "neck", to_body(turn)))
    for side, sign in (("left", 1), ("right", -1)):
        for name, (parent, place) in LIMBS.items():
            above = f"{side}{parent}" if parent in LIMBS else parent
            made.append(Joint(f"{side}{name}", above, np.array([sign, 1, 1]) * np.array(place)))
    return made


def to_body(points: np.ndarray) -> np.ndarray:
    """Points [..., 3] of the head, mm, in the body's space: metres, the ground at 0."""
    return np.asarray(points, np.float64) * METRES + STANDS


def joint_weights(head: HeadModel, neutral: np.ndarray, points: np.ndarray) -> np.ndarray:
    """How much chest, neck and head carry points: [N, 3], sums of 1.

    All above a plane from below chin and jaw to below the ears is the head's; from there its part
    fades.

    Args:
        neutral: [V, 3] mm, of the person.
        points: [N, 3] mm, of skin or hair.
    """
    ears, chin = _marks(head, neutral)
    slope = (ears[1] - 20.0 - chin[1]) / (2 * ears[2] - chin[2])  # the nape lies behind the ears
    contour = np.asarray(head.landmarks(neutral), np.float64)[OVAL]
    lowest = (contour[:, 1] - slope * contour[:, 2]).min() - UNDER
    edge = lowest + slope * points[:, 2]
    of_head = _smooth((points[:, 1] - edge + SOFT) / SOFT)
    of_chest = (1 - of_head) * (1 - _smooth((points[:, 1] - CHEST[0]) / (CHEST[1] - CHEST[0])))
    return np.stack([of_chest, 1 - of_head - of_chest, of_head], 1).astype(np.float32)


def _marks(head: HeadModel, neutral: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The middle between the ears and the chin, [3] mm each."""
    points = np.asarray(head.landmarks(neutral), np.float64)
    return points[BEFORE_EARS].mean(0), points[CHIN[0]]


def _smooth(x: np.ndarray) -> np.ndarray:
    x = np.clip(x, 0, 1)
    return x * x * (3 - 2 * x)
