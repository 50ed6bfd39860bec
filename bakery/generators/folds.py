"""Dynamic relief of the skin: folds that tension of the mesh brings out, different on every face.

Where a fold can form is anatomy: it lies across the muscle that acts below it. How deep it is at a
moment is tension: the share of its length that the skin loses across the fold. What one subject has
(how many lines, where, how deep, how early they show) is drawn from the subject's seed and age.
"""

from dataclasses import dataclass

import numba
import numpy as np

from bakery.generators.fold_lines import ACTIONS, REFERENCE, subject_lines
from bakery.generators.wrinkles import across_faces, fold_knots
from bakery.geometry.curve import spline
from bakery.geometry.fill import smoothstep
from bakery.geometry.noise import value_noise
from bakery.heads.base import weights
from bakery.landmarks import FACE, mirror_landmarks

SAMPLES = 40  # points of a fold's curve
AROUND = (4.0, 3.2)  # mm from a fold within which its tension is measured: least, and a mm of width
FULL = 1.25  # depth of a fold is held to this share of its full one


@dataclass(frozen=True)
class Folds:
    """All folds of one subject on one head shape."""

    corners: np.ndarray  # [f, 3] vertices of the faces that feel any fold, each once
    face: np.ndarray  # [n] which of them feel each fold, fold by fold
    # [n, 3] of the square of the length across the fold over that at rest: its parts by the first
    # edge's square, by the product of both edges, by the second's square
    square: np.ndarray
    weight: np.ndarray  # [n] sum 1 for each fold
    begins: np.ndarray  # [folds + 1] where each fold's faces begin
    onset: np.ndarray  # [folds] loss of length at which the fold begins to show
    gain: np.ndarray  # [folds] further loss at which it is full
    rows: np.ndarray  # [m] texels of all profiles, fold by fold
    height: np.ndarray  # [m] mm at full depth
    ends: np.ndarray  # [folds + 1] where each fold's texels begin
    texels: int  # number of texels of the atlas's rows

    def depths(self, vertices):
        """0 at rest to FULL [folds]: how deep each fold is on a deformed shape [V, 3]."""
        return _depths(
            np.ascontiguousarray(vertices, np.float32), self.corners, self.face, self.square,
            self.weight, self.begins, self.onset, self.gain,
        )  # fmt: skip

    def relief(self, depths):
        """Height [texels] mm of the skin over its resting shape."""
        out = np.zeros(self.texels, np.float32)
        _add(self.rows, self.height, self.ends, depths, out)
        return out

    def cut(self, texels, vertices):
        """The folds that show on some texels, felt by some vertices.

        Args:
            texels: [n] numbers of the texels, ascending; they are numbered anew.
            vertices: [v] numbers of the vertices that a piece of the head has, likewise.
        """
        row, corners = _renumbered(texels, self.rows), _renumbered(vertices, self.corners)
        whole = (corners >= 0).all(1)
        drawn, felt = row >= 0, whole[self.face]
        row_of = np.repeat(np.arange(len(self.onset)), np.diff(self.ends))
        face_of = np.repeat(np.arange(len(self.onset)), np.diff(self.begins))
        mass = np.bincount(face_of, self.weight * felt, len(self.onset))
        kept = (np.bincount(row_of, drawn, len(self.onset)) > 0) & (mass > 0)
        drawn, felt = drawn & kept[row_of], felt & kept[face_of]
        return Folds(
            corners=corners[whole].astype(np.int32),
            face=(np.cumsum(whole) - 1)[self.face[felt]].astype(np.int32),
            square=self.square[felt],
            weight=(self.weight[felt] / mass[face_of[felt]]).astype(np.float32),
            begins=_bounds(face_of[felt], kept),
            onset=self.onset[kept],
            gain=self.gain[kept],
            rows=row[drawn].astype(np.int32),
            height=self.height[drawn],
            ends=_bounds(row_of[drawn], kept),
            texels=len(texels),
        )


def _renumbered(kept, numbers):
    """Where numbers [...] stand in the ascending list `kept` [n]; -1 for those that do not."""
    place = np.minimum(np.searchsorted(kept, numbers), len(kept) - 1)
    return np.where(kept[place] == numbers, place, -1)


def _bounds(owner, kept):
    """Where the entries of each kept owner begin, of entries sorted by owner [m]: [kept + 1]."""
    return np.concatenate([[0], np.cumsum(np.bincount(owner, minlength=len(kept))[kept])])


@numba.njit(cache=True, nogil=True)
def _depths(vertices, corners, face, square, weight, begins, onset, gain):
    edges = np.zeros((len(corners), 3), np.float32)  # squares and product of each face's two edges
    for f in range(len(corners)):
        a, b, c = corners[f, 0], corners[f, 1], corners[f, 2]
        for d in range(3):
            first, second = vertices[b, d] - vertices[a, d], vertices[c, d] - vertices[a, d]
            edges[f, 0] += first * first
            edges[f, 1] += first * second
            edges[f, 2] += second * second
    out = np.zeros(len(begins) - 1, np.float32)
    for k in range(len(out)):
        loss = 0.0
        for i in range(begins[k], begins[k + 1]):
            f = face[i]
            share = np.float32(0)
            for d in range(3):
                share += square[i, d] * edges[f, d]
            loss += weight[i] * (1 - np.sqrt(max(share, np.float32(0))))
        out[k] = min(max((loss - onset[k]) / gain[k], 0.0), FULL)
    return out


@numba.njit(cache=True, nogil=True)
def _add(rows, height, ends, depths, out):
    for k in range(len(depths)):
        if depths[k] > 0.01:
            for i in range(ends[k], ends[k + 1]):
                out[rows[i]] += depths[k] * height[i]


def make_folds(head, neutral, points, rng, age):
    """Draw a subject's folds and lay them on its neutral shape.

    Args:
        head: HeadModel.
        neutral: [V, 3] mm.
        points: [N, 3] mm, the skin's texels on that shape.
        rng: numpy Generator.
        age: years.

    Returns:
        Folds.
    """
    marks = head.landmarks(neutral)
    mirror = mirror_landmarks(marks)
    skin = head.faces[head.part_faces("skin")]
    centers = neutral[skin].mean(1)
    columns = np.ascontiguousarray(points.T)
    actions = [head.vertices(neutral, weights(action)) for action in ACTIONS]
    felt, drawn = [], []
    for line in subject_lines(rng, age):
        curve = _curve(line, marks, mirror if line.left else None)
        if min(min(mix.values()) for mix in line.points) < 0:
            curve = _onto(points, curve)
        low, high = curve.min(0), curve.max(0)
        margin = 4.5 * line.width
        rows = _within(columns, low - margin, high + margin)
        drawn.append((rows, _profile(line, curve, points[rows], int(rng.integers(2**31)))))
        if line.pulls:
            felt.append(_pulled(line, head, neutral, mirror, actions))
        else:
            felt.append(_feel(line, curve, neutral, skin, centers) + (line.onset, line.gain))
    counts = np.array([len(one[0]) for one in felt])
    corners, face = _distinct(np.concatenate([one[0] for one in felt]))
    x, y = np.concatenate([one[1] for one in felt]).T
    length = np.concatenate([one[2] for one in felt])
    square = np.stack([x * x, 2 * x * y, y * y], 1) / (length**2)[:, None]
    return Folds(
        corners=corners,
        face=face,
        square=square.astype(np.float32),
        weight=np.concatenate([one[3] for one in felt]).astype(np.float32),
        begins=np.concatenate([[0], np.cumsum(counts)]),
        onset=np.array([one[4] for one in felt], np.float32),
        gain=np.array([one[5] for one in felt], np.float32),
        rows=np.concatenate([rows for rows, _ in drawn]).astype(np.int32),
        height=np.concatenate([height for _, height in drawn]).astype(np.float32),
        ends=np.concatenate([[0], np.cumsum([len(rows) for rows, _ in drawn])]),
        texels=len(points),
    )


def _distinct(corners):
    """Faces [f, 3] each once, and the number of each of [n, 3] among them."""
    corners = corners.astype(np.int64)
    base = corners.max() + 1
    _, first, face = np.unique(
        (corners[:, 0] * base + corners[:, 1]) * base + corners[:, 2],
        return_index=True, return_inverse=True,
    )  # fmt: skip
    return corners[first].astype(np.int32), face.astype(np.int32)


def joined(people):
    """The mean of the folds of several subjects on one shape, as the Folds of one."""

    def stacked(name):
        return np.concatenate([getattr(p, name) for p in people])

    def starts(name):
        return np.cumsum([0, *[len(getattr(p, name)) for p in people]])

    def offset(name, among):
        return np.concatenate([[0], *[getattr(p, name)[1:] + n for p, n in zip(people, among)]])

    corners, number = _distinct(stacked("corners"))
    names = ("square", "weight", "onset", "gain", "rows")
    return Folds(
        **{name: stacked(name) for name in names},
        corners=corners,
        face=np.concatenate([number[p.face + n] for p, n in zip(people, starts("corners"))]),
        begins=offset("begins", starts("weight")),
        height=stacked("height") / len(people),
        ends=offset("ends", starts("rows")),
        texels=people[0].texels,
    )


@numba.njit(cache=True, nogil=True)
def _within(columns, low, high):
    """Which of the points [3, N] lie in a box: indices."""
    out = np.empty(columns.shape[1], np.int64)
    count = 0
    for n in range(columns.shape[1]):
        inside = True
        for d in range(3):
            inside &= low[d] < columns[d, n] < high[d]
        if inside:
            out[count] = n
            count += 1
    return out[:count].copy()


def _curve(line, marks, mirror):
    """Points [SAMPLES, 3] along a line."""
    knots = fold_knots(line, marks, mirror)
    return spline(knots + line.shift * [-1 if line.left else 1, 1, 1], SAMPLES)


def _onto(points, curve):
    """A curve [SAMPLES, 3] moved onto the skin [N, 3]."""
    coarse = points[::17].astype(float)
    nearest = np.array([((coarse - at) ** 2).sum(1).argmin() for at in curve[::6]])
    return spline(coarse[nearest], SAMPLES)


def _profile(line, curve, points, seed):
    """Height [n] mm of a full fold: a valley, with the bulge of the skin that piles up beside it."""
    off, side, position = _beside(curve, points, line.left)
    near = np.flatnonzero(off < 3 * line.width)
    out = np.zeros(len(points), np.float32)
    out[near] = _cut(line, off[near] * side[near], position[near], points[near], seed)
    return out


def _cut(line, off, position, points, seed):
    """`_profile` of points at signed distances [n] mm from the curve, outwards positive."""
    side = np.sign(off)
    uneven = value_noise(points, 7.0, seed)
    strength = np.clip(1 + 0.35 * uneven, 0.2, 1.8)
    off = np.abs(off + line.wander * uneven)
    fade = smoothstep(0, 0.22, position) * smoothstep(1, 0.78, position)
    width = line.width * (0.45 + 0.55 * fade)
    valley = np.exp(-((off / (0.55 * width)) ** 2))
    # Skin that is pushed together stands up on both sides, more on the side it comes from.
    bulge = np.exp(-(((off - 1.25 * width) / (0.75 * width)) ** 2))
    lean = 0.42 * (1 + line.lean * side)
    return line.depth * fade * strength * (lean * bulge - valley)


@numba.njit(cache=True, nogil=True)
def _measured(curve, points, off, side, position):
    for n in range(len(points)):
        best, segment, along = 1e30, 0, 0.0
        for k in range(len(curve) - 1):
            dot = 0.0
            square = 0.0
            for d in range(3):
                step = curve[k + 1, d] - curve[k, d]
                dot += (points[n, d] - curve[k, d]) * step
                square += step * step
            t = min(max(dot / max(square, 1e-9), 0.0), 1.0)
            distance = 0.0
            for d in range(3):
                gap = points[n, d] - curve[k, d] - t * (curve[k + 1, d] - curve[k, d])
                distance += gap * gap
            if distance < best:
                best, segment, along = distance, k, t
        x, y = curve[segment + 1, 0] - curve[segment, 0], curve[segment + 1, 1] - curve[segment, 1]
        right = points[n, 0] - curve[segment, 0] - along * x
        up = points[n, 1] - curve[segment, 1] - along * y
        off[n] = np.sqrt(best)
        side[n] = np.sign(x * up - y * right)
        position[n] = (segment + along) / (len(curve) - 1)


def _beside(curve, points, left):
    """Distance [n] mm from a curve, the side (+1 outwards of one that runs down), place 0..1."""
    off, side, position = np.zeros((3, len(points)))
    _measured(np.ascontiguousarray(curve), np.ascontiguousarray(points, float), off, side, position)
    return off, side if left else -side, position


def _pulled(line, head, neutral, mirror, actions):
    """What `_feel` returns, and onset and gain, of a fold that answers to what shortens.

    Heads differ in how much their shapes shorten (0.22 of UP's length in a full grin on one, 0.06 on
    another): a full action makes a full fold on each.
    """
    nearest = head.landmark_vertices[np.arange(FACE), head.landmark_barycentric[:FACE].argmax(1)]
    ends = np.array([[a, b] for a, b, _ in line.pulls])
    ends = nearest[mirror[ends] if line.left else ends]
    length = np.linalg.norm(neutral[ends[:, 1]] - neutral[ends[:, 0]], axis=1)
    shares = np.array([share for _, _, share in line.pulls])
    most = max(
        shares @ (1 - np.linalg.norm(shape[ends[:, 1]] - shape[ends[:, 0]], axis=1) / length)
        for shape in actions
    )
    scale = np.clip(most / REFERENCE, 0.35, 1.2)
    across = np.tile([1.0, 0.0], (len(ends), 1))
    return ends[:, [0, 1, 1]], across, length, shares, line.onset * scale, line.gain * scale


def _feel(line, curve, neutral, skin, centers):
    """Faces around a fold, the direction across it on each, that direction's length, weights."""
    around = AROUND[0] + AROUND[1] * line.width
    columns = np.ascontiguousarray(centers.T)
    near = _within(columns, curve.min(0) - around, curve.max(0) + around)
    gap, _, position = _beside(curve, centers[near], line.left)
    keep = gap < around
    near, gap = near[keep], gap[keep]
    at = np.minimum((position[keep] * (len(curve) - 1)).astype(int), len(curve) - 2)
    tangent = curve[at + 1] - curve[at]
    across, length, area = across_faces(neutral[skin[near]].astype(float), tangent)
    weight = area * np.exp(-((gap / (0.6 * around)) ** 2))
    return skin[near], across, length, weight / max(weight.sum(), 1e-9)
