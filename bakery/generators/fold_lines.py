"""Which folds a face can have: lines across the acting muscles, drawn anew for every subject.

Lines are given on the subject's right side in the 478-point order and mirrored; each point is a mix
of landmarks. Depths are mm at full compression of an eighty-year-old; widths from the valley to its
shoulder. Sources: Lemperle et al., "A classification of facial wrinkles", Plast. Reconstr. Surg.
108(6), 2001; Ekman and Friesen, "Facial Action Coding System", 1978, for what each action folds.
"""

from dataclasses import dataclass

import numpy as np

BROW = (70, 63, 105, 66, 107)
HAIRLINE = (54, 103, 67, 109, 10)
# Where muscles draw the corner of the mouth: to the cheekbone, back, down.
UP = ((61, 116, 0.5), (61, 123, 0.5))
WING = ((98, 119, 0.6), (206, 117, 0.4))  # the wing of the nose, up
BACK = ((61, 147, 0.6), (61, 123, 0.4))
DOWN = ((61, 150, 0.5), (61, 136, 0.5))

REFERENCE = 0.2  # share of UP's length that a full grin takes, on a head made from scans
ACTIONS = (  # what `pulls` are measured by on each head
    {"mouthSmileLeft": 1, "mouthSmileRight": 1, "cheekSquintLeft": 0.9, "cheekSquintRight": 0.9},
    {"noseSneerLeft": 1, "noseSneerRight": 1, "mouthUpperUpLeft": 0.6, "mouthUpperUpRight": 0.6},
    {"mouthFrownLeft": 1, "mouthFrownRight": 1, "mouthStretchLeft": 0.5, "mouthStretchRight": 0.5},
)


@dataclass(frozen=True)
class Line:
    """One fold of one subject."""

    points: tuple  # of {landmark: weight}; a negative weight leads off the face
    width: float  # mm
    depth: float  # mm at full compression; negative stands up
    onset: float  # share of the length lost at which it begins to show
    gain: float  # further share at which it is full; of `pulls`, on a head that gives REFERENCE
    left: bool = False  # mirrored to the subject's left
    lean: float = 0.0  # 0..1: how much more of the skin piles up on the outer side
    pulls: tuple = ()  # (landmark, landmark, weight): what shortens; () asks the skin at the fold
    wander: float = 0.4  # mm it strays from its course
    shift: np.ndarray = None  # [3] mm, this subject's own place

    def __post_init__(self):
        if self.shift is None:
            object.__setattr__(self, "shift", np.zeros(3))


def mix(first, second, share):
    """The point between two landmarks."""
    return {first: 1 - share, second: share}


def subject_lines(rng, age):
    """The lines of one subject: [Line], both sides.

    Args:
        rng: numpy Generator.
        age: years; the young have fewer and shallower lines, that come later.
    """
    old = float(np.clip((age - 18) / 55, 0, 1.1))
    # Genes and sun count as much as years.
    worn = float(np.clip(0.42 + 0.62 * old + rng.normal() * 0.12, 0.25, 1.2))
    onset = 0.035 * (1 - 0.7 * old)
    out = []
    for points, width, depth, gain, lean, place, *pulls in _kinds(rng, old):
        alike = rng.normal(size=3) * place
        for left in (False, True):
            if abs(depth) < 0.9 and rng.random() < 0.06 * (1 - old):
                continue  # some small lines show on one side only
            out.append(
                Line(
                    points=points,
                    width=width * rng.uniform(0.85, 1.2),
                    depth=depth * worn * rng.uniform(0.75, 1.2),
                    onset=onset * rng.uniform(0.5, 1.4),
                    gain=gain * rng.uniform(0.85, 1.25),
                    left=left,
                    lean=lean,
                    pulls=tuple(pulls[0]) if pulls else (),
                    wander=rng.uniform(0.25, 0.6),
                    shift=alike + rng.normal(size=3) * 0.35,
                )
            )
    return out


def _kinds(rng, old):
    """Yield (points, width, depth, gain, lean, place[, pulls]) of lines on the right side."""
    yield from _forehead(rng)
    yield from _glabella(rng)
    yield from _eyes(rng, old)
    yield from _nose(rng)
    yield from _cheeks(rng, old)
    yield from _lips(rng, old)
    yield from _chin_and_neck(rng)


def _forehead(rng):
    """Frontalis lifts the brows: level lines, each of its own length and wave."""
    count = int(rng.integers(3, 7))
    places = np.sort(rng.uniform(0.14, 0.74, count))
    overall = rng.uniform(0.5, 1.1)
    for t in places:
        first = int(rng.integers(0, 2))
        points = tuple(
            mix(b, h, float(np.clip(t + rng.normal() * 0.035, 0.1, 0.95)))
            for b, h in zip(BROW[first:], HAIRLINE[first:])
        )
        if rng.random() < 0.7:  # reaches the middle
            points += ({9: 1 - t, 10: t},)
        yield points, rng.uniform(1.5, 2.6), overall * rng.uniform(0.55, 1.05), 0.14, 0.0, 1.2


def _glabella(rng):
    """Corrugator draws the brows together: one to three upright lines beside the middle."""
    for k in range(int(rng.integers(1, 3))):
        out = 0.15 + 0.4 * k
        points = (
            {55: 0.8, 193: 0.2},
            {107: 0.7 - out * 0.3, 9: 0.3 + out * 0.1, 55: 0.2},
            {107: 0.6, 9: 0.25, 151: 0.15},
        )
        yield points, rng.uniform(1.4, 2.2), rng.uniform(0.6, 1.1) / (1 + 0.7 * k), 0.14, 0.0, 0.8


def _eyes(rng, old):
    """Orbicularis: a fan beside the eye and arcs under it."""
    rays = (
        ({226: 0.5, 113: 0.5}, {113: 0.5, 156: 0.5}, {124: 0.7, 70: 0.3}),
        ({130: 0.6, 226: 0.4}, {35: 0.5, 124: 0.5}, {156: 0.3, 143: 0.7}),
        ({130: 0.5, 226: 0.5}, {35: 1.0}, {143: 1.0}),
        ({226: 0.6, 31: 0.4}, {111: 0.6, 35: 0.4}, {116: 0.5, 143: 0.5}),
        ({31: 0.7, 226: 0.3}, {111: 1.0}, {116: 0.8, 117: 0.2}, {123: 0.6, 116: 0.4}),
    )
    overall = rng.uniform(0.5, 1.15)
    for ray in rays:
        if rng.random() < 0.85:
            yield ray, rng.uniform(1.0, 1.7), overall * rng.uniform(0.35, 0.7), 0.14, 0.0, 0.8
    arcs = (
        ({226: 0.5, 31: 0.5}, {228: 0.75, 31: 0.25}, {229: 0.8, 230: 0.2}, {231: 1.0}, {232: 1.0}),
        ({31: 0.6, 117: 0.4}, {118: 0.5, 229: 0.5}, {119: 0.4, 230: 0.6}, {120: 0.4, 231: 0.6}),
        ({117: 0.9, 31: 0.1}, {118: 1.0}, {119: 1.0}, {120: 0.9, 121: 0.1}),
    )
    for k, arc in enumerate(arcs[: 2 + (rng.random() < 0.4 + 0.5 * old)]):
        yield arc, 1.4 + 0.4 * k, rng.uniform(0.28, 0.55), 0.15, 0.0, 0.6


def _nose(rng):
    """Levator and procerus: slanting lines on the side of the nose, one across its root."""
    lines = (
        ({193: 0.7, 168: 0.3}, {122: 0.5, 188: 0.5}, {114: 1.0}),
        ({168: 0.7, 193: 0.3}, {245: 0.4, 122: 0.6}, {188: 0.5, 128: 0.5}),
        ({6: 0.8, 122: 0.2}, {196: 0.6, 188: 0.4}, {174: 0.5, 114: 0.5}),
    )
    for line in lines[: int(rng.integers(1, 4))]:
        yield line, rng.uniform(1.1, 1.7), rng.uniform(0.35, 0.65), 0.06, 0.0, 0.6
    if rng.random() < 0.6:
        yield ({168: 1.0}, {168: 0.5, 193: 0.5}, {193: 0.7, 55: 0.3}), 1.6, 0.6, 0.10, 0.0, 0.6


def _cheeks(rng, old):
    """Zygomaticus: the nasolabial fold with the cheek above it, brackets, dimples."""
    fold = (
        {129: 0.7, 49: 0.3},
        {203: 0.65, 206: 0.35},
        {206: 0.4, 216: 0.6},
        {216: 0.55, 212: 0.45},
        {212: 0.75, 57: 0.25},
    )
    width, depth = rng.uniform(2.8, 4.4), rng.uniform(0.8, 1.7)
    yield fold, width, depth, 0.14, 0.75, 0.9, UP
    yield fold[:4], width, 0.8 * depth, 0.10, 0.75, 0.9, WING
    if rng.random() < 0.35 + 0.5 * old:  # a second bracket outside the first
        yield (
            ({205: 0.6, 206: 0.4}, {207: 0.6, 216: 0.4}, {207: 0.4, 212: 0.6}, {214: 0.5, 212: 0.5}),
            rng.uniform(2.2, 3.4), rng.uniform(0.6, 1.3), 0.16, 0.4, 1.5, UP,
        )  # fmt: skip
    if rng.random() < 0.30:
        yield (
            ({216: 0.5, 207: 0.5}, {212: 0.6, 207: 0.4}, {214: 0.5, 212: 0.5}),
            rng.uniform(1.8, 2.8), rng.uniform(0.9, 1.7), 0.16, 0.0, 1.5, BACK,
        )  # fmt: skip
    yield (
        ({61: 0.5, 57: 0.5}, {57: 0.7, 43: 0.3}, {43: 0.6, 202: 0.4}),
        rng.uniform(1.8, 2.6), rng.uniform(0.6, 1.2), 0.14, 0.3, 0.6, BACK,
    )  # fmt: skip
    if rng.random() < 0.3 + 0.6 * old:  # the marionette line
        yield (
            ({57: 0.6, 43: 0.4}, {202: 1.0}, {210: 0.6, 211: 0.4}),
            rng.uniform(2.0, 3.0), rng.uniform(0.4, 1.0), 0.12, 0.3, 0.9, DOWN,
        )  # fmt: skip


def _lips(rng, old):
    """Orbicularis oris: upright creases of both lips and lines above the red when it purses."""
    upper = ((39, 40, 92, 165), (37, 39, 165, 167), (0, 37, 167, 164), (40, 185, 186, 92))
    for a, b, c, d in upper:
        for _ in range(1 + (rng.random() < 0.3 + 0.6 * old)):
            t = rng.uniform(0, 1)
            points = (mix(a, b, t), {a: 0.4 * (1 - t), b: 0.4 * t, c: 0.3, d: 0.3})
            depth = rng.uniform(0.06, 0.16) + 0.16 * old
            yield points, rng.uniform(0.8, 1.2), depth, 0.16, 0.0, 0.2
    inner = ((81, 38, 37), (82, 38, 0), (80, 42, 39), (191, 183, 40), (80, 41, 40))
    inner += ((178, 86, 85), (87, 85, 84), (88, 89, 181), (95, 96, 91), (178, 180, 84))
    for a, b, c in inner:
        points = ({a: 1.0}, {b: 0.6, a: 0.2, c: 0.2}, {c: 1.0})
        yield points, rng.uniform(0.8, 1.3), rng.uniform(0.16, 0.32), 0.15, 0.0, 0.3


def _chin_and_neck(rng):
    """Mentalis under the lower lip, the line below the jaw, the cords of the platysma."""
    yield (
        ({204: 0.5, 106: 0.5}, {194: 0.7, 182: 0.3}, {201: 0.6, 200: 0.4}, {200: 1.0}),
        rng.uniform(2.2, 3.2), rng.uniform(0.5, 1.1), 0.14, 0.0, 0.6,
    )  # fmt: skip
    for line in (
        ({200: 0.6, 208: 0.4}, {208: 0.5, 199: 0.5}, {171: 0.5, 199: 0.5}),
        ({201: 0.5, 208: 0.5}, {208: 1.0}, {171: 0.7, 208: 0.3}),
        ({211: 0.5, 208: 0.5}, {211: 0.4, 32: 0.6}, {140: 0.6, 32: 0.4}),
    )[: int(rng.integers(1, 4))]:  # the dimpled chin
        yield line, rng.uniform(1.4, 2.2), rng.uniform(0.2, 0.45), 0.16, 0.0, 1.2
    yield (
        ({176: 0.5, 148: 0.5}, {149: 1.0}, {150: 0.6, 136: 0.4}),
        rng.uniform(2.2, 3.2), rng.uniform(0.3, 0.8), 0.20, 0.0, 1.5,
    )  # fmt: skip
    old = rng.random()
    for out in range(int(rng.integers(1, 3))):  # cords: they stand up when the mouth is drawn down
        jaw, cheek = ((149, 118), (136, 123))[out]
        run = tuple({jaw: 1 + t, cheek: -t} for t in (0.15, 0.5, 0.9, 1.3))
        yield run, rng.uniform(3.0, 4.5), -(0.5 + 1.5 * old), 0.16, 0.0, 2.0, DOWN
