"""Wrinkle shading from the tension of the mesh: folds lie across the direction of compression.

Where folds form is anatomy (the lines lie across the acting muscle), how deep they get is tension:
each line of the map below is a valley whose depth follows the compression measured across it.
"""

from dataclasses import dataclass

import numpy as np

from bakery.geometry.curve import spline
from bakery.geometry.fill import smoothstep
from bakery.geometry.noise import value_noise
from bakery.landmarks import mirror_landmarks

SAMPLES = 24  # points of a fold's curve
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


def fold_knots(line, landmarks, mirror=None):
    """Points [n, 3] that a line's mixes of landmarks say, on the other side with a mirror."""
    return np.array(
        [
            sum(w * landmarks[mirror[i] if mirror is not None else i] for i, w in point.items())
            / sum(point.values())
            for point in line.points
        ]
    )


@dataclass(frozen=True)
class Probe:
    """Measures how much of its length the surface loses across one fold."""

    corners: np.ndarray  # [n, 3] vertices of the faces around the fold
    across: np.ndarray  # [n, 2] the direction across, in the edges of each face
    length: np.ndarray  # [n] mm of that direction's image on the neutral face
    weight: np.ndarray  # [n] sum 1
    gain: float  # loss at which the fold is full

    def depth(self, vertices):
        """0 at rest to 1.2: how deep the fold is on a deformed shape [V, 3]."""
        a, b, c = (vertices[self.corners[:, k]] for k in range(3))
        image = self.across[:, :1] * (b - a) + self.across[:, 1:] * (c - a)
        loss = np.clip(1 - np.linalg.norm(image, axis=1) / self.length, 0, 1)
        return float(np.clip(loss @ self.weight / self.gain, 0, 1.2))


@dataclass(frozen=True)
class WrinkleMap:
    """The folds of one head shape."""

    probes: tuple[Probe, ...]
    profiles: tuple  # (rows, values) each: log-ratio at some of the points, at full depth
    count: int  # P, number of points


def wrinkle_map(head, neutral, points, seed=0, kinds=None):
    """Lay the folds on a neutral shape.

    Args:
        neutral: [V, 3] mm.
        points: [P, 3] mm, surface points of the neutral shape (texels).
        seed: irregularity of the folds.
        kinds: which kinds of lines; None: all.

    Returns:
        WrinkleMap.
    """
    landmarks = head.landmarks(neutral)
    mirror = mirror_landmarks(landmarks)
    skin = head.faces[head.part_faces("skin")]
    centers = neutral[skin].mean(1)
    probes, profiles = [], []
    for line in right_lines():
        if kinds is not None and line.name not in kinds:
            continue
        for flip in (None, mirror):
            curve = spline(fold_knots(line, landmarks, flip), SAMPLES)
            margin = 8 * line.width
            rows = np.flatnonzero(
                ((points > curve.min(0) - margin) & (points < curve.max(0) + margin)).all(1)
            )
            profiles.append((rows, _profile(line, curve, points[rows], seed)))
            probes.append(_probe(line, curve, neutral, skin, centers))
    return WrinkleMap(tuple(probes), tuple(profiles), len(points))


def _profile(line, curve, points, seed):
    """Log-ratio [n] of a full fold at points: a dark valley between lighter shoulders."""
    # Small displacements keep the folds from looking ruled.
    wander = np.stack([value_noise(points, 9.0, seed + 20 + k) for k in range(3)], 1) * 0.5
    strength = np.exp(0.35 * value_noise(points, 6.0, seed + 30))
    distance, off_line, fade = _distances(curve, points + wander)
    width = line.width * (0.35 + 0.65 * fade)
    valley = np.exp(-((off_line / width) ** 2))
    shoulder = np.exp(-(((off_line - 2.1 * width) / (1.1 * width)) ** 2))
    shape = (-valley + 0.42 * shoulder) * fade * (distance < 6 * line.width)
    return (line.depth * shape * strength).astype(np.float32)


def _probe(line, curve, neutral, skin, centers):
    """Faces around a fold and the direction across it on each."""
    near = np.flatnonzero(((centers > curve.min(0) - 12) & (centers < curve.max(0) + 12)).all(1))
    reach = np.linalg.norm(centers[near, None] - curve[None, ::4], axis=2).min(1)
    near, reach = near[reach < 12], reach[reach < 12]
    corners = skin[near]
    across, length, area = across_faces(neutral[corners], curve[-1] - curve[0])
    weight = area * np.exp(-((reach / 5.0) ** 2))
    return Probe(corners, across, length, weight / max(weight.sum(), 1e-9), line.gain)


def across_faces(points, tangent):
    """The direction across a fold on each face that feels it.

    Args:
        points: [n, 3, 3] mm, corners of the faces at rest.
        tangent: [3] or [n, 3] along the fold.

    Returns:
        the direction in the edges of each face [n, 2], its length there [n] mm, twice the faces'
        areas [n] mm2.
    """
    e1, e2 = points[:, 1] - points[:, 0], points[:, 2] - points[:, 0]
    normal = np.cross(e1, e2)
    area = np.maximum(np.linalg.norm(normal, axis=1), 1e-9)
    direction = np.cross(normal / area[:, None], tangent)
    direction /= np.maximum(np.linalg.norm(direction, axis=1, keepdims=True), 1e-9)
    # Coordinates of the direction in the edges of each face, by the normal equations.
    g11, g12, g22 = (e1 * e1).sum(1), (e1 * e2).sum(1), (e2 * e2).sum(1)
    p1, p2 = (direction * e1).sum(1), (direction * e2).sum(1)
    determinant = np.maximum(g11 * g22 - g12**2, 1e-9)
    across = np.stack([g22 * p1 - g12 * p2, g11 * p2 - g12 * p1], 1) / determinant[:, None]
    image = across[:, :1] * e1 + across[:, 1:] * e2
    return across, np.maximum(np.linalg.norm(image, axis=1), 0.2), area


def _distances(curve, points):
    """Distance to the nearest curve sample, distance off the curve, fade 0..1 at its ends."""
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
    position = near / (len(curve) - 1)
    fade = smoothstep(0, 0.25, position) * smoothstep(1, 0.75, position)
    beyond = np.where((near == 0) | (near == len(curve) - 1), np.abs(along), 0)
    fade = fade * np.exp(-((beyond / 1.5) ** 2))
    return np.sqrt(best), np.linalg.norm(off_line, axis=1), fade


def wrinkle_shading(wrinkles, vertices):
    """Log-luminance ratio [P] at the map's points for a deformed shape [V, 3]."""
    out = np.zeros(wrinkles.count, np.float32)
    for probe, (rows, profile) in zip(wrinkles.probes, wrinkles.profiles):
        depth = probe.depth(vertices)
        if depth > 0.01:
            out[rows] += depth * profile
    return out
