"""How long the generator's network takes for one avatar, against a plain image-to-image U-Net."""

import tempfile
import time
from itertools import pairwise
from pathlib import Path

import numpy as np

from bakery import pipeline
from bakery.generators.pagan import PaganGenerator
from bakery.generators.plain import seconds_of_plain_unet
from bakery.generators.unet import INPUTS
from bakery.parallel import side_by_side

FRAME, EYES, MOUTH = (512, 512), (128, 288), (192, 192)  # height, width as the network sees them
KEYS, GAZES, MOUTHS = 6 * 3, 20, 300  # pictures of one avatar


def stages(photo, head, generator):
    """Wall-clock seconds of each step of one bake, in its order, once the models were read.

    Args:
        photo: path; head, generator: their names.

    Returns:
        {step or kind of texture: seconds, "all": seconds}.
    """
    marks = []
    with tempfile.TemporaryDirectory() as folder:
        output = Path(folder) / "timed.avatar"
        pipeline.build(
            pipeline.Request(Path(photo), output, head=head, generator=generator),
            lambda step, done, total: marks.append((step.split()[0], time.perf_counter())),
        )
        marks.append(("", time.perf_counter()))
    out = {}
    for (name, before), (_, after) in pairwise(marks):
        out[name] = out.get(name, 0.0) + after - before
    out["all"] = sum(out.values())
    return {name: round(seconds, 2) for name, seconds in out.items()}


def measure(generator: PaganGenerator):
    """Seconds of the network's share of one avatar: 18 frames, 20 eye strips, 300 mouths.

    Wall clock, pictures side by side on all cores as in a bake; "processor" is what all cores
    together spent. The plain network of paGAN sees every picture as a frame, split between all
    cores; it is timed on a few and multiplied.

    Returns:
        dict of seconds, the first picture of each size left out.
    """
    out, spent = {}, time.process_time()
    for name, size, count in (
        ("keys", FRAME, KEYS), ("gaze", EYES, GAZES), ("mouths", MOUTH, MOUTHS),
    ):  # fmt: skip
        layers = {plane: np.full((*size, n), 100, np.uint8) for plane, n in INPUTS.items()}
        generator.paint(layers)
        start = time.perf_counter()
        for _ in side_by_side(lambda _, layers=layers: generator.paint(layers), range(count)):
            pass
        out[name] = round(time.perf_counter() - start, 3)
    out["all"] = round(sum(out.values()), 3)
    out["processor"] = round(time.process_time() - spent, 3)
    out["plain_unet"] = round(seconds_of_plain_unet(FRAME, KEYS // 3 + GAZES + MOUTHS), 1)
    out["times_faster"] = round(out["plain_unet"] / out["all"], 1)
    return out
