"""From the face frame to the photo's own pixels."""

from dataclasses import dataclass

import cv2
import numpy as np

from bakery import landmarks
from bakery.stages.segment import kernels, prior
from bakery.stages.segment.classes import (
    CLOTHES,
    EYES,
    GLASSES,
    HAIR,
    HIDDEN,
    LIPS,
    MOUTH,
    SKIN,
    Found,
    SegmentOptions,
)
from bakery.stages.segment.frame import draw_polygon, warp_matrix
from bakery.stages.segment.models import GuidedFilter


@dataclass(frozen=True, eq=False)
class Window:
    """The part of a photo that the face frame covers; h x w pixels."""

    part: np.ndarray  # [h, w, 3] float32 sRGB-encoded
    small: np.ndarray  # [S, S, 3] the same in the face frame
    to_frame: np.ndarray  # [2, 3], pixels of the part to those of the frame
    points: np.ndarray  # [478, 2] pixels of the part

    def back(self, *planes: np.ndarray) -> np.ndarray:
        """Up to four planes [S, S] of the face frame, all of one type, on the part's pixels [h, w, n].

        Four at once take as long as two; one alone gives [h, w].
        """
        return cv2.warpAffine(
            cv2.merge(planes), warp_matrix(self.to_frame), self.part.shape[1::-1],
            flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP, borderMode=cv2.BORDER_REPLICATE,
        )  # fmt: skip

    def nearest(self, labels: np.ndarray) -> np.ndarray:
        """Labels [S, S] of the face frame on the part's pixels [h, w]."""
        return cv2.warpAffine(
            labels, warp_matrix(self.to_frame), self.part.shape[1::-1],
            flags=cv2.INTER_NEAREST | cv2.WARP_INVERSE_MAP, borderMode=cv2.BORDER_REPLICATE,
        )  # fmt: skip


def enlarge(window: Window, found: Found, options: SegmentOptions) -> tuple[np.ndarray, np.ndarray]:
    """Regions and soft skin mask at the photo's own resolution, edges refined by its pixels.

    Returns:
        regions [h, w] uint8 into REGIONS, skin [h, w] float32 0..1.
    """
    shares, part = found.shares, window.part
    guide = GuidedFilter(np.stack(cv2.split(window.small)), 2, 1e-4)
    model = window.back(*guide.coefficients(shares[SKIN]))

    solid = (shares[SKIN] > 0.5).astype(np.uint8)
    distance = cv2.distanceTransform(solid, cv2.DIST_L2, cv2.DIST_MASK_5) / prior.FACE
    rim = np.clip((distance - options.rim) / options.feather, 0, 1)
    planes = window.back(*map(in_bytes, (rim, found.face, shares[HAIR], shares[CLOTHES])))
    regions, skin = np.empty(part.shape[:2], np.uint8), np.empty(part.shape[:2], np.float32)
    kernels.settle(model, part, planes, regions, skin)
    for what, label in ((found.glasses, GLASSES), (found.hidden, HIDDEN)):
        if what.any():
            regions[window.back(in_bytes(what)) > 127] = label
    seen = (regions != HIDDEN) & (regions != GLASSES)
    return np.where(seen, with_features(regions, window.points), regions), skin


def with_features(regions: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Regions [h, w] with the polygons of eyes, lips and mouth drawn over them."""
    shown = regions.copy()
    for label, contours in (
        (EYES, (landmarks.EYE_RIGHT, landmarks.EYE_LEFT)),
        (LIPS, (landmarks.LIPS_OUTER,)),
        (MOUTH, (landmarks.LIPS_INNER,)),
    ):
        for contour in contours:
            draw_polygon(shown, points[list(contour)], label)
    return shown


def in_bytes(plane: np.ndarray) -> np.ndarray:
    """A plane 0..1, or a mask, as uint8 0..255."""
    return cv2.convertScaleAbs(plane.astype(np.float32), alpha=255)
