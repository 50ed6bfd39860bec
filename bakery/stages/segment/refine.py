"""Labels of glasses mended by the photo's own colours, at a scale of millimetres."""

from dataclasses import replace

import cv2
import numpy as np

from bakery.geometry.fill import around, smoothstep
from bakery.landmarks import face_size
from bakery.stages.segment.classes import BROWS, EYES, GLASSES, LENS, SKIN, Segmentation
from bakery.stages.segment.frames import frames

EYES_APART = 90.0  # mm, `face_size` of a mean head
SCALE = 3.0  # pixels a millimetre at most
MARGIN = 20.0  # mm around the glasses that are looked at
LENSES = 0.2, 1.0  # mm from a frame: nothing of the skin beside can be unwrapped, all can
ON = 4.0  # mm beside what is labelled glasses or lens that a rim may lie
RIM = 6.0  # mm around what was labelled glasses where skin was left out


def refined(segmentation: Segmentation, encoded: np.ndarray, points: np.ndarray) -> Segmentation:
    """The segmentation, with frames followed beyond their labels, and lenses hiding but what mirrors in them.

    Args:
        segmentation: of the photo.
        encoded: [H, W, 3] float32 sRGB-encoded.
        points: [L, 2] pixels.
    """
    worn = segmentation.regions == GLASSES
    if not worn.any():
        return segmentation
    labels, regions, skin = (
        plane.copy() for plane in (segmentation.labels, segmentation.regions, segmentation.skin)
    )
    mm = face_size(points) / EYES_APART  # the photo's pixels a millimetre
    box = around(worn | (labels == LENS), MARGIN * mm)
    own = points[:, :2] - [box[1].start, box[0].start]
    _mend(labels[box], regions[box], skin[box], encoded[box], own, mm)
    shadow = segmentation.shadow
    if shadow is not None:
        shadow = np.where(regions == GLASSES, np.float32(0), shadow)
    return replace(segmentation, labels=labels, regions=regions, skin=skin, shadow=shadow)


def _mend(labels, regions, skin, encoded, points, mm):
    """Write what glasses hide, and what they do not, into planes [h, w] of a part of a photo."""
    labelled = regions == GLASSES
    lens = labels == LENS
    here = labelled | (
        _near_rims(labelled | lens, lens, mm) & (regions == SKIN) & (labels != BROWS)
    )
    found = here & _frames(labels, regions, here, encoded, points, mm)
    # Rims of the skin's colour do not stand out from it, but the network tells them.
    found |= labels == GLASSES
    labels[found & np.isin(labels, (LENS, SKIN))] = GLASSES
    regions[found] = GLASSES
    clear = here & ~found
    regions[clear] = SKIN
    _unwrap(skin, regions, labelled, here, mm)


def _near_rims(worn, lens, mm):
    """Where [h, w] rims may go on: beside glasses, but not well within a lens."""
    off, inside = (
        cv2.distanceTransform(np.uint8(mask), cv2.DIST_L2, 3) / mm for mask in (~worn, lens)
    )
    return (off < ON) & (inside < ON)


def _frames(labels, regions, worn, encoded, points, mm):
    """Where glasses hide the face [h, w] bool, found at `SCALE`."""
    scale = min(mm, SCALE)
    size = tuple(max(int(n * scale / mm), 8) for n in labels.shape[::-1])

    def small(plane, how=cv2.INTER_NEAREST):
        return cv2.resize(np.ascontiguousarray(plane), size, interpolation=how)

    picture = np.clip(small(encoded, cv2.INTER_AREA).astype(np.float32), 0, 1)
    worn = small(np.uint8(worn)) > 0
    face, labels = small(regions) == SKIN, small(labels)
    found = frames(
        picture, worn, labels == LENS, face & ~worn, labels == BROWS, points * scale / mm, scale
    )
    whole: np.ndarray = cv2.resize(found.astype(np.float32), encoded.shape[1::-1]) > 0.5
    return whole


def _unwrap(skin, regions, labelled, where, mm):
    """Let in skin [h, w] that can be unwrapped: near a mask, far enough from what is none; the rest goes.

    Args:
        labelled: [h, w] bool, what was labelled glasses; beside it skin was left out.
        where: [h, w] bool, what was looked at.
        mm: pixels a millimetre.
    """
    face = np.isin(regions, (SKIN, EYES))
    inside = cv2.distanceTransform(face.astype(np.uint8), cv2.DIST_L2, 3) / mm
    off = cv2.distanceTransform((~labelled).astype(np.uint8), cv2.DIST_L2, 3) / mm
    sure = smoothstep(*LENSES, inside).astype(np.float32)
    np.maximum(skin, sure * ((off < RIM) & face), out=skin)
    np.minimum(skin, np.where(where | (regions == GLASSES), sure, 1), out=skin)
