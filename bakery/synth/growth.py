"""How scalp hair grows from its roots, lies on skull and body, and gathers in locks."""

import numpy as np
from scipy.spatial import cKDTree

from bakery.synth.noise import gradient_noise
from bakery.synth.roots import ear_faces, roots_on, sample_roots

WANDER = 4.0  # mm that the tip of a lock strays sideways from its neighbours, at most


def unit(v: np.ndarray) -> np.ndarray:
    """Vectors [..., 3] scaled to length 1."""
    return v / (np.linalg.norm(v, axis=-1, keepdims=True) + 1e-9)


def tangent(v: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """The part of v along the surface, unit."""
    return unit(v - (v * normal).sum(-1, keepdims=True) * normal)


class Field:
    """What each style knows of its roots; n of them."""

    def __init__(self, head, chart, subject, mask, neutral, skull, rng, count, body=None):
        self.chart, self.subject, self.rng, self.skull, self.body = chart, subject, rng, skull, body
        faces, barycentric, self.rest = sample_roots(
            head, chart, mask, count, rng, ear_faces(chart, head)
        )
        self.root, self.normal = roots_on(head, neutral, faces, barycentric)
        _, self.out = skull.height(self.root)
        self.count = len(self.root)
        self.density = chart.sample(mask, self.rest)
        self.left = np.zeros_like(self.root) + [1.0, 0, 0]
        self.down = np.zeros_like(self.root) + [0, -1.0, 0]
        self.back = np.zeros_like(self.root) + [0, 0, -1.0]
        crown = chart.crown
        self.top = np.clip((self.rest[:, 1] - (crown - 62)) / 40, 0, 1)[
            :, None
        ]  # 1 above, 0 at the sides
        self.front = np.clip((self.rest[:, 2:] - chart.axis) / 80, -1, 1)  # -1 behind, 1 in front
        self.locks = self._locks()
        ears = neutral[np.unique(head.faces[ear_faces(chart, head)])]
        ears = np.column_stack([np.abs(ears[:, 0]), ears[:, 1:]])
        self.ear = np.stack([ears.min(0), ears.max(0)])  # the left ear's box, mm

    def _locks(self, size=7.0):
        """A wandering direction [n, 3] shared by neighbouring hairs."""
        parts = [
            gradient_noise(self.rest, size, self.subject.seed + 31 + k, octaves=2, gain=0.6)[0]
            for k in range(3)
        ]
        return np.stack(parts, 1) * 2.4

    def jitter(self, amount: float) -> np.ndarray:
        """Random directions [n, 3], each hair its own."""
        return self.rng.normal(size=(self.count, 3)) * amount

    def vary(self, low: float, high: float) -> np.ndarray:
        """Random factors [n]."""
        return self.rng.uniform(low, high, self.count)

    def outside(self, points: np.ndarray, clearance) -> np.ndarray:
        """Points [n, 3], or [n, K, 3], pushed out of neck, clothes and ears by `clearance` mm."""
        low, high = self.ear
        reach = (high - low) / 2 + [0, 46, 22]  # hair rises gently to the ear
        far = (((points - (low + high) / 2) / reach)[..., 1:] ** 2).sum(-1)
        wall = low[0] + (high[0] - low[0] + clearance) * np.clip(1 - far, 0, 1) ** 0.8
        x = points[..., 0]
        out = points.copy()
        covers = (far < 1) & (np.abs(x) > low[0] - 4)
        out[..., 0] = np.where(covers, np.sign(x) * np.maximum(np.abs(x), wall), x)
        if self.body is None:
            return out
        height, outward = self.body.height(out)
        return out + outward * np.clip(clearance - height, 0, 14)[..., None]


def grow(
    field,
    first,
    pull,
    length,
    knots,
    lift,
    stiff=0.6,
    clearance=0.4,
    cling=0.35,
    free=None,
    hangs=True,
) -> np.ndarray:
    """Grow strands [n, knots, 3] step by step.

    Args:
        first: [n, 3] direction in which each hair leaves the skin.
        pull: function of (points, share grown) to the direction [n, 3] it is combed.
        length: [n] mm.
        lift: [n] mm above the skull that a lying hair keeps.
        stiff: 0..1, how slowly hair takes the combed direction.
        clearance: mm that hair keeps from skull and body.
        cling: 0..1, how strongly the skull holds hair.
        free: function of points to [n] bool: hair that the skull holds no longer; None for none.
        hangs: whether hair below the ears' top leaves the skull.
    """
    point, heading = field.root.copy(), unit(first)
    out = [point]
    step = (length / (knots - 1))[:, None]
    thick = clearance + 0.5 * np.mean(lift) * field.vary(0.3, 1.7)
    base, _ = field.skull.height(field.root)  # the smooth skull may lie under the real skin
    for k in range(1, knots):
        share = k / (knots - 1)
        target = pull(point, share)
        height, outward = field.skull.height(point)
        height = height - base * max(0, 1 - 1.2 * share)
        upper = np.clip((point[:, 1] + 12) / 40, 0, 1) if hangs else np.ones(field.count)
        near = (lift * min(1, 2.2 * share) * upper + clearance - height) / 7.0
        near, hold = np.clip(near, -1, 1)[:, None], cling * upper[:, None]
        if free is not None:
            hold = hold * ~free(point)[:, None]
        heading = unit(
            heading * stiff + unit(target) * (1 - stiff) + outward * np.clip(near, -hold, 1) * 0.8
        )
        point = point + heading * step
        height, outward = field.skull.height(point)
        height = height - base * max(0, 1 - 1.2 * share)
        inside = np.clip(clearance - height, 0, None)
        point = point + outward * (inside * (inside < 9))[:, None]
        if hangs:
            point = field.outside(point, thick)
        out.append(point)
    return np.stack(out, 1)


def locks_of(field, number: int) -> np.ndarray:
    """The leader [n] of each hair: the nearest root of `number` drawn at random."""
    leaders = field.rng.choice(field.count, min(number, field.count), replace=False)
    return leaders[cKDTree(field.root[leaders]).query(field.root)[1]]


def gather(field, points, leader, strength) -> np.ndarray:
    """Draw strands [n, K, 3] toward their leaders, the tips most.

    Args:
        leader: [n] from `locks_of`.
        strength: 0..1, number or [n].
    """
    t = np.linspace(0, 1, points.shape[1])[:, None]
    length = np.linalg.norm(np.diff(points, axis=1), axis=2).sum(1)[:, None, None]
    stray = field.jitter(WANDER)[:, None] * np.minimum(length / 70, 1) * t**1.6
    strength = np.broadcast_to(strength, field.count) * field.vary(0.35, 1.0)
    toward = points[leader] + stray[leader] - points
    return points + toward * strength[:, None, None] * t**1.2


def wave(field, points, leader, height, period, depth=0.5) -> np.ndarray:
    """Strands [n, K, 3] laid in waves or, with depth 1, in curls.

    Args:
        leader: [n] from `locks_of`; hairs of one lock swing together.
        height: mm, number or [n].
        period: mm of one wave.
        depth: of the part outward, relative to the part along the surface.
    """
    along = np.linalg.norm(np.diff(points, axis=1), axis=2)
    along = np.concatenate([np.zeros((field.count, 1)), np.cumsum(along, 1)], 1)
    own = field.rng.normal(size=field.count) * (0.35 if depth < 1 else 1.2)
    sweep, _ = gradient_noise(field.rest, 45.0, field.subject.seed + 35)
    turn = (own[leader] + 6 * sweep + field.rng.normal(size=field.count) * 0.12)[:, None]
    turn = turn + 2 * np.pi * along / (period * np.exp(own[leader][:, None] * 0.05))
    heading = unit(np.gradient(points, axis=1))
    outward = unit(points - field.skull.center)
    side = unit(np.cross(heading, outward))
    rising = np.clip(along / (0.9 * period), 0, 1) ** 1.5
    swing = (np.broadcast_to(height, field.count)[:, None] * rising)[..., None]
    moved = points + swing * (np.cos(turn)[..., None] * side)
    moved += swing * depth * (np.sin(turn)[..., None] * np.cross(side, heading))
    return field.outside(moved, 0.8)


def stray(field, points, share=0.012, reach=9.0) -> np.ndarray:
    """A few hairs [n, K, 3] leave the rest.

    Args:
        share: of the hairs.
        reach: mm that their tips lie away.
    """
    t = np.linspace(0, 1, points.shape[1])[:, None]
    loose = (field.rng.random(field.count) < share) * field.vary(0.3, 1.3) * reach
    away = unit(field.jitter(1.0) + 1.2 * field.out)[:, None] * t**1.5
    bend = field.jitter(0.5)[:, None] * np.sin(2.2 * np.pi * t)
    return points + (away + bend * t) * loose[:, None, None]
