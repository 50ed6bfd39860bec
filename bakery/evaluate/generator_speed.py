"""How long the generator's network takes for one avatar, against a plain image-to-image U-Net."""

import time

import numpy as np

from bakery.generators.pagan import PaganGenerator
from bakery.generators.plain import seconds_of_plain_unet
from bakery.generators.unet import INPUTS

FRAME, EYES, MOUTH = (512, 512), (128, 288), (192, 192)  # height, width as the network sees them
KEYS, GAZES, MOUTHS = 6 * 3, 20, 300  # pictures of one avatar


def measure(generator: PaganGenerator):
    """Processor seconds of the network's share of one avatar: 18 frames, 20 eye strips, 300 mouths.

    Processor time of all threads, for other programs do not count in it; two cores that are free
    take about half as long.
    The plain network of paGAN sees every picture as a frame; it is timed on a few and multiplied.

    Returns:
        dict of seconds, the first picture of each size left out.
    """
    out = {}
    for name, size, count in (
        ("keys", FRAME, KEYS), ("gaze", EYES, GAZES), ("mouths", MOUTH, MOUTHS),
    ):  # fmt: skip
        layers = {plane: np.full((*size, n), 100, np.uint8) for plane, n in INPUTS.items()}
        generator.paint(layers)
        start = time.process_time()
        for _ in range(count):
            generator.paint(layers)
        out[name] = round(time.process_time() - start, 3)
    out["all"] = round(sum(out.values()), 3)
    out["plain_unet"] = round(seconds_of_plain_unet(FRAME, KEYS // 3 + GAZES + MOUTHS), 1)
    out["times_faster"] = round(out["plain_unet"] / out["all"], 1)
    return out
