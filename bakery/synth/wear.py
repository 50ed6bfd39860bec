"""Random things that people wear and hold before their faces, and what throws shadows on them."""

from dataclasses import replace

import numpy as np

from bakery.geometry import rotation
from bakery.synth import props
from bakery.synth.noise import gradient_noise
from bakery.synth.props import Prop, Rims
from bakery.synth.roots import Skull
from bakery.synth.skin import skin_color

TARGETS = (152, 13, 50, 280, 33, 263, 10, 4, 132, 361)  # points of the face that hands go to
FINGER = (66, 76, 72, 56)  # mm
HATS = ("cap", "beanie", "brim", "band", "veil")


def random_color(rng) -> np.ndarray:
    """A linear reflectance [3]: grey, pale, dark or loud."""
    level = np.exp(rng.uniform(np.log(0.008), np.log(0.75)))
    return np.clip(level * np.exp(rng.normal(size=3) * rng.choice([0.05, 0.3, 0.8])), 0.004, 0.8)


def random_glasses(head, neutral, rng) -> tuple[list[Prop], Rims]:
    """Glasses of any make: thin metal to thick plastic, round to square, with or without rims."""
    metal = rng.random() < 0.5
    half = float(rng.uniform(21, 29))
    rims = Rims(
        half=(half, half * float(rng.uniform(0.55, 0.98))),
        power=float(rng.choice([rng.uniform(0.85, 1.0), rng.uniform(0.5, 0.8)])),
        drop=float(rng.uniform(1, 8)),
        thick=float(rng.uniform(0.45, 1.0) if metal else rng.uniform(1.0, 3.2)),
        below=bool(rng.random() < 0.8),
        around=not (metal and rng.random() < 0.35),
    )
    if metal:
        color = rng.choice([[0.35, 0.24, 0.1], [0.4, 0.4, 0.4], [0.05, 0.05, 0.05]])
    elif rng.random() < 0.6:
        color = np.full(3, rng.uniform(0.004, 0.03))
    else:
        color = random_color(rng)
    lens = None
    if rng.random() < 0.2:
        lens = np.exp(rng.normal(size=3) * 0.4) * rng.uniform(0.002, 0.03)
    return props.glasses(head, neutral, lens, tuple(np.asarray(color) * 1.0), rims), rims


def random_hat(head, chart, neutral, rng, style: str) -> tuple[Prop, object]:
    """What covers the scalp, and a function that presses strands [S, K, 3] under it.

    Args:
        style: one of HATS.
    """
    skull = Skull(head, chart, neutral)
    marks = head.landmarks(neutral)
    brow = float(marks[[105, 334], 1].mean())
    line = brow + rng.uniform(8, 34)
    tilt = rng.uniform(0.05, 0.35)  # higher in front than behind
    lift = rng.uniform(5, 13) + (6 if style == "brim" else 0)
    around, rows = 96, 28
    angle = (np.arange(around) / around - 0.5) * 2 * np.pi
    low = np.arccos(np.clip((line - skull.center[1]) / 105, -0.5, 0.95))
    low = low + tilt * (1 - np.cos(angle)) / 2 * 1.4
    if style == "veil":
        opening = np.clip(1 - np.abs(angle) / rng.uniform(0.9, 1.15), 0, 1) > 0
        low = np.where(opening, low * rng.uniform(0.75, 0.95), 2.75)
    first = np.arccos(np.clip((line + rng.uniform(25, 60) - skull.center[1]) / 105, -1, 0.98))
    top = min(first, low.min() * 0.7) if style == "band" else 0.02
    share = np.linspace(0, 1, rows)[:, None]
    up = top + (low - top) * share
    way = np.stack([np.sin(up) * np.sin(angle), np.cos(up), np.sin(up) * np.cos(angle)], -1)
    probe = skull.center + way * 100.0
    radius = 100.0 - skull.height(probe.reshape(-1, 3))[0].reshape(up.shape)
    bump, _ = gradient_noise(probe.reshape(-1, 3), 40.0, int(rng.integers(2**31)), octaves=2)
    puff = bump.reshape(up.shape) * (5 if style in ("veil", "beanie") else 1.5)
    radius = np.maximum.accumulate(radius, 0) if style in ("cap", "brim") else radius
    shell = skull.center + way * (radius + lift + puff)[..., None]
    parts = [(shell.reshape(-1, 3), _sheet(rows, around))]
    if style in ("cap", "brim"):
        parts.append(_brim(shell[-1], angle, style, rng))
    vertices, faces = props.joined(parts)
    color = random_color(rng)
    weave, _ = gradient_noise(vertices, 12.0, int(rng.integers(2**31)), octaves=3)
    pattern = 1 + rng.uniform(0, 0.5) * weave[:, None]
    albedo = np.clip(color * pattern, 0.003, 0.8).astype(np.float32)
    hat = Prop(vertices, faces, albedo, 0.8, 0.02, what="hat")

    def press(points):
        relative = points - skull.center
        length = np.linalg.norm(relative, axis=-1)
        column = np.arctan2(relative[..., 0], relative[..., 2]) / (2 * np.pi) + 0.5
        edge = low[np.clip((column * around).astype(int), 0, around - 1)]
        upward = np.arccos(np.clip(relative[..., 1] / np.maximum(length, 1e-6), -1, 1))
        height, out = skull.height(points.reshape(-1, 3))
        over = np.maximum(height.reshape(length.shape) - 0.4 * lift, 0)
        over *= (upward < edge + 0.05) & (upward > top - 0.05)
        return (points - out.reshape(points.shape) * over[..., None]).astype(np.float32)

    return hat, press


def _sheet(rows, around):
    r, c = np.mgrid[: rows - 1, :around]
    a, b = r * around + c, r * around + (c + 1) % around
    quads = np.stack([a, a + around, b + around, b], -1).reshape(-1, 4)
    return np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


def _brim(edge, angle, style, rng):
    """A brim around, or a visor in front of, the edge [n, 3] of a hat."""
    out = np.stack([np.sin(angle), np.zeros_like(angle), np.cos(angle)], 1)
    wide = rng.uniform(35, 75)
    if style == "cap":
        wide = wide * np.clip(np.cos(angle) * 1.6, 0, 1) ** 0.5
    reach = np.linspace(0, 1, 7)[:, None, None] * np.broadcast_to(wide, angle.shape)[None, :, None]
    fall = np.array([0, -rng.uniform(0.05, 0.45), 0])
    sheet = edge[None] + (out + fall) * reach
    return sheet.reshape(-1, 3), _sheet(7, len(edge))


def random_hand(head, subject, neutral, rng) -> Prop:
    """One hand of the subject somewhere on or before the face."""
    forward = props.relief(head, neutral)
    marks = head.landmarks(neutral).astype(float)
    target = marks[int(rng.choice(TARGETS)), :2] + rng.normal(size=2) * 14
    come = rng.uniform(0, 2 * np.pi) if rng.random() < 0.3 else rng.uniform(np.pi, 2 * np.pi)
    along = -np.array([np.cos(come), np.sin(come)])
    side = np.array([-along[1], along[0]]) * rng.choice([-1, 1])
    scale, bent = rng.uniform(0.85, 1.15), rng.uniform(0.45, 1.0)
    wrist = target - along * rng.uniform(70, 120) * scale
    floor, away = marks[152, 2] - rng.uniform(5, 30), rng.choice([0, rng.uniform(0, 45)])
    fan = rng.uniform(0.02, 0.22)

    def deep(flat, radius):
        return np.maximum(forward(flat), floor) + radius * 0.85 + away

    parts = []
    for k in range(4):
        base = wrist + (along * 62 + side * (k - 1.5) * 18) * scale
        turn = (k - 1.5) * fan + rng.normal() * 0.05
        heading = along * np.cos(turn) + side * np.sin(turn)
        share = np.linspace(0, 1, 7)[:, None]
        flat = base + heading * FINGER[k] * scale * bent * rng.uniform(0.8, 1.05) * share
        radius = np.interp(share[:, 0], [0, 0.5, 1], [9.6, 8.6, 6.6]) * scale
        path = np.column_stack([flat, deep(flat, radius) + 7 * np.sin(np.pi * share[:, 0])])
        parts.append(props.capsule(path, radius))
        start = wrist + side * (k - 1.5) * 7
        palm = start + (path[0, :2] - start) * np.array([[0.0], [0.5], [1.0]])
        level = np.linspace(deep(wrist[None], np.array([16.0]))[0], path[0, 2], 3)
        parts.append(props.capsule(np.column_stack([palm, level]), np.array([17, 14, 11]) * scale))
    turn = rng.uniform(0.3, 1.1)
    heading = along * np.cos(turn) - side * np.sin(turn)
    base = wrist + along * 18 - side * 20
    flat = base + heading * 58 * scale * np.linspace(0, 1, 5)[:, None]
    radius = np.linspace(12, 8, 5) * scale
    parts.append(props.capsule(np.column_stack([flat, deep(flat, radius)]), radius))
    level = deep(wrist[None], np.array([18.0]))[0]
    arm = np.column_stack([wrist - along * np.array([[0], [70], [220]]), level + [0, -6, -20]])
    parts.append(props.capsule(arm, [21, 24, 31]))
    vertices, faces = props.joined(parts)
    blotch, _ = gradient_noise(vertices, 9.0, subject.seed + 91, octaves=4, gain=0.6)
    color = skin_color(
        0.18 + 0.9 * subject.melanin * (1 + 0.1 * blotch),
        subject.haemoglobin * (0.85 + 0.25 * blotch),
    )
    return Prop(vertices, faces, color.astype(np.float32), 0.55, 0.026)


def random_object(head, neutral, rng) -> Prop:
    """A telephone, a microphone, a cup or a ball before the face."""
    marks = head.landmarks(neutral).astype(float)
    middle = marks[int(rng.choice(TARGETS))] + rng.normal(size=3) * [22, 22, 0]
    middle[2] = max(middle[2], marks[4, 2] - 20) + rng.uniform(12, 60)
    kind = rng.integers(4)
    if kind == 0:
        size = np.array([rng.uniform(25, 60), rng.uniform(50, 90), rng.uniform(3, 8)])
        corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * size
        quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
        faces = np.concatenate([np.array(quads)[:, [0, 1, 2]], np.array(quads)[:, [0, 2, 3]]])
        turn = rotation.matrix(rng.normal(size=3) * [0.4, 0.4, 0.8])
        parts = [(corners @ turn.T + middle, faces)]
    elif kind == 1:
        heading = np.array([rng.normal() * 0.5, -1.0, rng.uniform(0, 0.7)])
        end = middle + heading / np.linalg.norm(heading) * 180
        parts = [props.capsule([middle, (middle + end) / 2, end], [11, 10, 9])]
        ball = [middle + [0, 2, 0], middle, middle - [0, 2, 0]]
        parts.append(props.capsule(ball, np.full(3, rng.uniform(18, 28))))
    else:
        wide = rng.uniform(18, 42)
        heading = rng.normal(size=3) * [1, 1, 0.3]
        reach = heading / np.linalg.norm(heading) * (rng.uniform(20, 60) if kind == 2 else 3)
        parts = [props.capsule([middle - reach, middle, middle + reach], np.full(3, wide))]
    vertices, faces = props.joined(parts)
    spots, _ = gradient_noise(vertices, 15.0, int(rng.integers(2**31)), octaves=2)
    albedo = np.clip(random_color(rng) * (1 + rng.uniform(0, 0.6) * spots[:, None]), 0.003, 0.8)
    return Prop(vertices, faces, albedo.astype(np.float32), float(rng.uniform(0.25, 0.8)), 0.04)


def random_bars(rng, toward, middle) -> list[Prop]:
    """Bars or leaves out of the picture, between a lamp and the face.

    Args:
        toward: [3] unit, head space, to the lamp.
        middle: [3] mm, of the face.
    """
    right = np.cross(toward, rng.normal(size=3))
    right /= np.linalg.norm(right)
    up = np.cross(toward, right)
    center = middle + toward * rng.uniform(170, 420)
    cards = []
    if rng.random() < 0.5:
        step, place = rng.uniform(26, 70), -150.0
        while place < 150:
            wide = step * rng.uniform(0.3, 0.6)
            edges = [(place, -200), (place + wide, -200), (place + wide, 200), (place, 200)]
            cards.append([center + right * a + up * b for a, b in edges])
            place += step
    else:
        for _ in range(int(rng.integers(2, 12))):
            spot, size = rng.normal(size=2) * 70, rng.uniform(12, 55)
            turns = np.sort(rng.uniform(0, 2 * np.pi, 4))
            edges = spot + size * np.stack([np.cos(turns), np.sin(turns)], 1)
            cards.append([center + right * a + up * b for a, b in edges])
    return [props.card(card) for card in cards]


def pressed(hair, press):
    """Strands of the scalp under a hat."""
    return replace(hair, points=press(hair.points))
