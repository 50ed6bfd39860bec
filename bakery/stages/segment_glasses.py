"""Find the frames of glasses: dark bars across the nose and under both eyes."""

import cv2
import numpy as np

from bakery.stages import segment_prior as prior

# Depth of the shallowest of the three bars in lightness, with the face's own at 60, above which they
# are frames. Bare faces of the training set reach 8.8, drawn frames 14 to 40 in 95 of 100.
BAR = 11.0
EDGE = 7.0  # the same for a single pixel of a frame


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
    smooth = cv2.GaussianBlur(lightness, (0, 0), 0.7) * (60 / max(float(np.median(middle)), 1))
    across = cv2.morphologyEx(smooth, cv2.MORPH_CLOSE, np.ones((15, 1), np.uint8)) - smooth
    if min(_bars(across, points)) < BAR:
        return none
    along = cv2.morphologyEx(smooth, cv2.MORPH_CLOSE, np.ones((1, 15), np.uint8)) - smooth
    brows = points[list(prior.RIGHT_BROW + prior.LEFT_BROW), 1]
    rows = np.arange(prior.SIZE)[:, None] + 0.5
    zone = (rows > brows.min()) & (rows < points[195, 1] + 0.1 * prior.FACE) & (radius < 1.05)
    eyes = none.astype(np.uint8)
    for contour in (prior.RIGHT_EYE, prior.LEFT_EYE):
        cv2.fillPoly(eyes, [np.round(points[list(contour)]).astype(np.int32)], 1)
    zone &= cv2.dilate(eyes, np.ones((7, 7), np.uint8)) == 0
    frames = zone & (np.maximum(across, along) > EDGE)
    return cv2.dilate(frames.astype(np.uint8), np.ones((5, 5), np.uint8)) > 0


def _bars(across, points):
    """Depth of the dark bar across the nose and of those under the right and the left eye."""
    width = points[263, 0] - points[33, 0]
    eye_row = points[[33, 263], 1].mean()
    gap = points[362, 0] - points[133, 0]
    regions = [
        (points[133, 0] + gap / 4, points[362, 0] - gap / 4, eye_row - 0.22 * width, 0.34 * width),
        (points[33, 0], points[133, 0], points[145, 1] + 0.07 * width, 0.23 * width),
        (points[362, 0], points[263, 0], points[374, 1] + 0.07 * width, 0.23 * width),
    ]
    for left, right, top, height in regions:
        part = across[int(top) : int(top + height), int(left) : int(right)]
        yield float(np.percentile(part.max(0), 30)) if part.size else 0.0
