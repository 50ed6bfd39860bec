"""Where a clip is cut: each shot is followed and fitted by itself."""

from collections import deque
from collections.abc import Iterable, Iterator
from itertools import groupby

import cv2
import numpy as np

Timed = tuple[float, np.ndarray]  # seconds, [H, W, 3] uint8 sRGB
SIDE = 32  # pixels a side of the thumbnails that are compared
# A head that turns fast, and a hand before the lens, change thumbnails by up to 6 levels a frame;
# another shot changes them by 20 and more.
STEP = 16.0  # levels of 255, mean over a thumbnail
JUMP = 4.0  # times the usual change: a camera that swings is no row of cuts
USUAL = 12  # frames that say what is usual


class Cuts:
    """Numbers the shots of a clip, frame after frame."""

    def __init__(self) -> None:
        self.number = 0
        self.last: np.ndarray | None = None
        self.steps: deque[float] = deque(maxlen=USUAL)

    def __call__(self, frame: Timed) -> int:
        """The number, from 0, of the shot that a frame (seconds, picture) belongs to."""
        small = cv2.resize(frame[1], (SIDE, SIDE), interpolation=cv2.INTER_AREA).astype(np.float32)
        if self.last is not None:
            step = float(np.abs(small - self.last).mean())
            usual = float(np.median(self.steps)) if self.steps else 0.0
            if step > max(STEP, JUMP * usual):
                self.number += 1
                self.steps.clear()
            else:
                self.steps.append(step)
        self.last = small
        return self.number


def shots(frames: Iterable[Timed]) -> Iterator[Iterator[Timed]]:
    """The frames of each shot of a clip, one shot after the other; no frame is kept."""
    for _, shot in groupby(frames, Cuts()):
        yield shot
