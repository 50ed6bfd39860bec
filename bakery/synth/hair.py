"""Scalp hair: its colours, and its strands in the style of a subject."""

import numpy as np

from bakery.synth.growth import unit
from bakery.synth.noise import gradient_noise
from bakery.synth.roots import Skull
from bakery.synth.strands import Strands
from bakery.synth.styles import strands_of
from bakery.synth.subject import HAIR_COLORS


def hair_color(subject):
    """Mean colour [3] linear of the subject's hair, greys counted in."""
    base, grey = np.array(HAIR_COLORS[subject.hair_color]), np.array(HAIR_COLORS["grey"])
    return base + (grey - base) * subject.grey


def strand_colors(subject, count, rng, places):
    """Colours [S, 3] of single hairs around the subject's: lighter and darker locks, greys."""
    base = np.array(HAIR_COLORS[subject.hair_color])
    lock, _ = gradient_noise(places, 9.0, subject.seed + 21, octaves=2)
    level = np.exp(rng.normal(size=count) * 0.32 + 0.8 * lock)
    warm = np.exp(rng.normal(size=(count, 1)) * 0.06 * np.array([1, 0, -1.0]))
    color = base * level[:, None] * warm
    temple = np.clip(np.abs(places[:, 0]) / 75, 0, 1) * 0.5 + 0.75
    grey = rng.random(count) < subject.grey * temple
    color[grey] = np.array(HAIR_COLORS["grey"]) * rng.uniform(0.7, 1.5, (grey.sum(), 1))
    return np.clip(color, 0.004, 0.75)


def grow_scalp(head, chart, subject, mask, neutral, share=1.0, body=None):
    """The subject's scalp hair in head space.

    Args:
        head: head model.
        chart: its chart.
        mask: `scalp_mask`.
        neutral: [V, 3] mm neutral shape; scalp hair does not move with the expression.
        share: of the full number of hairs; fewer are drawn thicker.
        body: garment.Body that long hair falls over; None for none.

    Returns:
        Strands.
    """
    rng = subject.rng("scalp")
    skull = Skull(head, chart, neutral)
    field, points = strands_of(head, chart, subject, mask, neutral, skull, rng, share, body)
    points = points.astype(np.float32)
    width = rng.uniform(0.07, 0.105, field.count) / np.sqrt(share) * (0.6 + 0.4 * field.density)
    width *= 1.5 if subject.hair == "afro" else 1.0  # coils too fine to draw make up for it
    color = strand_colors(subject, field.count, rng, field.rest)
    gloss = {"curly": 0.45, "afro": 0.4, "bald": 0.3, "thinning": 0.8}.get(subject.hair, 1.0)
    outward = unit(points[:, points.shape[1] // 2] - skull.center)
    outward = unit(outward + 0.35 * field.out)
    return Strands(points, width, color, outward, gloss)
