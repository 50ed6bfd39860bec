"""How fast takes are played, and whether memory stays flat."""

import os
import time
from dataclasses import dataclass

import numpy as np

from bakery.formats import video
from bakery.motion.animate import PART, AnimationPlayer


@dataclass(frozen=True)
class PlayResult:
    """One take played and encoded."""

    frames: int
    size: tuple[int, int]  # pixels
    drawn_per_second: float  # frames, drawing alone
    frames_per_second: float  # drawing and encoding, as `bakery animate` does
    processor_ms: float  # of all cores, a frame, drawing and encoding
    memory_first: float  # MiB resident after the first part
    memory_last: float  # MiB resident at the end


def resident():
    """MiB of memory that this process holds; nan where the system does not say."""
    try:
        with open("/proc/self/statm") as file:
            return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 2**20
    except OSError:
        return float("nan")


def measure(avatar, take, settings, kind=".webm", probe=90):
    """Play a take as `bakery animate` does, without keeping what it makes.

    Args:
        avatar: runtime.avatar.Avatar; take: formats.livelink.Take; settings: motion.animate.RenderSettings.
        kind: of the video that is encoded.
        probe: frames of the measurement that draws alone.

    Returns:
        PlayResult.
    """
    player = AnimationPlayer(avatar, take, settings)
    list(player.pictures(range(min(4, player.count))))  # the first frames load the compiled loops
    spread = np.linspace(0, player.count - 1, min(probe, player.count)).astype(int)
    start = time.perf_counter()
    for _ in player.pictures(spread):
        pass
    drawn = len(spread) / (time.perf_counter() - start)
    start, used, first = time.perf_counter(), time.process_time(), None
    for begin in range(0, player.count, PART):
        indices = range(begin, min(begin + PART, player.count))
        video.encode(player.pictures(indices), kind, player.rate)
        first = resident() if first is None else first
    seconds, used = time.perf_counter() - start, time.process_time() - used
    return PlayResult(
        frames=player.count,
        size=(player.camera.width, player.camera.height),
        drawn_per_second=drawn,
        frames_per_second=player.count / seconds,
        processor_ms=1000 * used / player.count,
        memory_first=first,
        memory_last=resident(),
    )
