"""Joints for the head: its own, or a person's bones in the T pose; and how much each carries.

Of a person's, only neck and head carry vertices, the chest what lies below the neck; the other bones
are there since programs for whole people ask for them. Of the head's own, eyes and jaw carry too.
"""

from dataclasses import dataclass

import numpy as np

from bakery.export.glb import EYES, Surface
from bakery.export.glb_data import METRES
from bakery.heads.base import FOLLOW, HeadModel
from bakery.landmarks import BEFORE_EARS, CHIN, OVAL
from bakery.types import EXPRESSION_INDEX

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
BONES = ("root", "neck", "head", "jaw", "leftEye", "rightEye")  # of a head alone
TONGUE = "tongue"  # material that the jaw carries whole
SOFT = 70.0  # mm of the neck over which the head's turn fades
UNDER = 2.0  # mm below the jaw's contour, that turn with it
CHEST = (-175.0, -130.0)  # mm: heights between which the neck passes into the chest


@dataclass(frozen=True)
class Joint:
    """A bone, by its upper end."""

    name: str
    parent: str | None
    place: np.ndarray  # [3] metres


def head_joints(head: HeadModel, neutral: np.ndarray) -> list[Joint]:
    """The bones of a head alone, in its own space in metres, parents first.

    Eyes turn about the middles of the eyeballs, about which eyeLook* turn them; the jaw about its
    hinge (`jaw_hinge`).

    Args:
        neutral: [V, 3] mm.
    """
    neck, turn = _neck(head, neutral)
    hinge, _ = jaw_hinge(head, neutral)
    left, right = np.asarray(head.eye_centers(neutral), np.float64)
    places = (np.array([0.0, CHEST[0], neck[2]]), neck, turn, hinge, left, right)
    parents = (None, "root", "neck", "head", "head", "head")
    return [
        Joint(name, parent, place * METRES) for name, parent, place in zip(BONES, parents, places)
    ]


def head_weights(head: HeadModel, neutral: np.ndarray, piece: Surface) -> np.ndarray:
    """How much each of BONES carries a Surface in the head's space: [V, 6], sums of 1.

    The jaw carries the skin so far as its turn does what jawOpen does (least squares at each vertex).

    Args:
        neutral: [V, 3] mm, of the person.
    """
    shares = np.zeros((len(piece.vertices), len(BONES)))
    shares[:, :3] = joint_weights(head, neutral, piece.vertices)
    if piece.name == EYES:
        centers = np.asarray(head.eye_centers(neutral))
        apart = np.linalg.norm(piece.vertices[:, None] - centers, axis=2)
        shares[:] = 0
        shares[np.arange(len(shares)), 4 + apart.argmin(1)] = 1
    elif len(piece.shapes):
        hinge, angle = jaw_hinge(head, neutral)
        turned = (piece.vertices - hinge) @ _nod(angle).T + hinge - piece.vertices
        opened = piece.shapes[EXPRESSION_INDEX["jawOpen"]]
        lever = (turned**2).sum(1)
        share = np.clip((turned * opened).sum(1) / (lever + 1.0), 0, 1)  # none where both are still
        of_jaw = shares[:, 2] * (1.0 if piece.name == TONGUE else share)
        shares[:, 2:4] = np.stack([shares[:, 2] - of_jaw, of_jaw], 1)
    return shares


def jaw_hinge(head: HeadModel, neutral: np.ndarray) -> tuple[np.ndarray, float]:
    """Where the jaw turns, and how far jawOpen turns it: [3] mm; radians about +x.

    The rigid motion in the plane of symmetry that is nearest to what jawOpen does to the lower teeth
    (or what else is fast to the jaw); a head without such has the hinge below its ears.
    """
    fast = head.part_vertices("teeth_lower")
    if not len(fast):
        fast = np.flatnonzero(head.follow == FOLLOW.index("jaw"))
    before = np.asarray(neutral, np.float64)[fast][:, 1:]
    after = before + head.expression_basis[EXPRESSION_INDEX["jawOpen"]][fast][:, 1:]
    ears, _ = _marks(head, neutral)
    below = np.array([0.0, *(ears[1:] + [-18.0, 7.0])])
    if not len(before):
        return below, np.radians(24.0)
    p, q = before - before.mean(0), after - after.mean(0)
    angle = np.arctan2((p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0]).sum(), (p * q).sum())
    if abs(angle) < 0.05:  # it slides, and turns nowhere
        return below, np.radians(24.0)
    turn = _nod(angle)[1:, 1:]
    moved = after.mean(0) - turn @ before.mean(0)
    return np.array([0.0, *np.linalg.solve(np.eye(2) - turn, moved)]), float(angle)


def _nod(angle):
    """The rotation [3, 3] by an angle about +x: chins go down and back."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[1, 0, 0], [0, c, -s], [0, s, c]])


def _neck(head, neutral):
    """Where neck and head turn, [3] mm each.

    The head turns about the joint of skull and spine, between the ears and a little behind and below
    the ear's opening; the neck's bone begins at its root.
    """
    ears, chin = _marks(head, neutral)
    turn = np.array([0.0, ears[1] - 15.0, ears[2] - 15.0])
    return np.array([0.0, chin[1] - 45.0, turn[2] - 20.0]), turn


def joints(head: HeadModel, neutral: np.ndarray) -> list[Joint]:
    """The bones of one person, parents first.

    Args:
        neutral: [V, 3] mm.
    """
    root, turn = _neck(head, neutral)
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


def from_body(points: np.ndarray) -> np.ndarray:
    """The inverse of `to_body`."""
    return (np.asarray(points, np.float64) - STANDS) / METRES


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
