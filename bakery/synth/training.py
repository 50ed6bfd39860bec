"""Endless random pictures with known landmarks, to train and test detectors on."""

from dataclasses import dataclass

import numpy as np

from bakery.errors import InputError
from bakery.formats.files import write_bytes
from bakery.formats.image import write_image
from bakery.formats.mark import PAINTED
from bakery.formats.record import dump
from bakery.synth.render import dress, paint
from bakery.synth.samples import truth_table
from bakery.synth.scene import random_scene
from bakery.synth.subject import random_subject


@dataclass(frozen=True)
class TrainingOptions:
    """How training pictures are painted."""

    size: int = 320  # pixels on a side
    detail: float = 1.25  # pixels a mm of the skin's map
    share: float = 0.07  # of the full number of hairs
    quality: float = 0.3  # of the shadows
    supersample: int = 2
    spread: float = 0.8  # standard deviations of the identities
    turn: float = 1.0  # scales the head's turns; 0 keeps it frontal


def random_picture(head, seed, options=TrainingOptions()):
    """One random person in one random scene.

    Args:
        head: head model.
        seed: integer or sequence of integers; the same seed gives the same picture.

    Returns:
        Picture.
    """
    rng = np.random.default_rng(seed)
    subject = random_subject(rng, head, options.spread)
    scene = random_scene(rng, options.size, options.size, options.turn)
    wardrobe = dress(head, subject, options.detail, options.share)
    return paint(wardrobe, scene, options.supersample, options.quality)


def write(head, folder, count, seed=0, options=TrainingOptions()):
    """Paint training pictures into a folder: NUMBER.jpg and NUMBER.json, the landmarks.

    Pictures are numbered on from what the folder holds, so that an interrupted run goes on.

    Args:
        head: head model.
        folder: Path; made if missing.
        count: how many pictures the folder shall hold.
        seed: integer; picture k depends on (seed, k) alone.

    Yields:
        Path of each picture once it is written.

    Raises:
        InputError: `count` is below 1.
    """
    if count < 1:
        raise InputError(f"asked for {count} pictures; needs at least 1: give -n a larger number")
    folder.mkdir(parents=True, exist_ok=True)
    for number in range(count):
        path = folder / f"{number:06d}.jpg"
        truth = path.with_suffix(".json")
        if truth.exists() and path.exists():
            continue
        picture = random_picture(head, [seed, number], options)
        write_image(path, picture.encoded, 92, PAINTED)
        write_bytes(truth, dump(truth_table(picture)))
        yield path
