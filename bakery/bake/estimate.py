"""What a bake will take: its steps, time from a short load on this host, memory from its sizes."""

import os
import time
from dataclasses import dataclass

import cv2
import numpy as np

from bakery.bake.options import BuildOptions
from bakery.bake.targets import Targets, read_targets
from bakery.parallel import MOST


@dataclass(frozen=True)
class Pictures:
    """What each picture takes: of a key expression from one camera, of a gaze, of a mouth."""

    view: float
    gaze: float
    mouth: float


# All in runs of the reference load on one core, from the bakes of docs/log.md, "What a bake takes".
# Of two numbers the second is for each 1024 x 1024 texels.
DETECT, SEGMENT, FIT = 34.0, 10.0, 54.0  # the first with what is loaded for it
NEUTRAL, MASK, BUNDLE = (2.5, 95.0), (0.4, 15.0), (89.0, 37.0)
SYNTHESIS = 25.0  # of 1024 x 1024 texels; denser atlases take as long
PACKED = 0.2  # of the bundle, for each mouth
PAINTED = {"pagan": Pictures(8.5, 2.2, 1.75), "rendered": Pictures(4.5, 1.6, 0.5)}
KEY, GAZE, MOUTH = (1.75, 2.25), (0.0, 0.19), (0.0, 0.25)  # a picture's way into its texture
GIB, GIB_MOUTH = (1.05, 0.35), 0.001  # GiB at the peak; of 300 mouths 1.7, 2.8 and 7


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


def plan(
    options: BuildOptions, targets: Targets | None = None, generator: str = "pagan"
) -> dict[str, tuple[float, int]]:
    """The steps of a bake in their order, as `cli.progress` counts them.

    Args:
        options: sizes and numbers.
        targets: what is painted; None means those that ship.
        generator: its name; one that is not known here counts as the slowest that is.

    Returns:
        {step: (how long, in runs of the reference load; how often it is called)}.
    """
    targets = targets or read_targets()
    texture = options.texture
    keys, gazes = len(targets.key_names), len(targets.gaze)
    mouths = min(texture.mouths, len(targets.mouths))
    texels = (texture.resolution / 1024) ** 2
    masks = (min(options.mask.resolution, texture.resolution) / 1024) ** 2
    cores = min(os.cpu_count() or 1, MOST)
    painted = PAINTED.get(generator, PAINTED["pagan"])
    key = painted.view * len(texture.views) + _of(KEY, texels)
    gaze, mouth = painted.gaze + _of(GAZE, texels), painted.mouth + _of(MOUTH, texels)
    synthesis = SYNTHESIS * min(texels, 1.0) * (texture.complete == "synthesize")
    neutral = _of(NEUTRAL, texels) + synthesis
    bundle = _of(BUNDLE, texels) + PACKED * mouths
    return {
        "detect": (DETECT, 1),
        "segment": (SEGMENT, 1),
        "fit": (FIT, 1),
        "neutral": (neutral, 1),
        "key": (keys * key / cores, keys),
        "gaze": (gazes * gaze / cores, gazes),
        "mouth": (mouths * mouth / cores, mouths),
        "mask": (_of(MASK, masks), 1),
        "bundle": (bundle / min(cores, 2), 1),  # by two at once; the largest format bounds it
    }


def estimate(
    options: BuildOptions, targets: Targets | None = None, generator: str = "pagan"
) -> Estimate:
    """Time and memory of a bake on this host, as busy as it is now; the arguments are `plan`'s."""
    runs = sum(long for long, _ in plan(options, targets, generator).values())
    texels = (options.texture.resolution / 1024) ** 2
    memory = _of(GIB, texels) + GIB_MOUTH * options.texture.mouths
    return Estimate(runs * reference_seconds(), memory)


def _of(cost: tuple[float, float], texels: float) -> float:
    return cost[0] + cost[1] * texels
