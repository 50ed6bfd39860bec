"""Photographs of people in several expressions, as folders of files.

The one documented form is

    FOLDER/SUBJECT/EXPRESSION.jpg      or      FOLDER/SUBJECT_EXPRESSION.jpg

with one EXPRESSION named `neutral` for each SUBJECT; what follows a further `-` in the name tells
several photographs of one expression apart. Files of the data sets that paGAN was trained on are
known by their own names.
"""

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bakery.bake.faces import one_face
from bakery.errors import InputError
from bakery.types import Landmarks

SUFFIXES = (".jpg", ".jpeg", ".png", ".tif", ".tiff", ".bmp")
NEUTRAL = "neutral"
CFD = {"N": NEUTRAL, "A": "angry", "F": "fearful", "HC": "happy closed", "HO": "happy open"}


@dataclass(frozen=True)
class Person:
    """The photographs of one person."""

    name: str
    neutral: Path
    others: tuple[tuple[str, Path], ...]  # (expression, photo)


def name_of(path):
    """Subject and expression of a photograph by its name: (str, str), or None.

    Known are the documented form, the Chicago Face Database (CFD-WF-001-003-HO.jpg) and the
    Radboud Faces Database (Rafd090_01_Caucasian_female_happy_frontal.jpg), of whose cameras the
    frontal one and the two at 45 degrees are taken.
    """
    stem = path.stem
    if found := re.fullmatch(r"CFD-([A-Z]{2}-\d{3})-\d+-([A-Z]{1,2})", stem):
        return (found[1], CFD[found[2]]) if found[2] in CFD else None
    if found := re.fullmatch(r"Rafd(\d{3})_(\d+)_\w+?_(?:fe)?male_([a-z]+)_([a-z]+)", stem):
        if found[1] not in ("045", "090", "135"):
            return None
        plain = found[1] == "090" and found[4] == "frontal"
        return found[2], found[3] if plain else f"{found[3]} {found[4]} {found[1]}"
    if path.parent.name and stem.split("-")[0] == NEUTRAL:
        return path.parent.name, NEUTRAL
    subject, _, expression = stem.partition("_")
    if expression:
        return subject, expression if expression != f"{NEUTRAL}-1" else NEUTRAL
    return path.parent.name, stem


def people(folder):
    """The people of a folder that have a neutral and another photograph: [Person], by name.

    Raises:
        InputError: there is none.
    """
    found = {}
    for path in sorted(Path(folder).rglob("*")):
        if path.suffix.lower() in SUFFIXES and (named := name_of(path)):
            found.setdefault(named[0], []).append((named[1], path))
    out = []
    for name, photos in sorted(found.items()):
        neutral = [path for expression, path in photos if expression.split("-")[0] == NEUTRAL]
        if neutral and len(photos) > 1:
            others = tuple((e, path) for e, path in photos if path != neutral[0])
            out.append(Person(name, neutral[0], others))
    if not out:
        raise InputError(
            f"{folder}: nobody with a neutral and another photograph; name the files "
            "SUBJECT_neutral.jpg and SUBJECT_EXPRESSION.jpg"
        )
    return out


def landmarks_by(dense=None):
    """A function from a photo's path to its Landmarks.

    Args:
        dense: npz with `names` (relative paths) and `points` [n, 478, >= 2] pixels; without it,
            or for photos it does not name, the detector finds them.

    Raises:
        InputError: by the function, when there is not one face.
    """
    known = {}
    if dense is not None:
        with np.load(dense) as table:
            known = dict(zip(table["names"].tolist(), table["points"]))

    def find(path):
        parts = Path(path).resolve().parts
        ends = ("/".join(parts[-n:]) for n in range(1, min(len(parts), 5) + 1))
        points = next((known[end] for end in ends if end in known), None)
        if points is None:
            return one_face(path)[1]
        points = points[:, :2].astype(np.float64)
        box = np.concatenate([points.min(0), np.ptp(points, 0)])
        return Landmarks(box, 1.0, points, np.ones(len(points)))

    return find
