"""What a bake will take: time from a short load on this host, memory from its sizes."""

import os
import time
from dataclasses import dataclass

import cv2
import numpy as np

from bakery.bake.options import BuildOptions
from bakery.parallel import MOST

# Shares of a bake, in runs of the reference load on one core (`bakery evaluate times` and the bench
# line of 2026-11: a bake of 300 mouths and 1024 texels is 33 s where the load takes 0.1 s).
START, VIEW, GAZE, MOUTH, TEXELS = 60.0, 5.5, 1.5, 1.1, 65.0
GIB_START, GIB_TEXELS = 1.35, 0.35  # the second for each 1024 x 1024 texels: 1.7, 2.8 and 7 GiB


@dataclass(frozen=True)
class Estimate:
    """What a bake will take, within a third of it."""

    seconds: float
    gibibytes: float  # of memory at its peak

    def __str__(self) -> str:
        return f"about {self.seconds:.0f} s and {self.gibibytes:.1f} GiB of memory"


def reference_seconds() -> float:
    """Seconds of a fixed load on one core: three blurs of a picture of floats, the fastest of three."""
    picture = np.random.default_rng(0).random((1024, 1024, 3), np.float32)
    times = []
    for _ in range(3):
        begin = time.perf_counter()
        for sigma in (2, 4, 8):
            cv2.sepFilter2D(
                picture,
                -1,
                cv2.getGaussianKernel(8 * sigma + 1, sigma),
                cv2.getGaussianKernel(8 * sigma + 1, sigma),
            )
        times.append(time.perf_counter() - begin)
    return min(times)


def estimate(options: BuildOptions, keys: int = 6, gazes: int = 20) -> Estimate:
    """Time and memory of a bake on this host, as busy as it is now."""
    texels = (options.texture.resolution / 1024) ** 2
    pictures = (
        VIEW * keys * len(options.texture.views) + GAZE * gazes + MOUTH * options.texture.mouths
    )
    cores = min(os.cpu_count() or 1, MOST)
    runs = START + 2 * pictures / cores + TEXELS * texels
    return Estimate(runs * reference_seconds(), GIB_START + GIB_TEXELS * texels)
