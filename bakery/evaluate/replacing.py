"""A face put into footage, measured: its seam, the seam's flicker, and a person's face put into its own clip."""

import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from bakery.detectors.base import Detector
from bakery.evaluate.metrics import psnr
from bakery.export.open import open_avatar
from bakery.formats.video import Clip
from bakery.generators.transfer import load
from bakery.geometry import camera as cameras
from bakery.geometry.sample import bilinear
from bakery.heads.base import HeadModel
from bakery.motion.animate import AnimationPlayer, RenderSettings
from bakery.perform.footage import Footage
from bakery.perform.patch import Patch
from bakery.perform.performance import fitted
from bakery.perform.replace import Layers, Replacement, laid
from bakery.perform.seam import Seen, seam
from bakery.perform.transfer import TransferPlayer

ACROSS = 0.05  # eye distances from the seam, on both sides, between which a step is measured
BAND = (0.1, 0.9)  # share of the drawn face of the vertices whose flicker is measured
INSIDE = 0.5  # share above which a pixel is the drawn face's
LEAST = 0.01  # slope of the share a pixel, below which there is no seam


@dataclass(frozen=True)
class Seam:
    """Films against the footage they were put into; 1: as the footage itself."""

    step: float  # change of colour across the seam, over the footage's in the same places
    flicker: float  # change from frame to frame of what stays in its place on the face, likewise
    inside: float  # dB: PSNR of the drawn face against the footage; says something of its own face alone
    rate: float  # frames a second, tracking not counted


def film_of(
    head: HeadModel, detector: Detector, bundle: Path, clip: Path, by_transfer: bool = False
) -> Replacement:
    """The face of a bundle in a clip, as it does what the clip's own face does."""
    performed = fitted(Clip(clip), head, detector, clip.parent / "fits", overwrite=True)
    settings = RenderSettings(rate=performed.take.rate, hair=False)
    avatar, take = open_avatar(bundle), performed.take
    player = AnimationPlayer(avatar, take, settings)
    if by_transfer:
        player = TransferPlayer(avatar, take, settings, performed, head, lambda: Clip(clip), load())
    return Replacement(player, Footage(performed, head, lambda: Clip(clip), None))


def run(
    head: HeadModel, detector: Detector, seed: int, people: int, folder: Path
) -> Iterator[tuple[str, Seam]]:
    """Faces in other people's clips, and in their own, of the scenes that `performing.run` left in a folder.

    Yields:
        (name, Seam).
    """

    def scene(number):
        performer, target = seed + number % people, seed + (number + 1) % people
        return target, performer, folder / f"{performer}-{target}"

    for number in range(people):
        target, performer, here = scene(number)
        bundle = here / "portrait.avatar"
        _, _, own = scene(number + 1)
        for clip in dict.fromkeys((here, own)):
            for way in ("avatar", "transfer"):
                whose = "its own clip" if clip == own else f"the clip of {performer}"
                film = film_of(head, detector, bundle, clip / "clip.mp4", way == "transfer")
                yield f"{target} in {whose}, {way}", measure(film)


def measure(film: Replacement, every: int = 3) -> Seam:
    """Draw all frames of a Replacement and compare them with its footage.

    Args:
        every: frames from one whose step and PSNR are measured to the next.
    """
    steps, changes, insides = np.zeros(2), np.zeros(2), []
    last = None
    start = time.perf_counter()
    waiting = 0.0
    for index, layers in enumerate(film.layers(range(film.count))):
        begun, drawn, values = time.perf_counter(), layers.drawn, layers.values
        if drawn is None or values is None:
            last = None
            continue
        source, made = layers.source, layers.made
        pixels = drawn.pixels + [drawn.box[1].start, drawn.box[0].start]
        both = np.stack([np.float32(one) / 255 for one in (source, made)])
        here = values[:, 0], drawn.sight, np.stack([bilinear(one, pixels) for one in both])
        if last is not None:
            changes += _changes(last, here)
        last = here
        if index % every == 0:
            share = share_of(layers, film.patch)
            steps += step_sums(*both, share, ACROSS * eyes_of(film, layers.number))
            insides.append(psnr(both[1], both[0], share > INSIDE))
        waiting += time.perf_counter() - begun
    taken = time.perf_counter() - start - waiting
    return Seam(
        float(steps[1] / steps[0]), float(changes[1] / changes[0]), float(np.mean(insides)),
        film.count / taken,
    )  # fmt: skip


def share_of(layers: Layers, patch: Patch) -> np.ndarray:
    """How far [H, W] 0..1 each pixel of a frame shows the drawn face, which there must be."""
    assert layers.drawn is not None and layers.values is not None
    dark, bright = (
        laid(np.full_like(layers.source, level), layers.drawn, layers.values, patch)
        for level in (0, 255)
    )
    share: np.ndarray = 1 - (bright.astype(float) - dark).mean(-1) / 255
    return share


def eyes_of(film: Replacement, number: int) -> float:
    """Pixels between the outer corners of the eyes in a frame."""
    standing, _ = film.standing_of(number)
    assert standing is not None
    corners = standing.head.landmarks(standing.neutral)[[33, 263]].astype(float)
    scale = cameras.pixels_per_mm(film.stage.camera_of(number))
    return float(np.linalg.norm(corners[0] - corners[1]) * scale)


def step_sums(source: np.ndarray, made: np.ndarray, share: np.ndarray, reach: float) -> np.ndarray:
    """Sums [2 (source, made)] of the change of colour across the seam, from one side of it to the other.

    Args:
        source, made: [H, W, 3] 0..1; share: [H, W] 0..1.
        reach: pixels to each side.
    """
    down, across = np.gradient(share)
    slope = np.hypot(across, down)
    edge = (share > INSIDE) & (slope > LEAST)
    inner = cv2.erode((share > INSIDE).astype(np.uint8), np.ones((3, 3), np.uint8)) > 0
    edge &= ~inner
    rows, columns = np.nonzero(edge)
    if not len(rows):
        return np.zeros(2)
    middle = np.stack([columns, rows], 1) + 0.5
    normal = np.stack([across[edge], down[edge]], 1) / slope[edge][:, None]
    ends = [middle + side * reach * normal for side in (-1, 1)]
    found: np.ndarray = np.array([
        np.linalg.norm(bilinear(one, ends[1]) - bilinear(one, ends[0]), axis=1).sum()
        for one in (np.float32(source), np.float32(made))
    ])  # fmt: skip
    return found


def _changes(last, here):
    """Sums [2 (source, made)] of the change in time on the seam, at points that move with the face."""
    band = (last[0] > BAND[0]) & (last[0] < BAND[1]) & last[1] & here[1]
    moved: np.ndarray = np.linalg.norm(here[2] - last[2], axis=-1)[:, band].sum(1)
    return moved


def cut_seconds(patch: Patch, count: int = 60, seed: int = 0) -> float:
    """Seconds that the minimum cut of `count` frames takes, of noise: the hardest there is to cut."""
    rng = np.random.default_rng(seed)
    shape = count, len(patch.vertices)
    colors = rng.random((2, *shape, 3), np.float32)
    none = np.zeros(shape, bool)
    seen = Seen(colors[0], colors[1], ~none, np.zeros(shape, np.float32), none)
    seam(patch, Seen(*(getattr(seen, name)[:2] for name in vars(seen))))  # compiled
    start = time.perf_counter()
    seam(patch, seen)
    return time.perf_counter() - start
