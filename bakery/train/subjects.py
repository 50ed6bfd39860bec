"""The people of a folder of portraits, fitted, as trainings want them."""

from pathlib import Path

import numpy as np

from bakery import steps
from bakery.errors import InputError
from bakery.formats.image import read_photo
from bakery.stages.fit import FitOptions, fit
from bakery.types import Landmarks

TRAINING = "london/train"  # the only photos that anything may be trained on


def albedo_subjects(portraits, head, start=TRAINING):
    """Yield (Photo, Fit, skin [H, W]) of each neutral training photo, fitted by landmarks alone.

    Args:
        portraits: folder with dense478.npz and the photos that it names.

    Raises:
        InputError: dense478.npz is missing or names no such photo.
    """
    portraits = Path(portraits)
    if not (portraits / "dense478.npz").is_file():
        raise InputError(f"{portraits}: no dense478.npz; give the folder of portraits that has it")
    with np.load(portraits / "dense478.npz") as table:
        named = {str(name): points[:, :2] for name, points in zip(table["names"], table["points"])}
    chosen = {n: p for n, p in named.items() if n.startswith(start) and "neutral" in n}
    if not chosen:
        raise InputError(f"{portraits}: dense478.npz names no neutral photo of {start}")
    for name, points in chosen.items():
        photo = read_photo(portraits / name)
        points = points.astype(np.float64)
        box = np.concatenate([points.min(0), np.ptp(points, 0)])
        face = Landmarks(box, 1.0, points, np.ones(len(points)))
        skin = steps.segment_portrait(photo, face, steps.BuildOptions()).skin
        yield photo, fit(photo, face, head, FitOptions(photometric=False)), skin
