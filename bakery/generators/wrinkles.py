"""Wrinkle shading from the tension of the mesh: folds lie across the direction of compression.

Where folds form is anatomy (the lines lie across the acting muscle), how deep they get is tension:
each line of the map below is a valley whose depth follows the compression measured across it.
"""

from dataclasses import dataclass

import numpy as np

from bakery.geometry.fill import smoothstep
from bakery.geometry.noise import value_noise

# Lines in the 478-point order, the subject's right side; the left side mirrors them. Each is a list
# of points, a point a mix of landmarks. width: mm from the valley to its shoulder.
BROW = (70, 63, 105, 66, 107)
HAIRLINE = (54, 103, 67, 109, 10)


@dataclass(frozen=True)
class Line:
    """One fold."""

    name: str
    points: tuple  # of {landmark: weight} dicts
    width: float  # mm
    depth: float  # log-luminance at full compression
    gain: float  # compression (share of the length lost) at which the fold is full


def _mix(a, b, t):
    return {a: 1 - t, b: t}


def right_lines():
    """The folds of the subject's right half of the face."""
    lines = []
    for t, depth in ((0.30, 0.20), (0.48, 0.24), (0.66, 0.22), (0.82, 0.14)):
        lines.append(
            Line("forehead", tuple(_mix(b, h, t) for b, h in zip(BROW, HAIRLINE)), 1.5, depth, 0.22)
        )
    lines += [
        Line("glabella", ({55: 1.0}, {107: 0.6, 9: 0.4}, {107: 0.5, 151: 0.5}), 1.3, 0.30, 0.22),
        Line("bunny", ({193: 1.0}, {122: 0.5, 188: 0.5}, {114: 1.0}), 1.0, 0.16, 0.20),
        Line("bunny", ({168: 0.6, 193: 0.4}, {245: 0.6, 122: 0.4}, {188: 0.4, 128: 0.6}), 1.0, 0.12, 0.2),
        Line("nasolabial", ({129: 0.6, 49: 0.4}, {203: 0.5, 206: 0.5}, {216: 1.0}, {212: 0.6, 57: 0.4}), 2.2, 0.30, 0.25),
        Line("dimple", ({186: 0.4, 216: 0.6}, {57: 0.5, 212: 0.5}, {43: 0.5, 202: 0.5}), 1.6, 0.16, 0.30),
        Line("under eye", ({226: 0.6, 31: 0.4}, {228: 0.7, 31: 0.3}, {229: 0.8, 230: 0.2}, {231: 1.0}, {232: 1.0}), 1.2, 0.16, 0.2),
        Line("under eye", ({31: 0.5, 117: 0.5}, {118: 0.6, 229: 0.4}, {119: 0.5, 230: 0.5}, {120: 0.5, 231: 0.5}), 1.4, 0.12, 0.2),
        Line("crow's foot", ({130: 0.7, 226: 0.3}, {35: 0.6, 113: 0.4}, {124: 0.6, 156: 0.4}), 1.0, 0.20, 0.2),
        Line("crow's foot", ({130: 0.7, 226: 0.3}, {35: 1.0}, {143: 0.8, 35: 0.2}), 1.0, 0.22, 0.2),
        Line("crow's foot", ({226: 0.6, 31: 0.4}, {111: 0.6, 35: 0.4}, {116: 0.6, 143: 0.4}), 1.0, 0.18, 0.2),
        Line("chin", ({204: 0.5, 106: 0.5}, {194: 0.7, 182: 0.3}, {201: 0.6, 200: 0.4}, {200: 1.0}), 1.8, 0.20, 0.25),
    ]  # fmt: skip
    return lines


def _curve(line, landmarks, mirror, samples=24):
    """Points [samples, 3] along a line, a Catmull-Rom curve through its mixed landmarks."""
    knots = np.array(
        [
            sum(w * landmarks[mirror[i] if mirror is not None else i] for i, w in point.items())
            / sum(point.values())
            for point in line.points
        ]
    )
    padded = np.concatenate([2 * knots[:1] - knots[1:2], knots, 2 * knots[-1:] - knots[-2:-1]])
    t = np.linspace(0, len(knots) - 1 - 1e-6, samples)
    index, u = t.astype(int), (t % 1)[:, None]
    p0, p1, p2, p3 = (padded[index + k] for k in range(4))
    return 0.5 * (
        2 * p1 + (p2 - p0) * u + (2 * p0 - 5 * p1 + 4 * p2 - p3) * u**2
        + (3 * p1 - p0 - 3 * p2 + p3) * u**3
    )  # fmt: skip


def mirror_landmarks(landmarks):
    """For each of the 468 points [468, 3] the one on the other side of the face."""
    other = landmarks[:468] * [-1, 1, 1]
    distance = ((other[:, None] - landmarks[None, :468]) ** 2).sum(-1)
    return distance.argmin(1)


@dataclass(frozen=True)
class WrinkleMap:
    """The folds of one head shape on its vertices and at some surface points."""

    vertex_line: np.ndarray  # [n, V] float32 0..1: how much of line n's tension a vertex measures
    across: np.ndarray  # [n, 3] unit: direction across line n
    profile: np.ndarray  # [n, P] float32: log-ratio at the points at full depth
    gain: np.ndarray  # [n]


def wrinkle_map(head, neutral, points, seed=0):
    """Lay the folds on a neutral shape.

    Args:
        neutral: [V, 3] mm.
        points: [P, 3] mm, surface points of the neutral shape (texels).
        seed: irregularity of the folds.

    Returns:
        WrinkleMap.
    """
    landmarks = head.landmarks(neutral)
    mirror = mirror_landmarks(landmarks)
    # Small displacements keep the folds from looking ruled.
    wander = np.stack([value_noise(points, 9.0, seed + 20 + k) for k in range(3)], 1) * 0.5
    moved = points + wander
    strength = np.exp(0.35 * value_noise(points, 6.0, seed + 30))
    vertex_line, across, profile, gain = [], [], [], []
    for line in right_lines():
        for flip in (None, mirror):
            curve = _curve(line, landmarks, flip)
            near, distance, signed, fade = _distances(curve, moved)
            width = line.width * (0.35 + 0.65 * fade)
            valley = np.exp(-((signed / width) ** 2))
            shoulder = np.exp(-(((np.abs(signed) - 2.1 * width) / (1.1 * width)) ** 2))
            shape = (-valley + 0.42 * shoulder) * fade * (distance < 6 * line.width)
            if line.name == "glabella":
                shape *= np.abs(points[:, 0]) > 0.5
            profile.append(line.depth * shape * strength)
            reach = np.linalg.norm(neutral[:, None] - curve[None, ::4], axis=2).min(1)
            weight = np.exp(-((reach / 5.0) ** 2))
            vertex_line.append(weight / max(weight.sum(), 1e-6))
            along = curve[-1] - curve[0]
            normal = np.cross(curve[len(curve) // 2] - [0, curve[:, 1].mean(), -60], along)
            across.append(normal / np.linalg.norm(normal))
            gain.append(line.gain)
    return WrinkleMap(
        np.array(vertex_line, np.float32), np.array(across), np.array(profile, np.float32),
        np.array(gain),
    )  # fmt: skip


def _distances(curve, points):
    """Nearest curve sample, distance, signed distance in the face plane, fade 0..1 at the ends."""
    best = np.full(len(points), np.inf)
    near = np.zeros(len(points), np.int64)
    for k, sample in enumerate(curve):
        distance = ((points - sample) ** 2).sum(1)
        closer = distance < best
        best[closer], near[closer] = distance[closer], k
    tangent = np.gradient(curve, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    offset = points - curve[near]
    along = (offset * tangent[near]).sum(1)
    off_line = offset - along[:, None] * tangent[near]
    signed = np.linalg.norm(off_line, axis=1)
    position = near / (len(curve) - 1)
    fade = smoothstep(0, 0.25, position) * smoothstep(1, 0.75, position)
    beyond = np.where((near == 0) | (near == len(curve) - 1), np.abs(along), 0)
    return near, np.sqrt(best), signed, fade * np.exp(-((beyond / 1.5) ** 2))


def compression(head, neutral, vertices, across):
    """Share of length that the surface loses along directions: [n, V], 0 where it stretches.

    Args:
        across: [n, 3] unit directions at the neutral shape.
    """
    skin = head.faces[head.part_faces("skin")]
    a, b, c = (neutral[skin[:, k]] for k in range(3))
    e1, e2 = b - a, c - a
    d1 = vertices[skin[:, 1]] - vertices[skin[:, 0]]
    d2 = vertices[skin[:, 2]] - vertices[skin[:, 0]]
    # Coordinates of each direction in the triangle's plane: least squares of [e1 e2] (s, t) = dir.
    g11, g12, g22 = (e1 * e1).sum(1), (e1 * e2).sum(1), (e2 * e2).sum(1)
    determinant = np.maximum(g11 * g22 - g12**2, 1e-9)
    p1, p2 = across @ e1.T, across @ e2.T  # [n, F]
    s = (g22 * p1 - g12 * p2) / determinant
    t = (g11 * p2 - g12 * p1) / determinant
    before = s[..., None] * e1 + t[..., None] * e2
    after = s[..., None] * d1 + t[..., None] * d2
    ratio = np.linalg.norm(after, axis=2) / np.maximum(np.linalg.norm(before, axis=2), 0.2)
    loss = np.clip(1 - ratio, 0, 1)
    area = np.linalg.norm(np.cross(e1, e2), axis=1)
    total = np.zeros((len(across), len(neutral)))
    mass = np.zeros(len(neutral))
    for k in range(3):
        mass += np.bincount(skin[:, k], area, len(neutral))
        for n in range(len(across)):
            total[n] += np.bincount(skin[:, k], area * loss[n], len(neutral))
    return total / np.maximum(mass, 1e-9)


def wrinkle_shading(wrinkles, head, neutral, vertices):
    """Log-luminance ratio [P] at the map's points for a deformed shape."""
    loss = compression(head, neutral, vertices, wrinkles.across)
    felt = (loss * wrinkles.vertex_line).sum(1) / wrinkles.gain
    depth = np.clip(felt, 0, 1.2)
    return (depth[:, None].astype(np.float32) * wrinkles.profile).sum(0)
