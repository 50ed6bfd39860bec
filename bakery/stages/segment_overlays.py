"""Find thin dark things that lie over the skin: frames of glasses and strands of hair."""

import cv2
import numpy as np

from bakery import landmarks
from bakery.stages import segment_prior as prior

# Depth of the shallowest of the three bars in lightness, with the face's own at 60, above which they
# are frames. Bare faces of the training set reach 8.8, drawn frames 14 to 40 in 95 of 100.
BAR = 11.0
EDGE = 7.0  # the same for a single pixel of a frame
STRAND = 5.0  # and of a strand of hair


def find_glasses(lightness, points, radius):
    """Mark the frames of glasses.

    Rims without a frame, and lenses, are not seen.

    Args:
        lightness: [SIZE, SIZE] float32 CIE L in the face frame.
        points: [478, 2] in the face frame.
        radius: [SIZE, SIZE] as from `prior.polar`.

    Returns:
        [SIZE, SIZE] bool.
    """
    none = np.zeros(lightness.shape, bool)
    middle = lightness[radius < 0.45]
    smooth = cv2.GaussianBlur(lightness, (0, 0), 0.7) * (60 / max(float(np.median(middle)), 35))
    across = cv2.morphologyEx(smooth, cv2.MORPH_CLOSE, np.ones((15, 1), np.uint8)) - smooth
    depth = min(_bars(across, points))
    if depth < BAR:
        return none
    along = cv2.morphologyEx(smooth, cv2.MORPH_CLOSE, np.ones((1, 15), np.uint8)) - smooth
    brows = points[landmarks.BROWS, 1]
    rows = np.arange(prior.SIZE)[:, None] + 0.5
    zone = (rows > brows.min()) & (rows < points[195, 1] + 0.1 * prior.FACE) & (radius < 1.05)
    for contour, margin in (
        (landmarks.EYE_RIGHT, 7),
        (landmarks.EYE_LEFT, 7),
        (landmarks.BROW_RIGHT, 3),
        (landmarks.BROW_LEFT, 3),
    ):  # dark without glasses
        own = np.zeros(lightness.shape, np.uint8)
        hull = cv2.convexHull(np.round(points[list(contour)]).astype(np.int32))
        cv2.fillConvexPoly(own, hull, 1)
        zone &= cv2.dilate(own, np.ones((margin, margin), np.uint8)) == 0
    frames = zone & (np.maximum(across, along) > max(EDGE, 0.4 * depth))
    _, parts, stats, _ = cv2.connectedComponentsWithStats(frames.astype(np.uint8))
    large = stats[:, cv2.CC_STAT_AREA] > 0.004 * prior.FACE**2
    large[0] = False  # what is not frame
    return cv2.dilate(large[parts].astype(np.uint8), np.ones((5, 5), np.uint8)) > 0


def find_strands(lightness, hair, points, radius):
    """Mark dark strands that run from the hair over the forehead.

    Args:
        lightness: [SIZE, SIZE] float32 CIE L in the face frame.
        hair: [SIZE, SIZE] bool.
        points: [478, 2] in the face frame.
        radius: [SIZE, SIZE] as from `prior.polar`.

    Returns:
        [SIZE, SIZE] bool, hair not included.
    """
    usual = max(float(np.median(lightness[radius < 0.45])), 45)
    depth = cv2.morphologyEx(lightness, cv2.MORPH_CLOSE, np.ones((9, 9), np.uint8)) - lightness
    brows = points[landmarks.BROWS, 1]
    above = np.arange(prior.SIZE)[:, None] + 0.5 < brows.min() - 0.04 * prior.FACE
    dark = above & (radius < 1.3) & (depth * (60 / usual) > STRAND) & ~hair
    dark = dark.astype(np.uint8)
    wide = cv2.dilate(hair.astype(np.uint8), np.ones((13, 13), np.uint8))  # roots fade
    _, parts = cv2.connectedComponents(wide | dark, connectivity=8)
    attached = np.unique(parts[hair])
    strands = dark & np.isin(parts, attached[attached > 0])
    return cv2.dilate(strands, np.ones((3, 3), np.uint8)) > 0


def _bars(across, points):
    """Depth of the dark bar across the nose and of those under the right and the left eye."""
    width = points[263, 0] - points[33, 0]
    eye_row = points[landmarks.EYE_CORNERS, 1].mean()
    gap = points[362, 0] - points[133, 0]
    regions = [
        (points[133, 0] + gap / 4, points[362, 0] - gap / 4, eye_row - 0.22 * width, 0.34 * width),
        (points[33, 0], points[133, 0], points[145, 1] + 0.07 * width, 0.23 * width),
        (points[362, 0], points[263, 0], points[374, 1] + 0.07 * width, 0.23 * width),
    ]
    for left, right, top, height in regions:
        part = across[int(top) : int(top + height), int(left) : int(right)]
        yield float(np.percentile(part.max(0), 30)) if part.size else 0.0
