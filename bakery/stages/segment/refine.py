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
    EARS,
    GLASSES,
    HAIR,
    LENS,
    REGION_OF,
    SKIN,
    Segmentation,
)
from bakery.stages.segment.classes import EYES as EYE
from bakery.stages.segment.frames import frames
from bakery.stages.segment.scalp import (
    bare,
    beside,
    ear_tops,
    without_cloth_colors,
    without_clothes,
)

EYES_APART = 90.0  # mm, `face_size` of a mean head
HAIR_SCALE, GLASSES_SCALE = 1.6, 3.0  # pixels a millimetre at most
MARGIN = 20.0  # mm around the hair, or the glasses, that are looked at
SCALP = 1.0, 3.0  # mm from what is no skin: none of a bald top can be unwrapped, all can
LENSES = 0.2, 1.0  # the same of skin beside frames
RIM = 6.0  # mm around what was labelled hair or glasses where skin was left out


def refined(segmentation: Segmentation, encoded: np.ndarray, points: np.ndarray) -> Segmentation:
    """The segmentation, with what is labelled hair and glasses cut to what looks so.

    Args:
        segmentation: of the photo.
        encoded: [H, W, 3] float32 sRGB-encoded 0..1.
        points: [L, 2] pixels.
    """
    labels, regions, skin = (
        plane.copy() for plane in (segmentation.labels, segmentation.regions, segmentation.skin)
    )
    for label, mend, most in ((HAIR, _hair, HAIR_SCALE), (GLASSES, _glasses, GLASSES_SCALE)):
        labelled = regions == label
        if labelled.any():
            part = _part(labels, regions, encoded, points, labelled, most)
            here = labelled[part.box]
            mend(part, here, labels[part.box], regions[part.box], skin[part.box])
    return replace(segmentation, labels=labels, regions=regions, skin=skin)


@dataclass(frozen=True, eq=False)
class _Part:
    """The part of a photo around some label, at a smaller scale."""

    box: tuple[slice, slice]  # rows and columns in the photo
    mm: float  # the photo's pixels a millimetre
    scale: float  # those of this part
    picture: np.ndarray  # [h, w, 3]
    labels: np.ndarray  # [h, w]
    regions: np.ndarray  # [h, w]
    points: np.ndarray  # [L, 2] pixels

    def whole(self, mask: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
        """A mask [h, w] on the photo's own pixels in the box, `shape` of them: bool."""
        found: np.ndarray = cv2.resize(mask.astype(np.float32), shape[::-1]) > 0.5
        return found


def _part(labels, regions, encoded, points, where, most):
    """The _Part around a mask [H, W], at `most` pixels a millimetre."""
    mm = face_size(points) / EYES_APART
    scale = min(mm, most)
    box = around(where, MARGIN * mm)
    size = tuple(max(int(n * scale / mm), 8) for n in where[box].shape[::-1])

    def small(plane, how=cv2.INTER_NEAREST):
        return cv2.resize(np.ascontiguousarray(plane[box]), size, interpolation=how)

    picture = np.clip(small(encoded, cv2.INTER_AREA).astype(np.float32), 0, 1)
    corner = np.array([box[1].start, box[0].start])
    own = (points[:, :2] - corner) * scale / mm
    return _Part(box, mm, scale, picture, small(labels), small(regions), own)


def _hair(part, here, labels, regions, skin):
    """Write scalp, ears and clothes into the part's planes, where `here` is labelled hair."""
    hair, face, clothes, backdrop = (
        part.regions == label for label in (HAIR, SKIN, CLOTHES, BACKGROUND)
    )
    own = without_clothes(hair, clothes, part.scale)
    own = without_cloth_colors(part.picture, own, clothes, part.scale)
    level = part.points[np.concatenate([*EYES]), 1].mean()
    scalp = bare(part.picture, own, face, backdrop, level, part.scale)
    ears = ear_tops(part.picture, own & ~scalp, part.labels == EARS, part.scale)
    for label, found in ((CLOTHES, hair & ~own), (SKIN, scalp), (EARS, ears)):
        found = found | (beside(found) & ~hair)  # up to the border, which is finer in the photo
        found = part.whole(found, here.shape) & here
        labels[found] = label
        regions[found] = REGION_OF[label]
    _unwrap(skin, regions, here & (regions == SKIN), SCALP, part.mm)


def _glasses(part, here, labels, regions, skin):
    """Write what glasses do not hide into the part's planes, where `here` is labelled so."""
    worn, face = part.regions == GLASSES, part.regions == SKIN
    lens, brows = part.labels == LENS, part.labels == BROWS
    found = frames(part.picture, worn, lens, face, brows, part.points, part.scale)
    found = part.whole(found, here.shape)
    labels[here & found & (labels == LENS)] = GLASSES
    clear = here & ~found
    labels[clear & (labels == GLASSES)] = SKIN
    regions[clear] = SKIN
    _unwrap(skin, regions, here, LENSES, part.mm)


def _unwrap(skin, regions, where, limits, mm):
    """Let in what can be unwrapped [h, w]: in and around a mask, far enough from all that is no skin.

    Args:
        where: [h, w] bool, what was no skin before; beside it skin was left out.
        limits: mm from what is no skin: none can be unwrapped, all can.
        mm: pixels a millimetre.
    """
    if not where.any():
        return
    face = np.isin(regions, (SKIN, EYE))
    inside = cv2.distanceTransform(face.astype(np.uint8), cv2.DIST_L2, 3) / mm
    off = cv2.distanceTransform((~where).astype(np.uint8), cv2.DIST_L2, 3) / mm
    sure = smoothstep(*limits, inside) * ((off < RIM) & face)
    np.maximum(skin, sure.astype(np.float32), out=skin)
