"""Labels mended by the photo's own colours, at a scale of millimetres: hair and glasses."""

from dataclasses import dataclass, replace

import cv2
import numpy as np

from bakery.geometry.fill import around, smoothstep
from bakery.landmarks import EYES, face_size
from bakery.stages.segment.classes import (
    BACKGROUND,
    BROWS,
    CLOTHES,
    GLASSES,
    HAIR,
    LENS,
    SKIN,
    Segmentation,
)
from bakery.stages.segment.classes import EYES as EYE
from bakery.stages.segment.frames import frames
from bakery.stages.segment.scalp import bare, beside, without_cloth_colors, without_clothes

EYES_APART = 90.0  # mm, `face_size` of a mean head
HAIR_SCALE, GLASSES_SCALE = 1.6, 3.0  # pixels a millimetre at most
MARGIN = 20.0  # mm around the hair, or the glasses, that are looked at
SCALP = 1.0, 3.0  # mm from what is no skin: none of a bald top can be unwrapped, all can
LENSES = 0.2, 1.0  # the same of skin beside frames
RIM = 6.0  # mm around labelled glasses where skin was left out


def refined(segmentation: Segmentation, encoded: np.ndarray, points: np.ndarray) -> Segmentation:
    """The segmentation, with what is labelled hair and glasses cut to what looks so.

    Args:
        segmentation: of the photo.
        encoded: [H, W, 3] float32 sRGB-encoded 0..1.
        points: [L, 2] pixels.
    """
    return _with_frames(_with_scalp(segmentation, encoded, points), encoded, points)


@dataclass(frozen=True, eq=False)
class _Part:
    """The part of a photo around some label, at a smaller scale."""

    box: tuple[slice, slice]  # rows and columns in the photo
    scale: float  # pixels a millimetre
    picture: np.ndarray  # [h, w, 3]
    labels: np.ndarray  # [h, w]
    regions: np.ndarray  # [h, w]
    points: np.ndarray  # [L, 2] pixels

    def whole(self, mask: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
        """A mask [h, w] on the photo's own pixels in the box, `shape` of them: bool."""
        found: np.ndarray = cv2.resize(mask.astype(np.float32), shape[::-1]) > 0.5
        return found


def _part(segmentation, encoded, points, where, most):
    """The _Part around a mask [H, W], at `most` pixels a millimetre."""
    mm = face_size(points) / EYES_APART
    scale = min(mm, most)
    box = around(where, MARGIN * mm)
    size = tuple(max(int(n * scale / mm), 8) for n in where[box].shape[::-1])

    def small(plane, how=cv2.INTER_NEAREST):
        return cv2.resize(np.ascontiguousarray(plane[box]), size, interpolation=how)

    picture = np.clip(small(encoded, cv2.INTER_AREA).astype(np.float32), 0, 1)
    corner = np.array([box[1].start, box[0].start])
    return _Part(
        box,
        scale,
        picture,
        small(segmentation.labels),
        small(segmentation.regions),
        (points[:, :2] - corner) * scale / mm,
    )


def _with_scalp(segmentation, encoded, points):
    labelled = segmentation.regions == HAIR
    if not labelled.any():
        return segmentation
    part = _part(segmentation, encoded, points, labelled, HAIR_SCALE)
    hair, skin, clothes, backdrop = (
        part.regions == label for label in (HAIR, SKIN, CLOTHES, BACKGROUND)
    )
    own = without_clothes(hair, clothes, part.scale)
    own = without_cloth_colors(part.picture, own, clothes, part.scale)
    level = part.points[np.concatenate([*EYES]), 1].mean()
    scalp = bare(part.picture, own, skin, backdrop, level, part.scale)
    labels, regions = segmentation.labels.copy(), segmentation.regions.copy()
    here = labelled[part.box]
    for label, found in ((CLOTHES, hair & ~own), (SKIN, scalp)):
        found = found | (beside(found) & ~hair)  # up to the border, which is finer in the photo
        found = part.whole(found, here.shape) & here
        labels[part.box][found] = regions[part.box][found] = label
    mm = face_size(points) / EYES_APART
    skin = _unwrapped(segmentation.skin, regions, here, part.box, SCALP, mm)
    return replace(segmentation, labels=labels, regions=regions, skin=skin)


def _with_frames(segmentation, encoded, points):
    labelled = segmentation.regions == GLASSES
    if not labelled.any():
        return segmentation
    part = _part(segmentation, encoded, points, labelled, GLASSES_SCALE)
    worn, skin = part.regions == GLASSES, part.regions == SKIN
    lens, brows = part.labels == LENS, part.labels == BROWS
    found = frames(part.picture, worn, lens, skin, brows, part.points, part.scale)
    labels, regions = segmentation.labels.copy(), segmentation.regions.copy()
    here = labelled[part.box]
    found = part.whole(found, here.shape)
    labels[part.box][here & found & (labels[part.box] == LENS)] = GLASSES
    clear = here & ~found
    labels[part.box][clear & (labels[part.box] == GLASSES)] = SKIN
    regions[part.box][clear] = SKIN
    mm = face_size(points) / EYES_APART
    off = cv2.distanceTransform((~here).astype(np.uint8), cv2.DIST_L2, 3) / mm
    skin = _unwrapped(segmentation.skin, regions, off < RIM, part.box, LENSES, mm)
    return replace(segmentation, labels=labels, regions=regions, skin=skin)


def _unwrapped(skin, regions, where, box, limits, mm):
    """What of the skin can be unwrapped [H, W], with what lies in a mask of a box far enough from all else.

    Args:
        limits: mm from what is no skin: none can be unwrapped, all can.
        mm: pixels a millimetre.
    """
    face = np.isin(regions[box], (SKIN, EYE))
    inside = cv2.distanceTransform(face.astype(np.uint8), cv2.DIST_L2, 3) / mm
    sure = smoothstep(*limits, inside) * (where & face)
    out = skin.copy()
    out[box] = np.maximum(out[box], sure.astype(np.float32))
    return out
