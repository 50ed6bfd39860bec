"""Ears, foreheads and hair of real people, by points that people placed around them.

The painted portraits tell how well an outline is drawn; whether a real ear is taken for hair, only
real ones can tell.
"""

import json
from collections.abc import Callable, Iterator
from pathlib import Path

import cv2
import numpy as np

from bakery import landmarks as marks
from bakery.detectors import portrait
from bakery.errors import InputError
from bakery.formats.image import read_photo
from bakery.formats.portraits import reference_points
from bakery.stages.segment.frame import draw_polygon

TEMPLATE = "frl189"
# Rings of the template's points. An ear: along the head from its top to its bottom, then its rim.
EARS = (
    (109, 185, 110, 186, 111, 119, 118, 117, 116, 115),
    (112, 187, 113, 188, 114, 124, 123, 122, 121, 120),
)
HAIRLINE = range(134, 145)  # from ear to ear
TEMPLES = range(136, 143)  # the part of it above the forehead
CROWN = range(148, 155)  # outline of the head, from temple to temple
INSIDE = 0.03  # of the eye distance: how far inside of an area it is looked at


def placed(
    portraits: Path, classes: Callable[[np.ndarray, np.ndarray], np.ndarray], sets="london/val"
) -> Iterator[dict]:
    """How much of the areas that people drew around has the class that belongs there.

    Hair over ears, and bald heads, are in it: what counts is the comparison of two ways to label.

    Args:
        portraits: folder with dense478.npz, landmarks.json and the photos.
        classes: (image [H, W, 3] uint8 sRGB, points [478, 2]) to [H, W] into portrait.CLASSES.
        sets: how the names of the photos begin.

    Yields:
        {"photo", "ears": share of both that is bare, "forehead": share of what lies between brows
        and hairline that is bare, "hair": share called hair between hairline and crown}.

    Raises:
        InputError: a file is missing or names no such photo.
    """
    path = Path(portraits) / "landmarks.json"
    if not path.is_file():
        raise InputError(f"{path}: not found; give the folder of portraits that has it")
    drawn = json.loads(path.read_text())["images"]
    for photo, points in reference_points(portraits, sets, "neutral").items():
        template, flat = drawn.get(photo.relative_to(portraits).as_posix(), (None, None))
        if template != TEMPLATE:
            continue
        image = np.round(read_photo(photo).encoded * 255).astype(np.uint8)
        ring = np.reshape(flat, (-1, 2)).astype(float)
        label = classes(image, points)
        reach = INSIDE * marks.face_size(points)
        bare = np.isin(label, portrait.BODY)
        brows = points[[*marks.BROW_RIGHT, *marks.BROW_LEFT]]
        brows = brows[np.argsort(brows[:, 0])]
        yield {"photo": photo.stem} | {
            name: round(float(where[_within(label.shape, rings, reach)].mean()), 4)
            for name, where, rings in (
                ("ears", bare, [ring[list(ear)] for ear in EARS]),
                ("forehead", bare, [np.concatenate([ring[list(TEMPLES)], brows[::-1]])]),
                ("hair", label == portrait.HAIR, [ring[[*TEMPLES, *reversed(CROWN)]]]),
            )
        }


def _within(shape, rings, reach):
    """[H, W] bool inside of rings of points, `reach` pixels from their edge."""
    out = np.zeros(shape, np.uint8)
    for ring in rings:
        draw_polygon(out, ring, 1)
    return cv2.distanceTransform(out, cv2.DIST_L2, 5) > reach


def summary(rows: list[dict]) -> dict:
    """Mean and worst of each area, of what `placed` gave."""
    return {"people": len(rows)} | {
        f"{name}{end}": round(float(of([row[name] for row in rows])), 4)
        for name in ("ears", "forehead", "hair")
        for end, of in (("", np.mean), ("_worst", np.min))
    }
