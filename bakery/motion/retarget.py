"""A take of one person for the face of another: rest subtracted, weights scaled."""

from dataclasses import replace

import numpy as np

from bakery.errors import InputError
from bakery.types import EXPRESSION_INDEX, EXPRESSIONS

ANGLES = ("head", "gaze")  # what --gain knows besides expressions
MOST = 10.0  # largest gain
FULL = 0.95  # a resting weight above this leaves nothing to stretch


def parse_gain(texts):
    """Gains from "1.2" (all expressions) and "jawOpen=0.8,head=0.5".

    Returns:
        dict of ARKit name, "head" or "gaze" -> factor.

    Raises:
        InputError: an unknown name, or no number of 0..10.
    """
    table = {}
    for item in filter(None, (part.strip() for text in texts for part in text.split(","))):
        name, equals, value = item.rpartition("=")
        try:
            factor = float(value)
        except ValueError:
            factor = np.nan
        if not 0 <= factor <= MOST:
            raise InputError(f"--gain: '{item}'; give NAME=NUMBER or NUMBER, 0 to {MOST:g}")
        if equals and name not in EXPRESSION_INDEX and name not in ANGLES:
            raise InputError(f"--gain: no '{name}'; give an ARKit name, head or gaze")
        table |= {name: factor} if equals else dict.fromkeys(EXPRESSIONS, factor)
    return table


def retarget(take, gain=None, neutral=None):
    """A take with its resting face subtracted and its weights scaled.

    A weight w whose resting value is r becomes gain (w - r) / (1 - r), within 0..1: rest is 0 then,
    and full stays full. Angles lose those of rest, so that rest looks straight ahead.

    Args:
        take: formats.livelink.Take.
        gain: as from `parse_gain`.
        neutral: row, from 0, at which the face rests; None takes nothing off.

    Raises:
        InputError: the take has no such row.
    """
    gain = gain or {}
    factors = np.array([gain.get(name, 1.0) for name in EXPRESSIONS])
    weights, head, eyes = take.weights.astype(np.float64), take.head, take.eyes
    if neutral is not None:
        if not 0 <= neutral < len(weights):
            raise InputError(
                f"--neutral {neutral}: the take has {len(weights)} rows, counted from 0; give one"
            )
        rest = np.minimum(weights[neutral], FULL)
        weights = (weights - rest) / (1 - rest)
        head = head - head[neutral]
        eyes = None if eyes is None else eyes - eyes[neutral]
    weights = np.clip(weights * factors, 0, 1).astype(np.float32)
    look = gain.get("gaze", 1.0)
    if look != 1:
        for name in EXPRESSIONS:
            if name.startswith("eyeLook"):
                at = EXPRESSION_INDEX[name]
                weights[:, at] = np.clip(weights[:, at] * look, 0, 1)
    return replace(
        take,
        weights=weights,
        head=head * gain.get("head", 1.0),
        eyes=None if eyes is None else eyes * look,
    )
