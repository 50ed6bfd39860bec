"""Hair styles: direction fields along which strands grow."""

from dataclasses import dataclass

import numpy as np

from bakery.synth.growth import Field, gather, grow, locks_of, stray, tangent, unit, wave

COUNT = {
    "crop": 95000, "side_part": 110000, "swept_back": 105000, "receding": 80000, "thinning": 45000,
    "curly": 90000, "afro": 52000, "bob": 110000, "fringe": 110000, "long": 100000,
    "long_wavy": 80000, "curls": 80000, "pulled_back": 110000, "ponytail": 110000, "bun": 110000,
    "bald": 26000,
}  # fmt: skip
BROAD, FINE = 260, 2600  # locks of the whole head


def _locked(f, points, broad=0.3, fine=0.5):
    """Strands drawn together in broad locks and in fine ones."""
    points = gather(f, points, locks_of(f, BROAD), broad)
    return gather(f, points, locks_of(f, FINE), fine)


def _crop(f, longer=1.0):
    s = f.subject
    front = np.clip((f.rest[:, 2] - f.chart.axis) / 80, -1, 1)[:, None]
    comb = (
        -f.left * 0.55 * s.part + np.array([0, 0.25, 0.45]) * front + f.back * (0.5 - 0.5 * front)
    )
    flow = f.top * comb + (1 - f.top) * (f.down + f.back * 0.55)
    flow = tangent(flow + f.locks * 0.55, f.out)
    length = (7 + 19 * f.top[:, 0] * longer) * f.rng.uniform(0.75, 1.1, f.count)
    length *= 0.45 + 0.55 * f.density
    first = flow * 0.55 + f.normal * (0.35 + 0.5 * f.top) + f.jitter(0.16)
    lift = 1.2 + 9 * f.top[:, 0] * longer * f.rng.uniform(0.3, 1, f.count)
    points = grow(f, first, lambda p, t: flow + f.down * 0.15 * t, length, 9, lift, 0.72)
    return _locked(f, points, 0.1, (0.2 + 0.35 * f.top[:, :, None])[:, 0, 0])


def _side_part(f):
    s = f.subject
    at = 26 * s.part
    across = np.where((f.rest[:, :1] - at) * s.part > 0, 1.0, -1.0) * s.part
    front = np.clip((f.rest[:, 2:] - f.chart.axis) / 80, -1, 1)
    comb = f.left * across * 0.9 + f.back * 0.55 + np.array([0, 0.3, 0.0]) * front
    flow = f.top * comb + (1 - f.top) * (f.down * 0.8 + f.back * 0.7)
    flow = tangent(flow + f.locks * 0.22, f.out)
    main = np.clip(-(f.rest[:, 0] - at) * s.part / 30, 0, 1)
    length = (11 + f.top[:, 0] * (16 + 27 * main)) * f.rng.uniform(0.8, 1.1, f.count)
    length *= 0.45 + 0.55 * f.density
    first = flow * 0.8 + f.normal * (0.22 + 0.25 * f.top) + f.jitter(0.08)
    lift = 1.2 + 7 * f.top[:, 0] * f.rng.uniform(0.35, 1, f.count) * (0.4 + 0.6 * main)

    def pull(p, t):
        hang = np.clip((f.chart.crown - 42 - p[:, 1:2]) / 30, 0, 1) * 1.3
        sink = f.down * (0.5 * t * (1 - 0.5 * f.top) + hang)
        return tangent(flow + sink, f.skull.height(p)[1])

    points = grow(f, first, pull, length, 14, lift, 0.62, cling=0.6)
    return _locked(f, points, 0.15, (0.2 + 0.4 * f.top[:, :, None])[:, 0, 0])


def _thinning(f):
    flow = f.top * (f.back * 0.9 + f.left * -0.3 * f.subject.part) + (1 - f.top) * (
        f.down * 0.6 + f.back
    )
    flow = tangent(flow + f.locks * 0.35, f.out)
    length = (13 + 22 * f.top[:, 0]) * f.rng.uniform(0.7, 1.1, f.count)
    first = flow * 0.8 + f.normal * 0.45 + f.jitter(0.14)
    lift = 2.0 + 3.5 * f.rng.random(f.count)
    points = grow(f, first, lambda p, t: flow, length, 9, lift, 0.65)
    return _locked(f, points, 0.1, 0.45)


def _curly(f):
    length = 7.0 + 6.0 * f.top[:, 0] * f.rng.uniform(0.6, 1, f.count)
    length *= 0.35 + 0.65 * f.density
    knots = 15
    t = np.linspace(0, 1, knots)[None, :, None]
    axis = unit(f.normal + f.jitter(0.35) + f.locks * 0.5)[:, None]
    side = unit(np.cross(axis, f.rng.normal(size=(f.count, 1, 3))))
    other = np.cross(axis, side)
    turn = (
        2 * np.pi * (1.6 + f.rng.uniform(-0.4, 0.6, (f.count, 1, 1))) * t + f.locks[:, None, :1] * 4
    )
    radius = 1.25 * f.rng.uniform(0.6, 1.3, (f.count, 1, 1)) * np.minimum(1, 3 * t)
    out = f.root[:, None] + axis * length[:, None, None] * t * 0.85
    return out + radius * (np.cos(turn) * side + np.sin(turn) * other)


def _bald(f):
    flow = tangent(f.down + f.back * 0.6, f.out)
    length = f.rng.uniform(0.8, 1.8, f.count)
    first = flow + f.normal * 0.8 + f.jitter(0.2)
    return grow(f, first, lambda p, t: flow, length, 4, np.zeros(f.count), 0.9, clearance=-5)


@dataclass(frozen=True)
class Fall:
    """Hair that falls from a parting."""

    below: float  # mm below the chin where the longest tips end
    part: float = 14.0  # mm from the middle to the parting
    lift: float = 9.0  # mm of volume above the skull
    height: float = 0.0  # mm of its waves
    period: float = 60.0  # mm of one wave
    depth: float = 0.4  # of the waves, see `growth.wave`
    fringe: float = 0.0  # share of the hair above the forehead that falls over it
    inward: float = 0.35  # how strongly the tips turn to the neck
    layers: float = 0.22  # share of the length that the shortest hairs lack
    knots: int = 28


FALLS = {
    "bob": Fall(6.0, height=0.8),
    "fringe": Fall(34.0, part=0.0, lift=8.0, fringe=1.0, height=0.8, inward=0.2),
    "long": Fall(150.0, part=10.0, lift=8.0, height=1.6, period=90.0, inward=0.1, knots=38),
    "long_wavy": Fall(
        125.0, part=20.0, lift=14.0, height=12.0, period=80.0, depth=0.55, inward=0.05, layers=0.25, knots=36
    ),
    "curls": Fall(
        40.0, part=6.0, lift=20.0, height=7.0, period=24.0, depth=1.0, inward=0.0, layers=0.5, knots=72
    ),
}  # fmt: skip


def _fall(f):
    s, look = f.subject, FALLS[f.subject.hair]
    at = look.part * s.part + 2.5 * f.locks[:, 1:2]
    across = np.where(f.rest[:, :1] - at > 0, 1.0, -1.0)
    chin, eyes = f.chart.spot(152)[1], f.chart.spot(263)[1]
    side = np.clip(np.abs(f.rest[:, :1]) / 70, 0, 1)
    face = np.clip(f.front, 0, 1)
    above = f.chart.flat(f.rest)[:, 1:] - f.chart.spot(10)[1]
    edge = np.clip(1.6 - above / 25, 0, 1)  # at the hairline nothing may fall over the face
    aside = across * np.clip(np.abs(f.rest[:, :1] - at) / 10, 0.5 + 0.5 * edge, 1)
    toward = (
        f.left * aside * (1.0 - 0.6 * side) + f.back * (0.65 - 0.2 * face) + f.down * 0.45 * side
    )
    length = np.clip(f.root[:, 1] - (chin - look.below), 30, None) * 1.02 + 34 * f.top[:, 0]
    length *= 1.04 - look.layers * f.rng.beta(1, 3 if look.layers < 0.3 else 1.5, f.count)
    lift = 2 + look.lift * f.rng.beta(1.6, 1.4, f.count) * (1 - 0.35 * f.top[:, 0])
    flat = f.chart.flat(f.rest)
    hairline = f.chart.spot(10)[1]
    behind = flat[:, 1] - hairline - 0.12 * np.abs(flat[:, 0])
    over = (np.abs(flat[:, 0]) < 52 + 5 * f.locks[:, 0]) & (
        behind < 34 + 18 * f.rng.random(f.count)
    )
    over &= f.rng.random(f.count) < look.fringe
    ends = f.chart.spot(105)[1] + 3 - 6 * np.clip(np.abs(flat[:, 0]) / 46, 0, 1) ** 2
    length = np.where(over, 1.12 * (f.root[:, 1] - ends) * f.vary(0.9, 1.06) + 9, length)
    lift = np.where(over, 5 + 4 * f.rng.random(f.count), lift)
    over = over[:, None]
    forward = -f.back * 0.55 + f.down * 0.7 + f.left * (np.sign(flat[:, :1]) * 0.10 + 0.12 * s.part)
    first = np.where(over, forward, tangent(toward, f.out)) * 0.9 + f.normal * (0.12 + 0.4 * over)
    first = first + f.jitter(0.04)
    before = np.clip(1.6 * f.front + 0.3, -1, 1)  # +1 falls before the shoulder, -1 behind it

    def pull(p, t):
        low = np.clip((eyes - 60 - p[:, 1:2]) / 60, 0, 1)
        fall = np.clip(np.clip((42 - p[:, 1:2]) / 50, 0, 1) + 0.2 * t, 0, 1)
        inward = (
            -np.sign(p[:, :1])
            * f.left
            * (look.inward + 0.5 * (before < 0))
            * np.clip((-60 - p[:, 1:2]) / 40, 0, 1)
        )
        outward = f.skull.height(p)[1]
        lie = tangent(toward + f.down * 0.9 * (1 - f.top), outward)
        hang = f.down * 1.3 + f.back * np.where(before > 0, -0.4, -1.1) * before * low
        lying = lie * (1 - fall) + hang * fall + f.locks * 0.07 + inward
        return np.where(over, forward + f.down * t + f.locks * 0.05, lying)

    points = grow(f, first, pull, length, look.knots, lift, 0.72, clearance=1.0, cling=0.18)
    leader, broad = locks_of(f, 900 if look.depth == 1 else FINE), locks_of(f, BROAD)
    bent = np.where(over[:, 0], 0.15, 1.0) * look.height
    points = wave(f, points, leader if look.depth == 1 else broad, bent, look.period, look.depth)
    points = gather(f, points, broad, 0.25 + 0.15 * (look.height > 4))
    points = gather(f, points, leader, 0.55 if look.height < 4 else 0.75)
    return stray(f, points, 0.012, 8.0 + look.height)


def _combed(f, longer=1.0, volume=1.0):
    """Hair combed back from the forehead, close at the sides."""
    comb = f.back * 0.9 + np.array([0, 0.5, 0.0]) * np.clip(f.front, 0, 1)
    comb = comb + f.left * 0.10 * f.subject.part
    flow = f.top * comb + (1 - f.top) * (f.down * 0.45 + f.back)
    flow = tangent(flow + f.locks * 0.25, f.out)
    length = (12 + 42 * f.top[:, 0] * longer) * f.vary(0.75, 1.1)
    length *= 0.45 + 0.55 * f.density
    rise = f.top * np.clip(f.front + 0.2, 0, 1)
    first = flow * 0.7 + f.normal * (0.25 + 0.8 * rise * volume) + f.jitter(0.08)
    lift = 1.2 + volume * (4 * f.top[:, 0] + 8 * rise[:, 0]) * f.vary(0.35, 1)

    def pull(p, t):
        return tangent(flow + f.down * 0.25 * t, f.skull.height(p)[1])

    points = grow(f, first, pull, length, 14, lift, 0.66, cling=0.5)
    return stray(f, _locked(f, points, 0.25 * f.top[:, 0], 0.25 + 0.35 * f.top[:, 0]), 0.01, 5.0)


def _receding(f):
    return _combed(f, 0.75, 0.6)


@dataclass(frozen=True)
class Tie:
    """Hair drawn to one place and what becomes of it there."""

    up: float  # mm of the place above the crown
    back: float  # share of the way from the skull's front to its back
    lift: float = 4.2  # mm of volume on the way
    tail: float = 0.0  # mm that hangs down from the place
    ball: float = 0.0  # mm radius of the knot


TIES = {
    "pulled_back": Tie(-74.0, 0.94),
    "ponytail": Tie(-22.0, 1.04, 6.0, tail=210.0),
    "bun": Tie(8.0, 0.80, 6.5, ball=30.0),
}


def _tied(f):
    look = TIES[f.subject.hair]
    crown, axis = f.chart.crown, f.chart.axis
    knot = np.array([0.0, crown + look.up, axis + (look.back * 2 - 1) * (axis - 14.0)])
    side = np.clip(np.abs(f.rest[:, :1]) / 70, 0, 1)
    way = np.linalg.norm(f.root - knot, axis=1)
    length = np.clip(way * f.vary(0.75, 1.15), 25, 190)
    more = np.zeros(f.count)
    if look.tail or look.ball:
        more = (f.rng.random(f.count) < 0.5) * (look.tail or 170.0) * f.vary(0.75, 1.05)
        length = np.where(more > 0, 1.15 * way + more, length)
    rise = np.array([0, 40.0 if look.up < -40 else 8.0, 0]) * side
    first = tangent(knot - f.root + rise, f.out) * 0.95 + f.normal * 0.12
    first = first + f.jitter(0.05) + f.locks * 0.05
    lift = 0.8 + look.lift * f.rng.beta(1.4, 2, f.count) * (0.6 + 0.4 * f.top[:, 0])
    gone = np.zeros(f.count, bool)
    axes, size = unit(f.jitter(1.0) + f.locks), look.ball * f.vary(0.55, 1.0)[:, None]

    def free(p):
        gone[:] |= (np.linalg.norm(p - knot, axis=1) < max(14.0, look.ball)) & (more > 0)
        return gone

    def pull(p, t):
        comb = tangent(knot - p, f.skull.height(p)[1]) + f.locks * 0.10
        off = p - knot
        if look.ball:
            radius = np.linalg.norm(off, axis=1, keepdims=True) + 1e-6
            after = unit(np.cross(axes, off)) + off / radius * (size - radius) / 10.0
        else:
            near = np.clip(1 - np.linalg.norm(off, axis=1, keepdims=True) / 60, 0, 1)
            after = f.down + f.back * (1.6 * near + 0.05) + f.locks * 0.16
        return np.where(gone[:, None], after, comb)

    knots = 48 if look.tail or look.ball else 22
    points = grow(
        f,
        first,
        pull,
        length,
        knots,
        lift,
        0.5 if knots == 22 else 0.35,
        cling=0.5,
        free=free,
        hangs=False,
    )
    points = gather(f, points, locks_of(f, FINE), 0.35 * (more == 0) + 0.3 * (look.tail > 0))
    return stray(f, points, 0.014, 7.0)


def _afro(f):
    knots = 44
    length = (40 + 18 * f.top[:, 0]) * f.vary(0.75, 1.08) * (0.3 + 0.7 * f.density)
    t = np.linspace(0, 1, knots)[None, :, None]
    axis = unit(f.normal * 0.75 + f.out * 0.5 + f.jitter(0.38) + f.locks * 0.3)[:, None]
    leader = locks_of(f, 6 * FINE)
    side = unit(np.cross(axis, f.rng.normal(size=(f.count, 1, 3))[leader]))
    turn = (
        2 * np.pi * (length[:, None, None] / 8.5) * t + f.rng.normal(size=(f.count, 1, 1))[leader]
    )
    radius = 2.6 * f.vary(0.6, 1.3)[:, None, None] * np.minimum(1, 6 * t)
    drift = unit(f.jitter(1.0))[:, None] * (0.30 * length[:, None, None]) * t**2
    out = f.root[:, None] + axis * length[:, None, None] * t * 0.9 + drift
    out = out + radius * (np.cos(turn) * side + np.sin(turn) * np.cross(axis, side))
    length = length[:, None, None]
    face = np.clip(f.front, 0, 1)[:, None] * length * t
    return out + face * np.array([0, 0, -0.35]) + np.array([0, -0.12, 0]) * length * t**2


STYLES = {
    "crop": _crop, "side_part": _side_part, "swept_back": _combed, "receding": _receding,
    "thinning": _thinning, "curly": _curly, "afro": _afro, "bald": _bald,
    **dict.fromkeys(FALLS, _fall), **dict.fromkeys(TIES, _tied),
}  # fmt: skip


def strands_of(head, chart, subject, mask, neutral, skull, rng, share, body=None):
    """The `Field` of a subject's scalp hair and its points [n, K, 3] mm; see `hair.grow_scalp`."""
    count = int(COUNT[subject.hair] * share)
    field = Field(head, chart, subject, mask, neutral, skull, rng, count, body)
    return field, STYLES[subject.hair](field)
