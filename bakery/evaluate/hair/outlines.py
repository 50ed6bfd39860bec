"""How well hair with volume agrees with the photo that it was made from.

A plain backdrop tells the true outline of a person. The avatar's head is drawn into its own photo
with hair and without, and both silhouettes are compared with it, above the chin.
"""

import time
from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np

from bakery.bake.fitting import fit_portrait, own_head
from bakery.evaluate.hair.drawing import HALF, SHOWN, draw_hair
from bakery.formats.image import read_photo
from bakery.formats.portraits import landmarks_of, reference_points
from bakery.geometry import camera as cameras
from bakery.geometry.raster import rasterize
from bakery.hair.base import Hair
from bakery.heads.base import HeadModel
from bakery.landmarks import CHIN, OVAL
from bakery.train.segment import outline
from bakery.types import HAIR_TRIANGLES, Photo

SIDE = 640  # pixels of the longer side of the pictures that are compared


def silhouettes(
    portraits: Path,
    starts: str,
    part: str,
    head: HeadModel,
    hair: Hair,
    limit: int | None = None,
) -> Iterator[dict]:
    """The silhouettes of avatars in their own photos.

    Args:
        portraits: folder with dense478.npz.
        starts: which of its photos, as "london/val"; part: what their names hold, as "neutral".
        hair: what makes the hair.
        limit: photos to look at.

    Yields:
        {"photo", "iou": of head and hair above the chin, "outside": of what lies outside the face,
        "bare", "bare_outside": the same of the head without hair, "seconds": of CPU that the hair
        took, "triangles": of each level of detail}; photos without a sure outline are left out.
    """
    for path, points, photo, truth in plain(portraits, starts, part, limit):
        landmarks = landmarks_of(points)
        fit, segmentation = fit_portrait(path, photo, landmarks, head)
        own, neutral = own_head(head, fit)
        start = time.process_time()
        mesh = hair.mesh(photo, segmentation, fit, own, neutral)
        seconds = time.process_time() - start
        scale = min(1.0, SIDE / max(photo.encoded.shape[:2]))
        height, width = (round(length * scale) for length in photo.encoded.shape[:2])
        camera = cameras.crop(fit.camera, 0, 0, width, height, scale)
        shape = own.vertices(neutral, fit.expression, fit.gaze)
        seen = cameras.to_camera(shape, camera)
        drawn = rasterize(
            cameras.project_camera(seen, camera), -seen[:, 2],
            own.faces[own.part_faces(*SHOWN)], (height, width), cull=True,
        )  # fmt: skip
        bare = cover = np.isfinite(drawn.depth)
        if mesh is not None:
            cover = bare | (draw_hair(mesh, camera, drawn.depth)[..., 3] > HALF)
        person = cv2.resize(truth.person, (width, height), interpolation=cv2.INTER_NEAREST)
        known = person != outline.UNSURE
        known[int(points[CHIN, 1].mean() * scale) :] = False
        face = np.zeros((height, width), np.uint8)
        cv2.fillPoly(face, [np.round(points[OVAL] * scale).astype(np.int32)], 1)
        true = person == outline.PERSON
        row = {"photo": path.stem}
        for name, here in (("", cover), ("bare", bare)):
            outside = known & (face == 0)
            row[name or "iou"] = overlap(here & known, true & known)
            row["_".join(filter(None, (name, "outside")))] = overlap(here & outside, true & outside)
        levels = range(len(HAIR_TRIANGLES))
        row["seconds"] = round(seconds, 2)
        row["triangles"] = [0 if mesh is None else int(mesh.shown(level).sum()) for level in levels]
        yield row


def plain(
    portraits: Path, starts: str, part: str, limit: int | None = None
) -> Iterator[tuple[Path, np.ndarray, Photo, outline.Outline]]:
    """Photos with a plain backdrop: path, reference points [478, 2], Photo, and the sure outline.

    Args: as of `silhouettes`.
    """
    found = list(reference_points(portraits, starts, part).items())
    for path, points in found[:limit]:
        photo = read_photo(path)
        pixels = np.round(np.clip(photo.encoded, 0, 1) * 255).astype(np.uint8)
        truth = outline.find_outline(pixels, points, whole=False)
        if truth.sure:
            yield path, points, photo, truth


def overlap(one: np.ndarray, other: np.ndarray) -> float:
    """Intersection over union of two masks; 1 if both are empty."""
    union = (one | other).sum()
    return round(float((one & other).sum() / union), 4) if union else 1.0


def summary(rows: list[dict]) -> dict:
    """Means of `silhouettes`, and the worst of what matters most."""
    if not rows:
        return {"photos": 0}
    names = ("iou", "outside", "bare", "bare_outside", "seconds")
    means = {name: round(float(np.mean([row[name] for row in rows])), 4) for name in names}
    most = np.max([row["triangles"] for row in rows], axis=0).tolist()
    worst = min(rows, key=lambda row: row["iou"])
    return {"photos": len(rows)} | means | {"most_triangles": most, "worst": worst["photo"]}
