"""Things that cover a face in a portrait: a hand, glasses, a card between lamp and face, a fringe."""

from dataclasses import dataclass, replace

import numpy as np

from bakery.synth.hair import strand_colors
from bakery.synth.light import ShadowMap
from bakery.synth.noise import gradient_noise
from bakery.synth.skin import skin_color

LENS = {  # eye: outer corner, inner corner
    "right": (33, 133),
    "left": (263, 362),
}
FINGERS = (  # knuckle and tip of each, mm to the subject's left of and above the chin
    ((50, -2), (46, 62)),
    ((38, -10), (-4, 38)),
    ((32, -22), (-22, 23)),
    ((27, -35), (-24, 7)),
)
WRIST = (64, -76)  # mm from the chin, as above


@dataclass(frozen=True)
class Prop:
    """A solid thing in head space."""

    vertices: np.ndarray  # [n, 3] mm
    faces: np.ndarray  # [m, 3]
    albedo: np.ndarray  # [n, 3] linear
    rough: float = 0.6
    reflectance: float = 0.03  # facing it
    shown: bool = True  # False: only its shadow is
    what: str = "thing"  # or "frame", "lens", "hat", "clothes"


@dataclass(frozen=True)
class Rims:
    """The shape of glasses, mm."""

    half: tuple[float, float] = (25.5, 19.5)  # width and height of a lens, halved
    power: float = 0.72  # 1 is an oval, less is squarer
    drop: float = 4.0  # of the lenses' middle below the eyes
    thick: float = 1.9  # half the thickness of a rim
    below: bool = True  # False: no rim below the lenses
    around: bool = True  # False: no rim at all


def tube(path, radius, around=20):
    """A closed tube along a path [k, 3] mm with radii [k] mm: vertices and faces."""
    path, radius = np.asarray(path, float), np.broadcast_to(radius, len(path))
    along = np.gradient(path, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    side = np.cross(along, np.where(np.abs(along[:, 2:]) < 0.9, [[0, 0, 1.0]], [[1.0, 0, 0]]))
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    turn = np.arange(around) * 2 * np.pi / around
    spokes = (
        side[:, None] * np.cos(turn)[:, None]
        + np.cross(along, side)[:, None] * np.sin(turn)[:, None]
    )
    rings = path[:, None] + spokes * radius[:, None, None]
    row, column = np.mgrid[: len(path) - 1, :around]
    a, b = row * around + column, row * around + (column + 1) % around
    quads = np.stack([a, b, b + around, a + around], -1).reshape(-1, 4)
    return rings.reshape(-1, 3), np.concatenate([quads[:, :3], quads[:, [0, 2, 3]]])


def capsule(path, radius):
    """A tube with round ends along a smooth path through points [k, 3] with radii [k] mm."""
    path, radius = np.asarray(path, float), np.asarray(radius, float)
    place = np.r_[0, np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))]
    fine = np.linspace(0, place[-1], 40)
    middle = np.stack([np.interp(fine, place, path[:, k]) for k in range(3)], 1)
    for _ in range(6):  # joints bend, they do not break
        middle[1:-1] = (middle[:-2] + 2 * middle[1:-1] + middle[2:]) / 4
    wide = np.interp(fine, place, radius)
    cap = np.linspace(np.pi / 2, 0.05, 8)[1:]  # angle from the tube to its end
    ends = []
    for tip, inner, size in ((0, 1, wide[0]), (-1, -2, wide[-1])):
        out = middle[tip] - middle[inner]
        out /= np.linalg.norm(out)
        ends.append((middle[tip] + np.outer(np.cos(cap), out) * size, np.sin(cap) * size))
    return tube(
        np.concatenate([ends[0][0][::-1], middle, ends[1][0]]),
        np.concatenate([ends[0][1][::-1], wide, ends[1][1]]),
    )


def joined(parts):
    """One mesh of many [(vertices, faces)]."""
    starts = np.cumsum([0] + [len(vertices) for vertices, _ in parts])
    faces = [faces + start for (_, faces), start in zip(parts, starts)]
    return np.concatenate([vertices for vertices, _ in parts]), np.concatenate(faces)


def relief(head, neutral):
    """A function from places [n, 2] mm (x, y) to how far the face reaches forward there, mm."""
    skin = neutral.astype(np.float64)
    seen = ShadowMap(skin, head.faces[head.part_faces("skin")], np.array([0, 0, 1.0]), 500)

    def forward(places):
        flat = np.concatenate([places, np.zeros((len(places), 1))], 1) @ seen.frame[:, :2]
        column, row = np.clip(((flat - seen.low) * seen.scale).astype(int), 0, 499).T
        return seen.height[row, column]

    return forward


def hand(head, subject, neutral):
    """The subject's left hand over chin, mouth and cheek, in the subject's own skin."""
    forward = relief(head, neutral)
    chin = head.landmarks(neutral)[152].astype(float)
    wrist = chin + [*WRIST, 4.0]
    parts, nails = [], []
    for number, (knuckle, tip) in enumerate(FINGERS):
        share = np.linspace(0, 1, 7)[:, None]
        flat = chin[:2] + np.array(knuckle) * (1 - share) + np.array(tip) * share
        radius = np.interp(share[:, 0], [0, 0.4, 0.5, 1], [10.2, 8.8, 9.0, 6.8])
        radius *= (1.0, 1.03, 1.0, 0.86)[number]
        bow = 7 * np.sin(np.pi * share[:, 0])  # knuckles stand off the face
        deep = np.maximum(forward(flat), chin[2] - 14) + radius * 0.8 + bow
        path = np.column_stack([flat, deep])
        parts.append(capsule(path, radius))
        back = wrist + (path[0] - wrist) * [[0.0], [0.5], [1.0]] + [0, 0, 2.0]
        parts.append(capsule(back, [20, 16.5, 11]))
        end, before = path[-1], path[-2]
        out = (end - before) / np.linalg.norm(end - before)
        top = end + out * 1.5 + [0, 0, radius[-1] * 0.62]
        nails.append(capsule([top - out * 4, top, top + out * 3.5], [3.2, 3.9, 3.3]))
    arm = wrist + np.array([[0, 0, 0], [14, -60, -4], [34, -190, -10]])
    parts.append(capsule(arm, [24, 25, 32]))
    vertices, faces = joined(parts + nails)
    blotch, _ = gradient_noise(vertices, 9.0, subject.seed + 91, octaves=4, gain=0.6)
    color = skin_color(
        0.18 + 0.9 * subject.melanin * (1 + 0.1 * blotch),
        subject.haemoglobin * (0.85 + 0.25 * blotch),
    )
    count = sum(len(v) for v, _ in nails)
    color[-count:] = color[-count:] * [1.12, 1.1, 1.12] + [0.03, 0.012, 0.014]
    return Prop(vertices, faces, color.astype(np.float32), 0.55, 0.026)


def glasses(head, neutral, lens=None, color=(0.012, 0.011, 0.010), rims=Rims()):
    """Glasses: their frame, and lenses if these are dark.

    Args:
        lens: [3] linear albedo of the lenses, None for clear ones.
        color: [3] linear albedo of the frame.
        rims: Rims.

    Returns:
        list of Prop; the rims' corners are `rim`.
    """
    parts, panes = [], []
    thick = rims.thick / 1.9
    outlines = {side: rim(head, neutral, side, rims=rims) for side in LENS}
    for side, outline in outlines.items():
        count = len(outline)
        closed = np.concatenate([outline, outline[:2]])
        if rims.around:
            parts.append(tube(closed if rims.below else outline[: count // 2 + 1], rims.thick, 10))
        middle = outline.mean(0, keepdims=True) + [0, 0, 2.5]
        fan = np.array([[k, (k + 1) % count, count] for k in range(count)])
        panes.append((np.concatenate([outline, middle]), fan))
        outward = 1.0 if side == "left" else -1.0
        hinge = outline[np.argmax(outline[:, 0] * outward)]
        ear = head.landmarks(neutral)[454 if side == "left" else 234].astype(float)
        temple = [hinge, hinge + [5 * outward, 2, -4], ear + [7 * outward, 16, -4]]
        parts.append(capsule(temple, np.array([1.9, 2.0, 2.0]) * thick))
    inner = [outlines["right"][np.argmax(outlines["right"][:, 0])]]
    inner.append(outlines["left"][np.argmin(outlines["left"][:, 0])])
    middle = (inner[0] + inner[1]) / 2 + [0, 3, 2.0]
    bridge = [inner[0], middle, inner[1]]
    parts.append(capsule(bridge, np.array([1.7, 1.6, 1.7]) * thick))
    out = [replace(_plain(*joined(parts), color, 0.35, 0.04), what="frame")]
    if lens is not None:
        out.append(replace(_plain(*joined(panes), lens, 0.18, 0.06), what="lens"))
    return out


def rim(head, neutral, side, count=48, rims=Rims()):
    """Outline [count, 3] mm of one lens, before the eye."""
    marks = head.landmarks(neutral).astype(float)
    outer, inner = LENS[side]
    center = (marks[outer] + marks[inner]) / 2 + [0, -rims.drop, 0]
    outward = np.sign(center[0])
    center += [2.0 * outward, 0, 0]
    turn = np.arange(count) * 2 * np.pi / count
    x, y = np.cos(turn), np.sin(turn)
    x, y = (np.sign(v) * np.abs(v) ** rims.power for v in (x, y))
    front = marks[[6, 151], 2].max() + 3.0
    wide, high = rims.half
    bend = -0.008 * (center[0] + (wide + 0.5) * x) ** 2  # frames follow the face around
    return np.column_stack([center[0] + wide * x, center[1] + high * y, front + bend])


def card(corners):
    """A flat card [4, 3] mm that only its shadow is seen of."""
    faces = np.array([[0, 1, 2], [0, 2, 3], [2, 1, 0], [3, 2, 0]])
    return replace(
        _plain(np.asarray(corners, float), faces, (0.1, 0.1, 0.1), 0.9, 0.0), shown=False
    )


def _plain(vertices, faces, color, rough, reflectance):
    albedo = np.tile(np.float32(color), (len(vertices), 1))
    return Prop(vertices, faces, albedo, rough, reflectance)


def fringe(head, subject, neutral, hair, side=1.0, count=14000):
    """Hair that falls from the parting over the forehead and one eye.

    Args:
        hair: Strands of the subject's scalp; the fringe gets as many knots.
        side: +1 over the subject's left eye, -1 over the right one.

    Returns:
        Strands: `hair` and the fringe.
    """
    rng = subject.rng("fringe")
    forward, marks = relief(head, neutral), head.landmarks(neutral).astype(float)
    knots = hair.points.shape[1]
    spread, depth = rng.random((count, 1)), rng.random((count, 1))
    top, eye, jaw = marks[10], marks[263 if side > 0 else 33], marks[288 if side > 0 else 58]
    root = np.concatenate(
        [top[0] - side * 22 + side * 66 * spread, top[1] + 14 - 10 * spread**2], 1
    )
    tip_x = eye[0] + side * (-34 + 56 * spread) + rng.normal(size=(count, 1)) * 2
    tip_y = jaw[1] + 34 - 30 * spread + rng.normal(size=(count, 1)) * 8
    way = np.linspace(0, 1, knots)[None, :, None]
    tip = np.concatenate([tip_x, tip_y], 1)[:, None]
    bent = (root[:, None] + tip) / 2 + [side * 7.0, 14.0]
    flat = (1 - way) ** 2 * root[:, None] + 2 * way * (1 - way) * bent + way**2 * tip
    lock, _ = gradient_noise(np.repeat(root, 2, 1)[:, :3], 6.0, subject.seed + 41, octaves=2)
    flat = flat + np.concatenate([lock[:, None, None] * 9 * way] * 2, 2)
    deep = forward(flat.reshape(-1, 2)).reshape(count, knots)
    deep = np.maximum(deep, eye[2] + 8)  # hair bridges the hollow of the eye
    lift = (1.5 + 9 * depth) * np.clip(4 * way[0, :, 0], 0.15, 1)
    points = np.dstack([flat, deep + lift]).astype(np.float32)
    colors = strand_colors(subject, count, rng, points[:, 0].astype(np.float64))
    normals = np.tile([0.25 * side, 0.2, 1.0], (count, 1))
    return replace(
        hair,
        points=np.concatenate([hair.points, points]),
        width=np.concatenate([hair.width, rng.uniform(0.08, 0.12, count)]),
        color=np.concatenate([hair.color, colors]),
        normals=np.concatenate([hair.normals, normals / np.linalg.norm(normals, axis=1)[:, None]]),
    )
