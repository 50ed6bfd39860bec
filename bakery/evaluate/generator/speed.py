"""How long the generator's network takes for one avatar, against a plain image-to-image U-Net."""

import tempfile
import time
from collections import Counter
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path

import numpy as np

from bakery.bake import pipeline
from bakery.generators.pagan import PaganGenerator
from bakery.generators.plain import seconds_of_plain_unet
from bakery.generators.unet import INPUTS
from bakery.parallel import side_by_side
from bakery.plugins import plug_in

FRAME = (512, 512)  # height, width


def stages(photo, head, generator):
    """Wall-clock seconds of each step of one bake, in its order, once the models were read.

    Args:
        photo: path; head, generator: their names.

    Returns:
        {step or kind of texture: seconds, "all": seconds}; how many textures were painted; and the
        pictures that the network was given for them, {(height, width): count}, empty for a generator
        that is no PaganGenerator.
    """
    marks, given = [], []
    with tempfile.TemporaryDirectory() as folder, _noted(generator, given):
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
    textures = sum(name in ("key", "gaze", "mouth") for name, _ in marks)
    return (
        {name: round(seconds, 2) for name, seconds in out.items()},
        textures,
        dict(Counter(given)),
    )


@contextmanager
def _noted(name, given):
    """Append the size of every picture that the network of a generator paints to a list."""
    generator = plug_in("generators", name)  # the one that a bake will use
    if not isinstance(generator, PaganGenerator):
        yield
        return
    paint = generator.paint

    def noting(channels):
        given.append(channels["deformed"].shape[:2])
        return paint(channels)

    generator.paint = noting
    try:
        yield
    finally:
        del generator.paint


def measure(generator: PaganGenerator, textures, pictures):
    """Seconds of the network's share of one avatar.

    Wall clock, pictures side by side on all cores as in a bake; "processor" is what all cores
    together spent. The plain network of paGAN sees every texture as one frame, split between all
    cores; it is timed on a few and multiplied.

    Args:
        textures, pictures: of a bake (`stages`).

    Returns:
        dict of seconds, the first picture of each size left out.
    """
    out, spent = {}, 0.0
    for size, count in pictures.items():
        channels = {name: np.full((*size, n), 100, np.uint8) for name, n in INPUTS.items()}
        generator.paint(channels)
        start, before = time.perf_counter(), time.process_time()
        for _ in side_by_side(lambda _, channels=channels: generator.paint(channels), range(count)):
            pass
        name = f"{count} of {size[1]}x{size[0]}"
        out[name] = round(time.perf_counter() - start, 3)
        spent += time.process_time() - before
    out["all"] = round(sum(out.values()), 3)
    out["processor"] = round(spent, 3)
    out["plain_unet"] = round(seconds_of_plain_unet(FRAME, textures), 1)
    out["times_faster"] = round(out["plain_unet"] / out["all"], 1)
    return out
