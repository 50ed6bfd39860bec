"""Minimisation of a smooth function of many unknowns: L-BFGS with a weak Wolfe line search."""

from collections import deque
from collections.abc import Callable

import numpy as np

MEMORY = 8  # pairs of steps and changes of the gradient
LESS, FLATTER = (
    1e-4,
    0.9,
)  # Wolfe: share of the promised decrease, and of the slope that may be left
TRIES = 12  # of a line search

Objective = Callable[[np.ndarray], tuple[float, np.ndarray]]
Pairs = deque[tuple[np.ndarray, np.ndarray, float]]  # step, change of the gradient, their product


def minimize(objective: Objective, start: np.ndarray, steps: int, tiny: float = 1e-8) -> np.ndarray:
    """The argument [n] with the least value that is found.

    Args:
        objective: x [n] in; value and gradient [n] out.
        start: [n] float; the result has its dtype.
        steps: at most; each takes one evaluation, seldom more.
        tiny: stops where no element of the gradient is larger.

    References:
        Nocedal and Wright, "Numerical Optimization", 2006, algorithm 7.4; Lewis and Overton,
        "Nonsmooth Optimization via Quasi-Newton Methods", Math. Programming 141, 2013: line search.
    """
    x = start
    value, slope = objective(x)
    pairs: Pairs = deque(maxlen=MEMORY)
    for _ in range(steps):
        if np.abs(slope).max(initial=0) <= tiny:
            break
        way = _direction(slope, pairs)
        # The first step knows no scale: as far as moves the unknowns by a hundredth.
        length = 1.0 if pairs else 0.01 / float(np.abs(slope).max())
        found = _searched(objective, x, value, slope, way, length)
        if found is None:
            break
        after, value, slope_after = found
        step, change = after - x, slope_after - slope
        along = float(step @ change)
        if along > 0:
            pairs.append((step, change, along))
        x, slope = after, slope_after
    return x


def _direction(slope: np.ndarray, pairs: Pairs) -> np.ndarray:
    """Against the gradient, by the inverse Hessian that the pairs tell of: two-loop recursion."""
    way = -slope
    amounts = []
    for step, change, along in reversed(pairs):
        amounts.append(float(step @ way) / along)
        way = way - amounts[-1] * change
    if pairs:
        _, change, along = pairs[-1]
        way = way * (along / float(change @ change))
    for (step, change, along), amount in zip(pairs, reversed(amounts)):
        way = way + (amount - float(change @ way) / along) * step
    return way


def _searched(
    objective: Objective,
    x: np.ndarray,
    value: float,
    slope: np.ndarray,
    way: np.ndarray,
    length: float,
) -> tuple[np.ndarray, float, np.ndarray] | None:
    """Where along a way both Wolfe conditions hold, its value and gradient; None where nothing falls."""
    falls = float(slope @ way)
    low, high = 0.0, np.inf
    best = None
    for _ in range(TRIES):
        after = (x + length * way).astype(x.dtype)
        value_after, slope_after = objective(after)
        if not value_after <= value + LESS * length * falls:
            high = length
        else:
            best = after, value_after, slope_after
            if float(slope_after @ way) >= FLATTER * falls:
                break
            low = length
        length = 2 * length if high == np.inf else (low + high) / 2
    return best
