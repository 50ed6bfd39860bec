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
RIM = 6.0  # mm around what was labelled glasses where skin was left out


def refined(segmentation: Segmentation, encoded: np.ndarray, points: np.ndarray) -> Segmentation:
    """The segmentation, with what is labelled glasses cut to what looks so.

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
    box = around(worn, MARGIN * mm)
    here = worn[box]
    found = _frames(labels[box], regions[box], encoded[box], _moved(points, box), mm)
    labels[box][here & found & (labels[box] == LENS)] = GLASSES
    clear = here & ~found
    labels[box][clear & (labels[box] == GLASSES)] = SKIN
    regions[box][clear] = SKIN
    _unwrap(skin[box], regions[box], here, mm)
    return replace(segmentation, labels=labels, regions=regions, skin=skin)


def _moved(points, box):
    """Points [L, 2] in pixels of a box of rows and columns."""
    return points[:, :2] - [box[1].start, box[0].start]


def _frames(labels, regions, encoded, points, mm):
    """Where glasses hide the face [h, w] bool, found at `SCALE`."""
    scale = min(mm, SCALE)
    size = tuple(max(int(n * scale / mm), 8) for n in labels.shape[::-1])

    def small(plane, how=cv2.INTER_NEAREST):
        return cv2.resize(np.ascontiguousarray(plane), size, interpolation=how)

    picture = np.clip(small(encoded, cv2.INTER_AREA).astype(np.float32), 0, 1)
    regions, labels = small(regions), small(labels)
    lens, brows = labels == LENS, labels == BROWS
    found = frames(
        picture, regions == GLASSES, lens, regions == SKIN, brows, points * scale / mm, scale
    )
    whole: np.ndarray = cv2.resize(found.astype(np.float32), encoded.shape[1::-1]) > 0.5
    return whole


def _unwrap(skin, regions, where, mm):
    """Let in skin [h, w] that can be unwrapped: in and around a mask, far enough from what is none.

    Args:
        where: [h, w] bool, what was labelled glasses; beside it skin was left out.
        mm: pixels a millimetre.
    """
    face = np.isin(regions, (SKIN, EYES))
    inside = cv2.distanceTransform(face.astype(np.uint8), cv2.DIST_L2, 3) / mm
    off = cv2.distanceTransform((~where).astype(np.uint8), cv2.DIST_L2, 3) / mm
    sure = smoothstep(*LENSES, inside) * ((off < RIM) & face)
    np.maximum(skin, sure.astype(np.float32), out=skin)
