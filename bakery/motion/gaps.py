"""Frames of a take in which no face was seen: short gaps are bridged, in long ones the face rests."""

import numpy as np


def gaps_of(found: np.ndarray) -> list[tuple[int, int]]:
    """The gaps of a clip: (first frame without a face, first one with a face after it) each.

    Args:
        found: [N] bool.
    """
    edges = np.flatnonzero(np.diff(np.concatenate([[True], found, [True]]).astype(int)))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist()))


def filled(
    values: np.ndarray, found: np.ndarray, seconds: np.ndarray, bridge: int, rests: bool = True
) -> np.ndarray:
    """Values of every frame from those of the frames with a face.

    A gap lies on the line between its neighbours, and before the first face and after the last one
    values hold. Where a gap is longer than `bridge` frames, values that rest become 0 within half of
    that, and leave it likewise: a smile is not held over seconds in which nobody was there.

    Args:
        values: [n, C] of the n frames that have a face.
        found: [N] bool.
        seconds: [N], increasing.
        bridge: frames.
        rests: whether values have a rest at 0, as weights do and head angles do not.

    Returns:
        [N, C]
    """
    times, knots = seconds[found], values
    long = [(first, after) for first, after in gaps_of(found) if after - first > bridge]
    if rests and long:
        ease = bridge // 2
        edges = [edge for first, after in long for edge in _rest(first, after, ease, len(found))]
        rest = np.unique(edges)
        times = np.concatenate([times, seconds[rest]])
        knots = np.concatenate([knots, np.zeros((len(rest), knots.shape[1]))])
        order = np.argsort(times, kind="stable")
        times, knots = times[order], knots[order]
    return np.stack([np.interp(seconds, times, column) for column in knots.T], 1)


def _rest(first, after, ease, count):
    """First and last frame of a gap in which the face rests: `ease` frames inside of it."""
    begin = 0 if first == 0 else first + ease
    end = count - 1 if after == count else after - 1 - ease
    return begin, end


def told(found: np.ndarray, seconds: np.ndarray, bridge: int) -> tuple[str, ...]:
    """Lines about the frames without a face, for the notes of a take; none if there are none."""
    gaps = gaps_of(found)
    short = sum(after - first for first, after in gaps if after - first <= bridge)
    long = [(first, after) for first, after in gaps if after - first > bridge]
    lines = (f"{short} frames without a face interpolated",) if short else ()
    if long:
        lost = sum(after - first for first, after in long)
        where = ", ".join(
            f"{seconds[first] - seconds[0]:.2f} to {seconds[after - 1] - seconds[0]:.2f} s"
            for first, after in long[:6]
        )
        more = f" and {len(long) - 6} more" * (len(long) > 6)
        lines += (f"{lost} frames without a face, {where}{more}: the face rests there",)
    return lines
