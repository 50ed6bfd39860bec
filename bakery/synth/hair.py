"""Scalp hair: styles as direction fields along which strands grow."""

import numpy as np

from bakery.synth.noise import gradient_noise
from bakery.synth.roots import Skull, ear_faces, roots_on, sample_roots
from bakery.synth.strands import Strands
from bakery.synth.subject import HAIR_COLORS

COUNT = {
    "crop": 95000, "side_part": 110000, "thinning": 45000, "curly": 90000,
    "bob": 110000, "pulled_back": 110000, "bald": 26000,
}  # fmt: skip


def _unit(v):
    return v / (np.linalg.norm(v, axis=-1, keepdims=True) + 1e-9)


def _tangent(v, normal):
    """The part of v along the surface, unit."""
    return _unit(v - (v * normal).sum(-1, keepdims=True) * normal)


def hair_color(subject):
    """Mean colour [3] linear of the subject's hair, greys counted in."""
    base, grey = np.array(HAIR_COLORS[subject.hair_color]), np.array(HAIR_COLORS["grey"])
    return base + (grey - base) * subject.grey


def strand_colors(subject, count, rng, places):
    """Colours [S, 3] of single hairs around the subject's: lighter and darker locks, greys."""
    base = np.array(HAIR_COLORS[subject.hair_color])
    lock, _ = gradient_noise(places, 9.0, subject.seed + 21, octaves=2)
    level = np.exp(rng.normal(size=count) * 0.22 + 0.6 * lock)
    warm = np.exp(rng.normal(size=(count, 1)) * 0.06 * np.array([1, 0, -1.0]))
    color = base * level[:, None] * warm
    temple = np.clip(np.abs(places[:, 0]) / 75, 0, 1) * 0.5 + 0.75
    grey = rng.random(count) < subject.grey * temple
    color[grey] = np.array(HAIR_COLORS["grey"]) * rng.uniform(0.7, 1.5, (grey.sum(), 1))
    return np.clip(color, 0.004, 0.75)


class _Field:
    """What each style knows of its roots."""

    def __init__(self, head, chart, subject, mask, neutral, skull, rng, share):
        self.chart, self.subject, self.rng, self.skull = chart, subject, rng, skull
        faces, barycentric, self.rest = sample_roots(
            head, chart, mask, int(COUNT[subject.hair] * share), rng, ear_faces(chart, head)
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
        self.locks = self._locks()

    def _locks(self, size=7.0):
        """A wandering direction [n, 3] shared by neighbouring hairs."""
        parts = [
            gradient_noise(self.rest, size, self.subject.seed + 31 + k, octaves=2, gain=0.6)[0]
            for k in range(3)
        ]
        return np.stack(parts, 1) * 2.4

    def jitter(self, amount):
        return self.rng.normal(size=(self.count, 3)) * amount


def _grow(field, first, pull, length, knots, lift, stiff=0.6, clearance=0.4, wave=0.0, cling=0.35):
    """Grow strands step by step.

    Args:
        first: [n, 3] direction in which each hair leaves the skin.
        pull: function of (points, share grown) to the direction [n, 3] it is combed.
        length: [n] mm.
        lift: [n] mm above the skull that a lying hair keeps.
        stiff: 0..1, how slowly hair takes the combed direction.
    """
    point, heading = field.root.copy(), _unit(first)
    out = [point]
    step = (length / (knots - 1))[:, None]
    base, _ = field.skull.height(field.root)  # the smooth skull may lie under the real skin
    phase = field.rng.uniform(0, 2 * np.pi, (field.count, 1)) * 0.25 + field.locks[:, :1] * 5
    for k in range(1, knots):
        share = k / (knots - 1)
        target = pull(point, share)
        if wave:
            turn = np.sin(phase + share * length[:, None] / 9.0)
            target = target + wave * turn * np.cross(target, field.out)
        height, outward = field.skull.height(point)
        height = height - base * max(0, 1 - 1.2 * share)
        upper = np.clip((point[:, 1] + 12) / 40, 0, 1)  # further down, hair hangs
        near = (lift * min(1, 2.2 * share) * upper + clearance - height) / 7.0
        near, hold = np.clip(near, -1, 1)[:, None], cling * upper[:, None]
        heading = _unit(
            heading * stiff + _unit(target) * (1 - stiff) + outward * np.clip(near, -hold, 1) * 0.8
        )
        point = point + heading * step
        height, outward = field.skull.height(point)
        height = height - base * max(0, 1 - 1.2 * share)
        inside = np.clip(clearance - height, 0, None)
        point = point + outward * (inside * (inside < 9))[:, None]
        out.append(point)
    return np.stack(out, 1)


def _clump(points, rng, size, strength, knots):
    """Draw the tips of neighbouring strands together into locks."""
    count = len(points)
    leaders = rng.choice(count, max(2, count // size), replace=False)
    cell = np.floor(points[:, 0] / 5.0).astype(int)
    code = cell @ np.array([73856093, 19349663, 83492791])
    order = np.argsort(code[leaders], kind="stable")
    sorted_codes = code[leaders][order]
    at = np.searchsorted(sorted_codes, code)
    at = np.clip(at, 0, len(order) - 1)
    spread = np.searchsorted(sorted_codes, code, "right") - at
    at = np.clip(at + (rng.random(count) * np.maximum(spread, 1)).astype(int), 0, len(order) - 1)
    mate = leaders[order[at]]
    match = (code[mate] == code)[:, None, None]
    weight = (
        (np.linspace(0, 1, knots) ** 1.3)[None, :, None]
        * strength
        * rng.uniform(0.3, 1, (count, 1, 1))
    )
    return points + match * weight * (points[mate] - points)


def _crop(f, longer=1.0):
    s = f.subject
    front = np.clip((f.rest[:, 2] - f.chart.axis) / 80, -1, 1)[:, None]
    comb = (
        -f.left * 0.55 * s.part + np.array([0, 0.25, 0.45]) * front + f.back * (0.5 - 0.5 * front)
    )
    flow = f.top * comb + (1 - f.top) * (f.down + f.back * 0.55)
    flow = _tangent(flow + f.locks * 0.55, f.out)
    length = (7 + 19 * f.top[:, 0] * longer) * f.rng.uniform(0.75, 1.1, f.count)
    length *= 0.45 + 0.55 * f.density
    first = flow * 0.55 + f.normal * (0.35 + 0.5 * f.top) + f.jitter(0.16)
    lift = 1.2 + 9 * f.top[:, 0] * longer * f.rng.uniform(0.3, 1, f.count)
    points = _grow(f, first, lambda p, t: flow + f.down * 0.15 * t, length, 9, lift, 0.72)
    return _clump(points, f.rng, 45, 0.2 + 0.35 * f.top[:, :, None], 9)


def _side_part(f):
    s = f.subject
    at = 26 * s.part
    across = np.where((f.rest[:, :1] - at) * s.part > 0, 1.0, -1.0) * s.part
    front = np.clip((f.rest[:, 2:] - f.chart.axis) / 80, -1, 1)
    comb = f.left * across * 0.9 + f.back * 0.55 + np.array([0, 0.3, 0.0]) * front
    flow = f.top * comb + (1 - f.top) * (f.down * 0.8 + f.back * 0.7)
    flow = _tangent(flow + f.locks * 0.22, f.out)
    main = np.clip(-(f.rest[:, 0] - at) * s.part / 30, 0, 1)
    length = (11 + f.top[:, 0] * (16 + 27 * main)) * f.rng.uniform(0.8, 1.1, f.count)
    length *= 0.45 + 0.55 * f.density
    first = flow * 0.8 + f.normal * (0.22 + 0.25 * f.top) + f.jitter(0.08)
    lift = 1.2 + 7 * f.top[:, 0] * f.rng.uniform(0.35, 1, f.count) * (0.4 + 0.6 * main)

    def pull(p, t):
        hang = np.clip((f.chart.crown - 42 - p[:, 1:2]) / 30, 0, 1) * 1.3
        sink = f.down * (0.5 * t * (1 - 0.5 * f.top) + hang)
        return _tangent(flow + sink, f.skull.height(p)[1])

    points = _grow(f, first, pull, length, 14, lift, 0.62, cling=0.6)
    return _clump(points, f.rng, 70, 0.2 + 0.4 * f.top[:, :, None], 14)


def _thinning(f):
    flow = f.top * (f.back * 0.9 + f.left * -0.3 * f.subject.part) + (1 - f.top) * (
        f.down * 0.6 + f.back
    )
    flow = _tangent(flow + f.locks * 0.35, f.out)
    length = (13 + 22 * f.top[:, 0]) * f.rng.uniform(0.7, 1.1, f.count)
    first = flow * 0.8 + f.normal * 0.45 + f.jitter(0.14)
    lift = 2.0 + 3.5 * f.rng.random(f.count)
    points = _grow(f, first, lambda p, t: flow, length, 9, lift, 0.65)
    return _clump(points, f.rng, 40, 0.45, 9)


def _curly(f):
    length = 7.0 + 6.0 * f.top[:, 0] * f.rng.uniform(0.6, 1, f.count)
    length *= 0.35 + 0.65 * f.density
    knots = 15
    t = np.linspace(0, 1, knots)[None, :, None]
    axis = _unit(f.normal + f.jitter(0.35) + f.locks * 0.5)[:, None]
    side = _unit(np.cross(axis, f.rng.normal(size=(f.count, 1, 3))))
    other = np.cross(axis, side)
    turn = (
        2 * np.pi * (1.6 + f.rng.uniform(-0.4, 0.6, (f.count, 1, 1))) * t + f.locks[:, None, :1] * 4
    )
    radius = 1.25 * f.rng.uniform(0.6, 1.3, (f.count, 1, 1)) * np.minimum(1, 3 * t)
    out = f.root[:, None] + axis * length[:, None, None] * t * 0.85
    return out + radius * (np.cos(turn) * side + np.sin(turn) * other)


def _bob(f):
    s = f.subject
    at = 14 * s.part
    across = np.where(f.rest[:, :1] - at > 0, 1.0, -1.0)
    chin = f.chart.spot(152)[1]
    side = np.clip(np.abs(f.rest[:, :1]) / 70, 0, 1)
    face = np.clip((f.rest[:, 2:] - f.chart.axis) / 80, 0, 1)
    toward = (
        f.left * across * (1.0 - 0.6 * side) + f.back * (0.65 - 0.2 * face) + f.down * 0.45 * side
    )
    length = np.clip(f.root[:, 1] - (chin - 6), 30, None) * 1.02 + 34 * f.top[:, 0]
    length *= 1.04 - 0.22 * f.rng.beta(1, 3, f.count)
    first = _tangent(toward, f.out) * 0.9 + f.normal * 0.12 + f.jitter(0.04)
    lift = 2 + 8 * f.rng.beta(1.6, 1.4, f.count) * (1 - 0.5 * f.top[:, 0])

    def pull(p, t):
        fall = np.clip(np.clip((42 - p[:, 1:2]) / 50, 0, 1) + 0.2 * t, 0, 1)
        inward = -np.sign(p[:, :1]) * f.left * 0.35 * np.clip((-60 - p[:, 1:2]) / 40, 0, 1)
        outward = f.skull.height(p)[1]
        lie = _tangent(toward + f.down * 0.9 * (1 - f.top), outward)
        return lie * (1 - fall) + f.down * fall * 1.3 + f.locks * 0.07 + inward

    points = _grow(f, first, pull, length, 26, lift, 0.72, clearance=1.0, wave=0.05, cling=0.18)
    return _clump(points, f.rng, 90, 0.5, 26)


def _pulled_back(f):
    knot = np.array([0, f.chart.crown - 74, 2 * f.chart.axis + 14])
    side = np.clip(np.abs(f.rest[:, :1]) / 70, 0, 1)
    length = np.linalg.norm(f.root - knot, axis=1) * f.rng.uniform(0.75, 1.15, f.count)
    length = np.clip(length, 25, 190)
    flow0 = _tangent(knot - f.root + np.array([0, 40.0, 0]) * side, f.out)
    first = flow0 * 0.95 + f.normal * 0.12 + f.jitter(0.05) + f.locks * 0.05
    stray = f.rng.random(f.count) < 0.012
    lift = 0.8 + 4.2 * f.rng.beta(1.4, 2, f.count) * (0.6 + 0.4 * f.top[:, 0]) + 5 * stray

    def pull(p, t):
        return (
            _tangent(knot - p, f.skull.height(p)[1])
            + f.locks * 0.10
            + f.jitter(0.09) * stray[:, None]
        )

    points = _grow(f, first, pull, length, 22, lift, 0.5, cling=0.5)
    return _clump(points, f.rng, 80, 0.35, 22)


def _bald(f):
    flow = _tangent(f.down + f.back * 0.6, f.out)
    length = f.rng.uniform(0.8, 1.8, f.count)
    first = flow + f.normal * 0.8 + f.jitter(0.2)
    return _grow(f, first, lambda p, t: flow, length, 4, np.zeros(f.count), 0.9, clearance=-5)


STYLES = {
    "crop": _crop, "side_part": _side_part, "thinning": _thinning, "curly": _curly,
    "bob": _bob, "pulled_back": _pulled_back, "bald": _bald,
}  # fmt: skip


def grow_scalp(head, chart, subject, mask, neutral, share=1.0):
    """The subject's scalp hair in head space.

    Args:
        head: head model.
        chart: its chart.
        mask: `scalp_mask`.
        neutral: [V, 3] mm neutral shape; scalp hair does not move with the expression.
        share: of the full number of hairs; fewer are drawn thicker.

    Returns:
        Strands.
    """
    rng = subject.rng("scalp")
    skull = Skull(head, chart, neutral)
    field = _Field(head, chart, subject, mask, neutral, skull, rng, share)
    points = STYLES[subject.hair](field).astype(np.float32)
    width = rng.uniform(0.07, 0.105, field.count) / np.sqrt(share) * (0.6 + 0.4 * field.density)
    color = strand_colors(subject, field.count, rng, field.rest)
    gloss = {"curly": 0.45, "bald": 0.3, "thinning": 0.8}.get(subject.hair, 1.0)
    outward = _unit(points[:, points.shape[1] // 2] - skull.center)
    outward = _unit(outward + 0.35 * field.out)
    return Strands(points, width, color, outward, gloss)
