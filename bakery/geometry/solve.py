"""Small dense quadratic programs with bounds, as every Gauss-Newton step of the fit needs them."""

import numpy as np


def minimize_box(hessian, gradient, low, high, rounds=60):
    """Minimise x'Hx / 2 + g'x subject to low <= x <= high by principal pivoting.

    Args:
        hessian: [P, P] symmetric, positive definite.
        gradient: [P] at x = 0.
        low, high: [P] bounds, low <= high.
        rounds: exchanges of the active set; in the second half one unknown at a time, which
            cannot cycle (Murty).

    Returns:
        x [P] within the bounds.

    References:
        Judice and Pires, "A Block Principal Pivoting Algorithm for Large-Scale Strictly Monotone
        Linear Complementarity Problems", Computers & Operations Research 21(5), 1994.
    """
    count = len(gradient)
    x = np.clip(0.0, low, high)
    # -1 at the low bound, 1 at the high one, 0 free. What stands at a bound mostly stays there.
    pinned = np.where((low == high) | (low == 0), -1, np.where(high == 0, 1, 0))
    slack = 1e-9 * max(1.0, np.abs(gradient).max()) if count else 0.0
    for turn in range(rounds):
        free = pinned == 0
        x = np.where(pinned < 0, low, np.where(pinned > 0, high, 0.0))
        if free.any():
            rows = hessian.compress(free, 0)
            right = -gradient[free] - rows.compress(~free, 1) @ x[~free]
            x[free] = np.linalg.solve(rows.compress(free, 1), right)
        slope = hessian @ x + gradient
        below = free & (x < low)
        above = free & (x > high)
        release = (low < high) & (
            ((pinned < 0) & (slope < -slack)) | ((pinned > 0) & (slope > slack))
        )
        wrong = np.flatnonzero(below | above | release)
        if not len(wrong):
            break
        if turn >= rounds // 2:
            wrong = wrong[-1:]
        pinned[wrong] = np.where(release, 0, np.where(below, -1, 1))[wrong]
    return np.clip(x, low, high)


def minimize_partly_bounded(hessian, gradient, bounded, low, high, rivals=()):
    """Minimise x'Hx / 2 + g'x where only the unknowns `bounded` have bounds.

    The free unknowns are eliminated first, so the active set works on a small matrix.

    Args:
        hessian: [P, P]; gradient: [P].
        bounded: [B] indices of the bounded unknowns.
        low, high: [B] their bounds.
        rivals: pairs (i, j) of positions in `bounded` that must not leave their lower bounds
            together; of two that would, the one that leaves less is held.

    Returns:
        x [P].
    """
    free = np.ones(len(gradient), bool)
    free[bounded] = False
    rows = hessian.compress(free, 0)
    across = rows.take(bounded, 1)
    solved = np.linalg.solve(rows.compress(free, 1), np.column_stack([across, gradient[free]]))
    reduced = hessian.take(bounded, 0).take(bounded, 1) - across.T @ solved[:, :-1]
    slope = gradient[bounded] - across.T @ solved[:, -1]
    high = np.array(high, float)
    for _ in range(4):
        y = minimize_box(reduced, slope, low, high)
        moved = y - low
        both = [(i, j) for i, j in rivals if min(moved[i], moved[j]) > 1e-6]
        if not both:
            break
        for i, j in both:
            held = i if moved[i] < moved[j] else j
            high[held] = low[held]
    x = np.zeros(len(gradient))
    x[bounded] = y
    x[free] = -(solved[:, -1] + solved[:, :-1] @ y)
    return x
