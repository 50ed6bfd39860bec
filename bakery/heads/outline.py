"""What landmarks do not see of a head: ears, skull, corner of the jaw, neck and shoulders.

A small basis of smooth displacements, made for any head that has landmarks. A coefficient of 1 moves the
place where its field is strongest by a millimetre; all zero changes nothing, and nothing moves inside
the landmarked face whatever they are. What lies around an ear is told from the ear itself by the
membrane that its root spans: the skull's fields carry an ear rigidly, the ear's own fade towards it.
"""

from dataclasses import dataclass

import numpy as np

from bakery.geometry import mesh
from bakery.geometry.fill import smoothstep
from bakery.heads.base import HeadModel, once_a_mean
from bakery.heads.scalp import ear_box, ear_depth, unrolled
from bakery.landmarks import FACE, OVAL

SHARED = (
    "skull_width",  # both sides go out, from the mastoids upwards
    "crown_width",  # the same of the upper half alone
    "skull_height",  # the top goes up
    "skull_depth",  # the back of the head goes back
    "jaw_width",  # the corners of the jaw, behind the contour of the landmarks, go out
    "neck_width",  # the neck grows thicker, sideways more than to its back
    "neck_taper",  # the same of its lower half alone
    "shoulder_drop",  # the shoulders go down, the neck grows longer
    "shoulder_width",  # the shoulders go out
)
EAR = (
    "size",  # the ear grows about its root: height
    "out",  # it turns outwards about its front edge: rear edge
    "drop",  # it slides down
    "lobe",  # its lobe grows downwards
)
SIDES = ("left", "right")  # the subject's
NAMES = SHARED + tuple(f"ear_{name}_{side}" for side in SIDES for name in EAR)
TRAGUS, JAW_CORNER, FOREHEAD, CHIN = (454, 234), (288, 58), 10, 152  # landmarks, left ones first
# mm outside the landmarked face over which fields rise, by the first word of their names, and those of the ears.
# Over 24 a thick neck has a crease below the jaw, and the jaw's corner juts out over it.
SOFT = {"skull": 50.0, "crown": 50.0, "jaw": 24.0, "neck": 40.0, "shoulder": 24.0}
EAR_SOFT = 9.0
RELIEF = (0.3, 5.0)  # mm above the membrane over which what stands out becomes ear
LEAST_RELIEF = 4.0  # mm; less is no ear
NECK = 50.0  # mm, radius of a neck
SLIDE = 22.0  # mm around an ear over which the skin that slides with it comes to rest


@dataclass(frozen=True, eq=False)
class Outline:
    """The outline's basis of one head; O is len(NAMES)."""

    rows: np.ndarray  # [R] the vertices that move, all of skin
    fields: np.ndarray  # [O, R, 3] float32 mm for a coefficient of 1
    ear: np.ndarray  # [V] float32 0..1: how surely a vertex belongs to an ear
    depth: (
        np.ndarray
    )  # [V] float32 mm outside the landmarked face, 0 within it and on what is no skin


def outline_offsets(head: HeadModel, outline: np.ndarray) -> np.ndarray:
    """Displacement [V, 3] float32 mm of every vertex of the neutral head.

    Args:
        head: HeadModel.
        outline: [<= O] coefficients (`Fit.outline`), in the order of NAMES.
    """
    offsets = np.zeros(head.mean.shape, np.float32)
    outline = np.asarray(outline, np.float32)
    if outline.any():
        basis = outline_basis(head)
        offsets[basis.rows] = np.tensordot(outline, basis.fields[: len(outline)], 1)
    return offsets


@once_a_mean
def outline_basis(head: HeadModel) -> Outline:
    """The Outline of a head, computed once for all that share a mean."""
    skin = head.part_vertices("skin")
    places = head.mean[skin].astype(np.float64)
    root, relief = _membrane(head, skin, places)
    free = ~np.isin(skin, head.landmark_vertices[:FACE])  # a landmark lies between its corners
    depth, root_depth = (free * outside_face(head, points) for points in (places, root))
    fields = {}
    for name, field in _shared(head, root).items():
        soft = SOFT[name.split("_")[0]]
        fields[name] = field * smoothstep(0, soft, root_depth)[:, None]
    fields |= _ears(head, places, root, relief, smoothstep(0, EAR_SOFT, depth)[:, None])
    matrix = np.stack([fields[name] for name in NAMES]).astype(np.float32)
    moved = np.abs(matrix).max((0, 2)) > 1e-3
    ear, outside = np.zeros((2, len(head.mean)), np.float32)
    ear[skin], outside[skin] = smoothstep(*RELIEF, relief), depth
    return Outline(skin[moved], matrix[:, moved], ear, outside)


def outside_face(head: HeadModel, places: np.ndarray) -> np.ndarray:
    """How far outside the landmarked face points [N, 3] of the mean head lie, [N] mm; 0 within."""
    marks = head.landmarks(head.mean).astype(np.float64)
    center = np.append(marks[OVAL].mean(0)[:2], marks[OVAL, 2].min() - 10)

    def polar(points):
        x, y, z = (points - center).T
        across, up = np.arctan2(x, z) * 85, y
        return np.arctan2(across, up), np.hypot(across, up)

    ring = marks[OVAL]
    angle, radius = polar(ring)
    order = np.argsort(angle)
    turn, far = polar(places)
    inside = far <= np.interp(turn, angle[order], radius[order], period=2 * np.pi)
    share = np.arange(8)[None, :, None] / 8
    line = (ring[:, None] * (1 - share) + np.roll(ring, -1, 0)[:, None] * share).reshape(-1, 3)
    square = (places**2).sum(1)[:, None] + (line**2).sum(1) - 2 * places @ line.T
    return np.where(inside, 0, np.sqrt(np.maximum(square.min(1), 0)))


def _membrane(head, skin, places):
    """The head without ears: where each vertex lies on the membranes that their roots span.

    Returns:
        [N, 3] mm, the vertices themselves but for the ears'; [N] mm that an ear stands out of it.
    """
    root = places.copy()
    index = np.full(len(head.mean), -1)
    index[skin] = np.arange(len(skin))
    links = index[mesh.edges(head.faces[head.part_faces("skin")])]
    near = ear_depth(unrolled(head)(places), ear_box(head)) < 1
    for side in (1, -1):
        inner = np.flatnonzero(near & (side * places[:, 0] > 0))
        place = np.full(len(skin), -1)
        place[inner] = np.arange(len(inner))
        system, right = np.zeros((len(inner), len(inner))), np.zeros((len(inner), 3))
        both = np.concatenate([links, links[:, ::-1]])
        here, there = both[place[both[:, 0]] >= 0].T
        np.add.at(system, (place[here], place[here]), 1)
        held = place[there] < 0
        np.add.at(right, place[here[held]], places[there[held]])
        np.add.at(system, (place[here[~held]], place[there[~held]]), -1)
        if len(inner):
            root[inner] = np.linalg.solve(system, right)
    relief = np.linalg.norm(places - root, axis=1)
    return root, relief if relief.max(initial=0) > LEAST_RELIEF else np.zeros(len(skin))


def _shared(head, root):
    """The fields of SHARED on the head without ears: name -> [N, 3]."""
    marks = head.landmarks(head.mean).astype(np.float64)
    tragus, corner = (np.abs(marks[list(pair)]).mean(0) for pair in (TRAGUS, JAW_CORNER))
    signs = np.sign(marks[[TRAGUS[0], JAW_CORNER[0]]])
    tragus, corner = tragus * signs[0], corner * signs[1]
    top, chin = marks[FOREHEAD, 1], marks[CHIN, 1]
    x, y, z = root.T
    crown, back = y.max(), z[y > tragus[1]].min()
    none = np.zeros_like(x)

    def along(dx=none, dy=none, dz=none):
        return np.stack([dx, dy, dz], 1)

    aside = x / tragus[0]
    trunk = along(
        np.clip(x / NECK, -1.2, 1.2), none, 0.4 * np.clip((z - corner[2] + 40) / NECK, -1, 0.5)
    )
    gonion = np.exp(
        -((y - corner[1]) ** 2 + (z - corner[2] + 16) ** 2) / (2 * 13.0**2)
    ) * smoothstep(20, 45, np.abs(x))
    rise = smoothstep(corner[1] + 25, corner[1] - 15, y)
    fall = smoothstep(chin - 85, chin - 42, y)
    fields = {
        "skull_width": along(aside * smoothstep(corner[1], tragus[1] + 5, y)),
        "crown_width": along(aside * smoothstep(top - 30, top + 25, y)),
        "skull_height": along(dy=smoothstep(top - 30, crown, y)),
        "skull_depth": along(
            dz=-smoothstep(tragus[2], back, z) * smoothstep(corner[1] - 20, tragus[1] + 10, y)
        ),
        "jaw_width": along(np.sign(x) * gonion),
        "neck_width": trunk * (rise * fall)[:, None],
        "neck_taper": trunk * (smoothstep(chin, chin - 32, y) * fall)[:, None],
        "shoulder_drop": along(dy=-smoothstep(chin + 6, chin - 45, y)),
        "shoulder_width": along(np.clip(x / 75, -1.2, 1.2) * smoothstep(chin - 25, chin - 65, y)),
    }
    return fields


def _ears(head, places, root, relief, open_):
    """The fields of both ears: name -> [N, 3].

    Args:
        open_: [N, 1] 0..1, 0 within the landmarked face.
    """
    flat, (front, behind, low, high) = unrolled(head)(places), ear_box(head)
    middle, height = (low + high) / 2, high - low
    aside = np.maximum(np.maximum(front - flat[:, 0], flat[:, 0] - behind), 0)
    above = np.maximum(np.maximum(low - flat[:, 1], flat[:, 1] - high), 0)
    around = smoothstep(SLIDE, 0, np.hypot(aside, above))  # the skin that slides with an ear
    ear = smoothstep(*RELIEF, relief)
    down = places[:, 1] - middle
    out = {}
    for side, name in zip((1, -1), SIDES):
        here = (side * places[:, 0] > 0)[:, None] * open_ * (relief.max() > 0)
        own = ear * (side * places[:, 0] > 0)
        hinge = places[own > 0.5, 2].max(initial=-1e3) if own.any() else 0.0
        behind_hinge = np.minimum(places[:, 2] - hinge, 0)
        rear = max(-behind_hinge[own > 0.5].min(initial=-1.0), 1.0)
        grown = np.stack([(places - root)[:, 0], down, behind_hinge], 1) / height
        along = np.stack([side * (-behind_hinge) / rear, 0 * down, 0 * down], 1)
        lobe = smoothstep(0.1 * height, -0.5 * height, down)
        for field, moves in {
            "size": grown * np.stack([ear, around, ear], 1),
            "out": along * ear[:, None],
            "drop": np.stack([0 * down, -around, 0 * down], 1),
            "lobe": np.stack([0 * down, -lobe * ear, 0 * down], 1),
        }.items():
            out[f"ear_{field}_{name}"] = moves * here
    return out
