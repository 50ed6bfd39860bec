"""Curves through points."""

import numpy as np


def spline(points, count=40):
    """A smooth curve [count, d] through points [n, d] (Catmull-Rom)."""
    points = np.asarray(points, float)
    padded = np.concatenate([2 * points[:1] - points[1:2], points, 2 * points[-1:] - points[-2:-1]])
    t = np.linspace(0, len(points) - 1 - 1e-9, count)
    k = t.astype(int)
    u = (t - k)[:, None]
    a, b, c, d = padded[k], padded[k + 1], padded[k + 2], padded[k + 3]
    return 0.5 * (
        2 * b + (c - a) * u + (2 * a - 5 * b + 4 * c - d) * u**2 + (3 * b - a - 3 * c + d) * u**3
    )


def nearest_on(points: np.ndarray, line: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The nearest points of a polyline, and where along it they lie.

    Args:
        points: [N, d]; line: [n, d], at least two points.

    Returns:
        [N, d]; [N] 0..1, share of the line's length.
    """
    points, line = np.asarray(points, float), np.asarray(line, float)
    steps = np.diff(line, axis=0)
    lengths = np.linalg.norm(steps, axis=1)
    begins = np.concatenate([[0.0], np.cumsum(lengths)])
    best = np.full(len(points), np.inf)
    found, along = np.zeros_like(points), np.zeros(len(points))
    for start, step, length, begin in zip(line, steps, lengths, begins):
        share = np.clip((points - start) @ step / max(length**2, 1e-12), 0, 1)
        there = start + share[:, None] * step
        apart = ((points - there) ** 2).sum(1)
        closer = apart < best
        best[closer], found[closer] = apart[closer], there[closer]
        along[closer] = begin + share[closer] * length
    return found, along / max(begins[-1], 1e-12)
