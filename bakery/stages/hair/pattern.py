"""Patterns on cards of hair: streaks along strands, and where strands begin and end."""

import numpy as np

from bakery.geometry.fill import smoothstep

RAGGED, LONG = 0.3, 130.0  # of wisps so long, mm, so much has strands of different length
# mm that locks of a hem, and single strands in them, end before it; strands that a lock is wide.
LOCKS, SINGLE, WIDE = 14.0, 4.0, 6.0
ROOTS = 0.2  # of its length over which a card of a hem fades in
# Of its width that a wisp gets narrower to its tip, and from where on; the same of a hem's.
POINTED, HEM_POINTED = (0.4, 0.6), (0.5, 0.6)
CARVED = 0.25  # of half a card's width that curls cut off its border, in the mean


def _hash(*numbers):
    """0..1 of whole numbers, the same each time."""
    total = np.zeros(np.shape(numbers[0]), np.uint64)
    for k, number in enumerate(numbers):
        total ^= (
            np.asarray(number).astype(np.int64).astype(np.uint64) + np.uint64(k * 7919 + 1)
        ) * np.uint64((0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9)[k])
        total ^= total >> np.uint64(29)
        total *= np.uint64(0xBF58476D1CE4E5B9)
        total ^= total >> np.uint64(32)
    return (total >> np.uint64(40)).astype(np.float64) / float(1 << 24)


def _smooth_hash(card, across, seed):
    low = np.floor(across).astype(int)
    f = across - low
    f = f * f * (3 - 2 * f)
    return _hash(card, low, np.full(card.shape, seed)) * (1 - f) + f * _hash(
        card, low + 1, np.full(card.shape, seed)
    )


def streaks(card: np.ndarray, across: np.ndarray, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Noise [n] along the strands of cards, of unit variance; and [n] 0..1, which strands end early.

    Args:
        card: [n] numbers of cards.
        across: [n] strands from a card's left edge.
        t: [n] 0..1 from root to tip.
    """
    bent = across + 0.7 * np.sin(2 * np.pi * (t * 1.3 + _hash(card, card * 0, card * 0 + 9)))
    fine = _smooth_hash(card, bent * 1.0, 1) + 0.5 * _smooth_hash(card, bent * 2.3, 2)
    slow = _smooth_hash(card, bent * 0.4 + 3 * t, 3)
    own = _hash(card, card * 0, card * 0 + 5)
    noise = (fine - 0.75) * 1.8 + (slow - 0.5) * 1.2 + (own - 0.5) * 1.0
    return noise, _smooth_hash(card, bent * 0.8, 4)


def strand_alpha(
    card: np.ndarray,
    s: np.ndarray,
    across: np.ndarray,
    t: np.ndarray,
    ragged: np.ndarray,
    solid: np.ndarray,
    length: np.ndarray,
    hem: np.ndarray,
) -> np.ndarray:
    """Alpha [n] of straight hair on cards: strands with gaps between them, which end one by one.

    Args:
        card, across, t: as `streaks` takes them; ragged: as it gives it.
        s: [n] 0..1 across a card.
        solid: [n] 0..1: with no gaps at 1.
        length: [n] mm of the card.
        hem: [n] bool: cards of a hem, which fade in over other hair and end lock by lock.
    """
    locks = (LOCKS * _smooth_hash(card, across / WIDE, 10) + SINGLE * ragged) / length
    tip = 1 - np.where(hem, locks, RAGGED * np.minimum(length / LONG, 1) * ragged)
    ends = smoothstep(0.0, np.where(hem, SINGLE / length, 0.12), tip - t)
    rooted = 0.12 * _smooth_hash(card, across * 1.3, 6)
    begins = smoothstep(0.0, np.where(hem, ROOTS, 0.05), t - rooted)
    edge = np.abs(2 * s - 1)
    pointed, first = (np.where(hem, *pair) for pair in zip(HEM_POINTED, POINTED))
    inner = (
        1
        - pointed * smoothstep(first, 1.0, t)
        - 0.5 * _smooth_hash(card, t * 6 + 40 * (s > 0.5), 7)
        - 0.25 * ragged
    )
    sides = smoothstep(1.0, 0.6, edge / np.maximum(inner, 0.25) * 0.8)
    gaps = 1 - (1 - solid) * 0.55 * smoothstep(0.55, 0.85, _smooth_hash(card, across * 1.7, 8)) * (
        0.3 + 0.7 * t
    )
    alpha: np.ndarray = ends * begins * sides * gaps
    return alpha


def curl_alpha(s: np.ndarray, t: np.ndarray, curl: np.ndarray) -> np.ndarray:
    """Alpha [n] of curls on cards, which end where a curl does: bright ones stand out, the dark between is cut off."""
    inside = np.minimum(1 - np.abs(2 * s - 1), np.minimum(t / 0.1, (1 - t) / 0.2))
    high = np.clip(curl / max(float(curl.std()), 1e-6), -2, 2)
    return smoothstep(0.0, 0.2, inside - CARVED * (1 - 0.5 * high) * (1 - inside))
