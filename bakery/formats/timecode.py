"""Time codes of takes, HH:MM:SS:FF.mmm: read, written, and how many frames their seconds have.

Live Link Face counts sixtieths of a second whatever the camera's rate; other tools count the
camera's frames. A file does not say which, but its rows do where one second ends.
"""

import re

import numpy as np

BASE = 60  # frames that a second has unless the rows say otherwise
BASES = (60, 50, 48, 30, 25, 24)  # in doubt the first
DAY = 86400  # seconds
NEAR = 1.0  # frames that a measured base may lie beside a known one
FAST = 45.0  # rows a second at base 60 that may as well be the usual 30 at base 30
TIMECODE = re.compile(r"(\d{1,2}):(\d{1,2}):(\d{1,2}):(\d{1,3}(?:\.\d+)?)", re.ASCII)


def parse(text: str) -> tuple[int, float] | None:
    """Whole seconds of the day and frames of a time code; None if it is none."""
    match = TIMECODE.fullmatch(text)
    if match is None:
        return None
    hours, minutes, seconds = (int(part) for part in match.groups()[:3])
    if hours > 23 or minutes > 59 or seconds > 59:
        return None
    return hours * 3600 + minutes * 60 + seconds, float(match[4])


def find_base(whole: np.ndarray, frames: np.ndarray) -> tuple[int, str | None]:
    """How many frames a second of the time codes has.

    Where the second changes, the last FF plus the usual step, minus the first FF, is the base: each
    such place votes for a known one above all FF, and half of the votes are enough.

    Args:
        whole: [N] int seconds of the day; frames: [N] FF.mmm; rows in order.

    Returns:
        the base, and a note where it is not the usual one, or cannot be told and may be half of it.
    """
    later, steps = np.diff(whole) % DAY, np.diff(frames)
    inside = steps[(later == 0) & (steps > 0)]
    ends = np.flatnonzero(later == 1)
    known = [base for base in BASES if base > frames.max(initial=0)]
    if not len(inside) or not known:
        return BASE, None
    step = float(np.median(inside))
    if not len(ends):
        slow = frames.max() < BASE / 2 and BASE / step > FAST
        return BASE, "too short to tell the base of its time code; taken as 60" if slow else None
    measured = frames[ends] - frames[ends + 1] + step
    apart = np.abs(measured[:, None] - known)
    votes = np.bincount(apart.argmin(1)[apart.min(1) <= NEAR], minlength=len(known))
    base = known[votes.argmax()]
    if base == BASE or 2 * votes.max() < len(ends):
        return BASE, None
    return base, f"time code read at {base} frames a second"


def written(seconds: float) -> str:
    """A time of day in seconds as HH:MM:SS:FF.mmm, 60 frames a second."""
    thousandths = round(seconds % DAY * BASE * 1000) % (DAY * BASE * 1000)
    frames, thousandths = divmod(thousandths, 1000)
    whole, frames = divmod(frames, BASE)
    hours, minutes = divmod(whole // 60, 60)
    return f"{hours:02d}:{minutes:02d}:{whole % 60:02d}:{frames:02d}.{thousandths:03d}"
