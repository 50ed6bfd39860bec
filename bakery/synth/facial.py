"""Brows, lashes, stubble and beard: short hairs that move with the face."""

import numpy as np

from bakery.geometry.curve import spline
from bakery.synth.chart import BROW_LOWER, BROW_UPPER, LID_LOWER, LID_UPPER, SIDES, SIGN
from bakery.synth.hair import hair_color, strand_colors
from bakery.synth.roots import roots_on, sample_roots
from bakery.synth.skin import beard_mask, brow_mask
from bakery.synth.strands import Strands


def _unit(v):
    return v / (np.linalg.norm(v, axis=-1, keepdims=True) + 1e-9)


def _along_surface(chart, rest, normal, flat):
    """Chart directions [n, 2] as tangents [n, 3] of the posed skin."""
    angle = np.arctan2(rest[:, 0], rest[:, 2] - chart.axis)
    across = np.stack([np.cos(angle), np.zeros_like(angle), -np.sin(angle)], 1)
    out = across * flat[:, :1] + np.array([0, 1.0, 0]) * flat[:, 1:]
    return _unit(out - (out * normal).sum(1, keepdims=True) * normal)


def brow_color(subject):
    """Brows are darker than scalp hair, and grey later."""
    base = hair_color(subject)
    return np.clip(base * (0.62 if base.mean() > 0.03 else 0.9), 0.006, 0.16)


def brows(head, chart, subject, vertices, share=1.0):
    """Both brows [Strands] on a posed shape."""
    rng = subject.rng("brows")
    sets = []
    for side in SIDES:
        s = SIGN[side]
        upper, lower = chart.spot(BROW_UPPER[side]), chart.spot(BROW_LOWER[side])
        middle = spline((upper + lower) / 2, 30)[::-1]  # inner to outer
        half = np.linalg.norm(upper - lower, axis=1).mean() / 2
        mask = brow_mask(chart, side, 1.1)
        number = int(900 * subject.brow_density * share)
        faces, barycentric, rest = sample_roots(head, chart, mask, number, rng)
        root, normal = roots_on(head, vertices, faces, barycentric)
        flat = chart.flat(rest)
        away = np.linalg.norm(flat[:, None] - middle[None], axis=2)
        at = away.argmin(1)
        share_along = at / (len(middle) - 1.0)
        tangent = _unit(np.gradient(middle, axis=0))[at]
        over = np.clip((flat - middle[at])[:, 1] / max(half, 1.0), -1.2, 1.2)
        keep = (np.abs(over) < 1.25) & (
            rng.random(len(flat)) < np.clip(0.35 + 3.5 * share_along, 0, 1)
        )
        turn = np.radians(
            72 - 78 * np.clip(share_along * 1.9, 0, 1) ** 0.7 - 30 * over * (share_along > 0.12)
        )
        turn += rng.normal(size=len(flat)) * 0.16
        up = np.stack([-tangent[:, 1], tangent[:, 0]], 1) * s
        heading = tangent * np.cos(turn)[:, None] + up * np.sin(turn)[:, None]
        length = rng.uniform(4.6, 8.2, len(flat)) * subject.brow_length * (1 - 0.25 * share_along)
        first = _along_surface(chart, rest, normal, heading)
        later = _along_surface(chart, rest, normal, _unit(heading + tangent * 0.75 + [0, -0.1]))
        t = np.linspace(0, 1, 7)[None, :, None]
        points = root[:, None] + length[:, None, None] * (
            first[:, None] * (t - 0.45 * t * t) + later[:, None] * 0.45 * t * t
        )
        points = points + normal[:, None] * (0.15 + 0.9 * t - 0.55 * t * t) * 0.8
        color = brow_color(subject) * np.exp(rng.normal(size=(len(flat), 1)) * 0.25)
        grey = rng.random(len(flat)) < subject.grey * 0.5
        color[grey] = [0.22, 0.21, 0.2]
        width = rng.uniform(0.065, 0.105, len(flat)) / np.sqrt(share)
        sets.append(
            Strands(
                points[keep].astype(np.float32),
                width[keep],
                color[keep],
                normal[keep],
                0.35,
                0.85,
                "brow",
                0.8,
            )
        )
    return sets


def lashes(head, subject, vertices, share=1.0):
    """Lashes of both lids [Strands] on a posed shape."""
    rng = subject.rng("lashes")
    marks = head.landmarks(vertices)
    centers = head.eye_centers(vertices)
    sets = []
    for side in SIDES:
        s, center = SIGN[side], centers[0 if side == "left" else 1]
        for ring, number, length in ((LID_UPPER, 160, 6.5), (LID_LOWER, 70, 4.4)):
            upper = ring is LID_UPPER
            path = spline(marks[list(ring[side])], 200)
            count = max(12, int(number * min(1, share * 1.5)))
            at = np.sort(rng.uniform(0.03, 0.90 if upper else 0.86, count))  # outer to inner
            root = path[(at * 199).astype(int)] + rng.normal(size=(count, 3)) * 0.12
            root[:, 1] += -0.45 if upper else 0.2
            outward = _unit(root - center)
            fan = (0.55 - 1.15 * at)[:, None] * np.array([s, 0, 0]) + rng.normal(
                size=(count, 3)
            ) * 0.07
            size = length * subject.lash_length * rng.uniform(0.6, 1.05, count)
            size *= 0.55 + 0.45 * np.sin(np.pi * np.clip(0.15 + 0.75 * (1 - at), 0, 1))
            t = np.linspace(0, 1, 9)[None, :, None]
            if upper:
                first = _unit(outward * 0.9 + fan * 0.9 + np.array([0, -0.10, 0.35]))
                curl = np.array([0, 1.0, 0.1])
                bend = 0.62
            else:
                first = _unit(outward * 0.7 + fan * 0.8 + np.array([0, -0.55, 0.3]))
                curl = np.array([0, 0.12, 0.35])
                bend = 0.25
            points = root[:, None] + size[:, None, None] * (
                first[:, None] * (t - 0.25 * t * t) + curl * bend * t * t
            )
            dark = np.clip(hair_color(subject) * 0.08, 0.002, 0.015)
            color = np.repeat(dark[None], count, 0) * rng.uniform(0.6, 1.4, (count, 1))
            width = rng.uniform(0.075, 0.115, count) * (1.0 if upper else 0.65)
            sets.append(
                Strands(
                    points.astype(np.float32),
                    width,
                    color,
                    outward,
                    0.04,
                    0.95 if upper else 0.6,
                    "lash",
                    0.85,
                )
            )
    return sets


def beard(head, chart, subject, vertices, share=1.0):
    """Stubble or beard [list of Strands] on a posed shape; empty for a shaved face."""
    if subject.stubble <= 0 and subject.beard <= 0:
        return []
    rng = subject.rng("beard")
    full = subject.beard > 0
    mask = beard_mask(chart)
    patch = chart.blur(rng.normal(size=mask.shape).astype(np.float32), 4.0)
    mask = mask * np.clip(0.75 + 0.25 * patch / patch.std(), 0.1, 1)
    faces, barycentric, rest = sample_roots(
        head, chart, mask, int((20000 if full else 13000) * share), rng
    )
    root, normal = roots_on(head, vertices, faces, barycentric)
    count = len(root)
    flat = np.stack([0.25 * np.sign(rest[:, 0]) * (np.abs(rest[:, 0]) < 30), -np.ones(count)], 1)
    flat = flat + rng.normal(size=(count, 2)) * 0.35
    tangent = _along_surface(chart, rest, normal, flat)
    size = subject.beard if full else 0.5 + 1.6 * subject.stubble
    length = size * rng.uniform(0.5, 1.1, count) * (0.5 + 0.5 * chart.sample(mask, rest))
    t = np.linspace(0, 1, 6 if full else 3)[None, :, None]
    bend = rng.normal(size=(count, 1, 3)) * (0.35 if full else 0.1)
    points = root[:, None] + length[:, None, None] * (
        (tangent * 0.8 + normal * 0.45)[:, None] * t + bend * t * t - np.array([0, 0.15, 0]) * t * t
    )
    color = np.clip(strand_colors(subject, count, rng, rest) * 0.8, 0.006, 0.5)
    width = rng.uniform(0.07, 0.11, count) / np.sqrt(share)
    return [
        Strands(points.astype(np.float32), width, color, normal, 0.3, 0.8 if full else 0.7, "beard")
    ]
