"""How well a fitted head's outline lies on its own photo: ears, neck, the side of the face, the whole head.

The truth is what `stages.segment` sees in the photo, at its own resolution; what hair, clothes or things
hide is left out where it says so. Every figure is given without and with `Fit.outline`.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np

from bakery.bake.fitting import fit_portrait, fitted_neutral
from bakery.formats.image import read_photo
from bakery.formats.portraits import landmarks_of, reference_points
from bakery.geometry import camera as cameras
from bakery.geometry.raster import rasterize
from bakery.geometry.sample import interpolate
from bakery.heads.base import HeadModel
from bakery.heads.outline import outline_basis
from bakery.landmarks import OVAL, face_size
from bakery.stages.segment import (
    BACKGROUND,
    BEARD,
    CLOTHES,
    EARS,
    HAIR,
    NECK,
    SKIN,
    Segmentation,
    window_of,
)
from bakery.types import Fit

WAYS = ("before", "after")  # without and with Fit.outline
EYES = 160.0  # pixels between the outer eye corners, as it is looked at
EYES_MM = 90.0  # what they are apart in people, nearly
BARE_EAR = 0.05  # area of a bare ear, in squares of the eyes' distance
BARE_NECK = 0.1  # area of neck below the jaw, the same
CROPPED = 0.8  # area of hair outside the face contour, the same; more hides the skull
BARE = (SKIN, NECK, BEARD, EARS)


def measure(
    head: HeadModel, fit: Fit, segmentation: Segmentation, points: np.ndarray, picture: np.ndarray
) -> dict[str, dict[str, float]]:
    """Figures of one fit: way -> name -> value; what the photo does not show is missing.

    `ears`: IoU of the ears, if both are bare; `neck`: of what is bare or drawn below the ears
    outside the face contour, but for hair and clothes; `head`: of head and hair above the chin
    outside the face contour; `skull`: the same if hair is cropped; `side_mm`: median distance of the
    drawn outline, from the ears down, to the photo's where that lies before background.

    Args:
        points: [L, 2] pixels, landmarks; picture: [H, W, 3] that was labelled.
    """
    scale = EYES / float(face_size(points))
    _, (rows, columns) = window_of(picture, points)
    corner = np.array([columns.start, rows.start])
    size = np.ceil(
        np.array([np.ptp([columns.start, columns.stop]), np.ptp([rows.start, rows.stop])])
    )
    size = (size * scale).astype(int)
    labels = cv2.resize(
        segmentation.labels[rows, columns], tuple(size), interpolation=cv2.INTER_NEAREST
    )
    camera = cameras.crop(fit.camera, *corner, *size, scale)
    seen = (points - corner) * scale
    out = {}
    for way in WAYS:
        drawn = fit if way == "after" else replace(fit, outline=np.zeros(0))
        out[way] = _figures(labels, seen, *_drawn(head, drawn, camera))
    return out


def _drawn(head, fit, camera):
    """Where the head is drawn [H, W], and its ears [H, W, 2], left and right."""
    shape = head.vertices(fitted_neutral(head, fit), fit.expression, fit.gaze)
    inside = cameras.to_camera(shape.astype(np.float64), camera)
    pixels = cameras.project_camera(inside, camera)
    seen = rasterize(pixels, -inside[:, 2], head.faces, (camera.height, camera.width))
    share = np.column_stack([outline_basis(head).ear, head.mean[:, 0]])
    ear, across = np.moveaxis(interpolate(seen, share[head.faces].astype(np.float32)), -1, 0)
    there = seen.face >= 0
    ear = there & (ear > 0.5)
    return there, np.stack([ear & (across > 0), ear & (across < 0)], -1)


def _figures(labels, points, drawn, ears):
    area = float(face_size(points)) ** 2
    rows, columns = np.indices(labels.shape)
    contour = np.zeros(labels.shape, np.uint8)
    cv2.fillPoly(contour, [np.round(points[OVAL]).astype(np.int32)], 1)
    beside, chin = contour == 0, points[152, 1]
    known = ~np.isin(labels, (HAIR, CLOTHES))
    out = {}
    bare = [
        (labels == EARS) & (np.sign(columns - points[6, 0]) == np.sign(points[k, 0] - points[6, 0]))
        for k in (454, 234)
    ]
    if min(one.sum() for one in bare) > BARE_EAR * area:
        out["ears"] = np.mean([_overlap(one, ears[..., k] & known) for k, one in enumerate(bare)])
    low = beside & (rows > points[[58, 288], 1].mean()) & known
    neck = np.isin(labels, BARE)
    if ((labels == NECK) & low).sum() > BARE_NECK * area:
        last = rows[(labels == NECK) & low].max(initial=0)
        out["neck"] = _overlap(neck & low & (rows <= last), drawn & low & (rows <= last))
    whole = (labels != BACKGROUND) & (labels != CLOTHES)
    high = beside & (rows < chin) & (labels != CLOTHES)
    out["head"] = _overlap(whole & high, drawn & high)
    if ((labels == HAIR) & beside).sum() < CROPPED * area:
        out["skull"] = out["head"]
    apart = _apart(labels, drawn, (rows > points[[93, 323], 1].mean()) & (rows < chin + 0.3 * EYES))
    if apart is not None:
        out["side_mm"] = apart * EYES_MM / EYES
    return {name: float(value) for name, value in out.items()}


def _apart(labels, drawn, where):
    """Median of the pixels from the photo's outline of bare skin before background to the drawn one."""
    grown = cv2.dilate((labels == BACKGROUND).astype(np.uint8), np.ones((3, 3))) > 0
    edge = np.isin(labels, (SKIN, NECK, BEARD)) & grown & where
    edge[[0, -1]] = edge[:, [0, -1]] = False
    if edge.sum() < 0.3 * EYES:
        return None
    rim = drawn & (cv2.erode(drawn.astype(np.uint8), np.ones((3, 3))) == 0)
    away = cv2.distanceTransform((~rim).astype(np.uint8), cv2.DIST_L2, 5)
    return np.median(away[edge])  # a bit of cloth taken for skin is no outline


def _overlap(one, other):
    return (one & other).sum() / max((one | other).sum(), 1)


def everybody(
    portraits: Path, head: HeadModel, starts: str | Sequence[str], part: str = ""
) -> Iterator[dict]:
    """Rows {"photo", way: figures} of the photos of a folder with reference points.

    Args:
        portraits, starts, part: see `portraits.reference_points`.
    """
    for path, points in reference_points(portraits, starts, part).items():
        photo, landmarks = read_photo(path), landmarks_of(points)
        fit, segmentation = fit_portrait(path, photo, landmarks, head)
        found = measure(head, fit, segmentation, landmarks.points, photo.encoded)
        yield {"photo": str(path.relative_to(portraits))} | found


def summary(rows: Sequence[dict]) -> dict:
    """Means of the figures, and how many photos have them: {name: {before, after, photos}}."""
    out = {}
    for name in ("ears", "neck", "head", "skull", "side_mm"):
        have = [row for row in rows if all(name in row[way] for way in WAYS)]
        if have:
            means = {
                way: round(float(np.mean([row[way][name] for row in have])), 3) for way in WAYS
            }
            out[name] = means | {"photos": len(have)}
    return out
