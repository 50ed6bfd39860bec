"""Teeth of smiling photos, painted beside the true ones.

A photo that shows teeth is fitted, and its head is painted as it stands there: expression, gaze and camera
of its own fit. `hidden` paints from the photo with the mouth's interior blotted out, as the mouth
of a person who smiles with closed lips is not seen; `shown` paints from the photo as it is, which is what
a user gets who bakes it; `geometry` is the deformed neutral in the shade of the lips, from which the network
starts, teeth hidden; `placed` is the same with upper teeth where the photo shows them. Each is compared with
the photo between the lips, where all of them show the mouth.
"""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np

from bakery.bake.subject import FittedSubject
from bakery.evaluate.albedo import lab
from bakery.evaluate.avatar import CROP, polygon_mask
from bakery.evaluate.detection import lips
from bakery.evaluate.generator.motion import first_shade
from bakery.evaluate.metrics import psnr
from bakery.formats.image import read_photo, write_image
from bakery.formats.mark import MIXED
from bakery.formats.portraits import landmarks_of, reference_points
from bakery.generators.base import Generator
from bakery.generators.channels import NONE
from bakery.generators.shade import is_part
from bakery.geometry.color import LUMA, to_encoded, to_linear
from bakery.heads.base import MOUTH, HeadModel
from bakery.landmarks import LIPS_INNER
from bakery.runtime.render import GRAY
from bakery.stages.condition import shrunk
from bakery.stages.face_frame import blotted
from bakery.stages.texture.teeth import seen_teeth

OPEN = 0.08  # of the mouth's width: lips so far apart show teeth, mostly
WAYS = ("hidden", "shown", "geometry", "placed")
FIGURES = ("psnr", "gradient", "light", "distance")


def toothy(portraits: Path, name: str) -> dict[Path, np.ndarray]:
    """Photos of a set that show teeth between open lips: path -> points [478, 2]."""
    found = {}
    for path, points in reference_points(portraits, name).items():
        if lips.gap(points) > OPEN * lips.width(points) and seen_teeth(
            to_linear(read_photo(path).encoded), points
        ):
            found[path] = points
    return found


def measure(
    path: Path, points: np.ndarray, head: HeadModel, generator: Generator, pictures: Path | None
) -> dict[str, dict[str, float]]:
    """Figures of one photo by way.

    Args:
        points: [478, 2] pixels.
        pictures: folder for mouths side by side: the truth, then each way; or None.

    Returns:
        way -> `psnr` (dB), `gradient` (mean step of luma from pixel to pixel over the truth's),
        `light` (luminance of teeth over the truth's), `distance` (CIELAB, of the teeth's colour).
    """
    photo, landmarks = read_photo(path), landmarks_of(points)
    closed = replace(photo, encoded=blotted(photo.encoded, points))
    made, inside = {}, None
    for way, one in (("hidden", closed), ("shown", photo)):
        fitted = FittedSubject(path, landmarks, head, size=CROP, photo=one)
        seen = fitted.neutral
        made[way] = _encoded(generator.generate(fitted.subject, seen.conditions).image, seen)
        shaded = seen.conditions.deformed_neutral * first_shade(fitted.head, seen.conditions)
        made["geometry" if way == "hidden" else "placed"] = _encoded(shaded, seen)
        mouth = is_part(seen.channels.part, *MOUTH)
        inside = mouth if inside is None else inside & mouth
    truth, marks = seen.picture, seen.points
    inside &= polygon_mask(marks[LIPS_INNER])
    if pictures is not None:
        low, high = marks[LIPS_INNER].min(0), marks[LIPS_INNER].max(0)
        middle, side = (low + high) / 2, 0.8 * (high[0] - low[0])
        cut = np.float32([[1, 0, side - middle[0]], [0, 1, 0.6 * side - middle[1]]]) * 224 / side
        row = [
            cv2.warpAffine(np.float32(one), cut, (448, 270), flags=cv2.INTER_CUBIC)
            for one in (truth, *(made[way] for way in WAYS))
        ]
        write_image(Path(pictures) / f"{path.stem}.png", np.clip(np.hstack(row), 0, 1), mark=MIXED)
    return {way: _figures(made[way], truth, marks, inside) for way in WAYS}


def _encoded(linear, seen):
    """A picture of the conditions as an sRGB-encoded one of the frame, gray where no head is."""
    shown = np.where((seen.conditions.part != NONE)[..., None], linear, GRAY)
    return shrunk(to_encoded(np.clip(shown, 0, 1)), seen.camera)


def _figures(made, truth, points, inside):
    steps = [_steps(picture, inside) for picture in (made, truth)]
    found = [seen_teeth(to_linear(picture), points) for picture in (made, truth)]
    out = {"psnr": psnr(made, truth, inside), "gradient": steps[0] / max(steps[1], 1e-6)}
    if all(found):
        own, true = (teeth.color for teeth in found)
        out["light"] = float(own @ LUMA / (true @ LUMA))
        out["distance"] = float(np.linalg.norm(lab(own) - lab(true)))
    return out


def _steps(picture, inside):
    luma = np.asarray(picture, np.float32) @ LUMA
    there = cv2.erode(inside.astype(np.uint8), np.ones((3, 3), np.uint8)) > 0
    return float(np.hypot(cv2.Sobel(luma, -1, 1, 0), cv2.Sobel(luma, -1, 0, 1))[there].mean())


def spread(photos: Sequence[Path], count: int | None) -> list[Path]:
    """So many photos, evenly over all; all without a count."""
    if count is None or count >= len(photos):
        return list(photos)
    return [photos[k] for k in np.linspace(0, len(photos) - 1, count).round().astype(int)]


def summary(rows: Sequence[dict[str, dict[str, float]]]) -> dict[str, dict[str, float]]:
    """Means over photos of what `measure` found."""
    return {
        way: {
            name: round(float(np.mean([row[way][name] for row in rows if name in row[way]])), 3)
            for name in FIGURES
            if any(name in row[way] for row in rows)
        }
        for way in WAYS
    }
