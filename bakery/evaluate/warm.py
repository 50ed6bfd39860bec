"""Milliseconds of detection, segmentation and tracking, once everything is loaded."""

import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import cv2
import numpy as np

from bakery.detectors.base import Detector
from bakery.evaluate.tracking import GRAIN, RATE
from bakery.formats.image import read_photo
from bakery.geometry.color import to_bytes
from bakery.geometry.shrink import shrink
from bakery.heads.base import HeadModel
from bakery.motion.follow import follow
from bakery.motion.track import solve
from bakery.stages.detect import detect_faces
from bakery.stages.segment import segment

DETECTED, TRACKED = 1350, 512  # pixels, longer side
SWAY = (0.15, 0.06, 0.05)  # of a tracked face: radians, shift over the side, growth


def clock() -> tuple[float, float]:
    """Seconds of wall clock and of processor time, of all threads."""
    return time.perf_counter(), time.process_time()


def figures(marks: Sequence[tuple[float, float]]) -> dict[str, float]:
    """What lies between readings of `clock`, milliseconds: medians, and the least wall clock."""
    wall, processor = 1000 * np.diff(np.array(marks), axis=0).T
    found = {
        "wall_ms": np.median(wall),
        "least_ms": wall.min(),
        "processor_ms": np.median(processor),
    }
    return {name: round(float(value), 2) for name, value in found.items()}


def repeated(work: Callable[[], object], count: int) -> dict[str, float]:
    """Figures of `count` runs, the first one, which loads, left out."""
    work()
    marks = [clock()]
    for _ in range(count):
        work()
        marks.append(clock())
    return figures(marks)


def moving(picture: np.ndarray, count: int) -> Iterator[np.ndarray]:
    """A picture [H, W, 3] uint8 that sways as a head does, with fresh grain: frames like it."""
    rng, size = np.random.default_rng(0), picture.shape[1::-1]
    turn, shift, growth = SWAY
    for phase in 2 * np.pi * np.arange(count) / RATE:
        matrix = cv2.getRotationMatrix2D(
            (size[0] / 2, size[1] / 2),
            float(np.degrees(turn * np.sin(phase))),
            1 + growth * np.cos(phase / 2),
        )
        matrix[:, 2] += shift * size[0] * np.sin(phase / 3), shift * size[1] * np.cos(phase / 5)
        frame = cv2.warpAffine(picture, matrix, size, borderMode=cv2.BORDER_REPLICATE)
        noisy = frame + rng.normal(0, GRAIN, frame.shape)
        yield np.clip(noisy + 0.5, 0, 255).astype(np.uint8)


def measure(
    photo: Path, head: HeadModel, detector: Detector, count: int = 20, frames: int = 60
) -> dict[str, dict[str, float]]:
    """Figures of each.

    Args:
        photo: with one face; detected with a longer side of `DETECTED` pixels, segmented as it is,
            and moved about as a clip of `TRACKED` pixels.
        count: runs of detection and of segmentation.
        frames: of the clip. `track` is a frame's points and fit together, without what is done once
            a clip, `person`.
    """
    picture = read_photo(photo).encoded
    seen, small = (sized(picture, side) for side in (DETECTED, TRACKED))
    points = detect_faces(picture, detector)[0].points
    found = {
        "detect": repeated(lambda: detect_faces(seen, detector), count),
        "segment": repeated(lambda: segment(picture, points), count),
    }
    clip = [(n / RATE, frame) for n, frame in enumerate(moving(to_bytes(small), frames))]
    marks: list[tuple[float, float]] = []
    followed = follow(clip, detector, progress=lambda done: marks.append(clock()))
    found["track points"], marks = figures(marks), [clock()]
    solve(followed, head, progress=lambda done: marks.append(clock()))
    found["track fit"], found["person"] = figures(marks[1:]), figures(marks[:2])
    parts = found["track points"], found["track fit"]
    found["track"] = {name: round(sum(part[name] for part in parts), 2) for name in parts[0]}
    return found


def sized(picture: np.ndarray, side: int) -> np.ndarray:
    """A picture [H, W, 3] float32 with a longer side of so many pixels."""
    height, width = picture.shape[:2]
    times = side / max(height, width)
    size = round(width * times), round(height * times)
    if times < 1:
        return shrink(picture, size)[0]
    return cv2.resize(picture, size, interpolation=cv2.INTER_LINEAR)
