"""Find what lies over the skin: glasses, strands of hair, and whatever darkens one side."""

import cv2
import numpy as np

from bakery import landmarks
from bakery.stages.segment import prior
from bakery.stages.segment.models import LAB_BINS, histogram

# Depth of the shallowest of the three bars in lightness, with the face's own at 60, above which they
# are frames. Bare faces of the training set reach 8.8, drawn frames 14 to 40 in 95 of 100.
BAR = 11.0
EDGE = 7.0  # the same for a single pixel of a frame
STRAND = 5.0  # and of a strand of hair
# log(red / green) around the eyes against the cheeks': bare faces reach -0.32, dark lenses -0.6.
LENS = -0.45
MIRRORED = -0.3  # the same of what clear lenses mirror
DARK = -0.8  # log of the light on what may hide the skin, against the lit part of the face
# Share of the middle of the face that something dark hides: bare faces of the training set reach
# 0.07 (very dark skin); where half of that lies on both sides, nothing could stand in.
COVERED = 0.15
BOTH_SIDES = 0.5


def find_eyewear(small, lightness, points, radius):
    """Mark frames of glasses, what their lenses mirror, and dark lenses.

    Args:
        small: [SIZE, SIZE, 3] encoded photo in the face frame; lightness: its CIE L.
        points: [478, 2] in the face frame.
        radius: [SIZE, SIZE] as from `prior.polar`.

    Returns:
        [SIZE, SIZE] bool.
    """
    found = find_glasses(lightness, points, radius)
    if found.any():
        found |= find_reflections(small, found, points, radius)
    return found | find_lenses(small, points, radius)


def find_glasses(lightness, points, radius):
    """Mark the frames of glasses.

    Rims without a frame, and clear lenses, are not seen.

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
    along = cv2.morphologyEx(smooth, cv2.MORPH_CLOSE, np.ones((1, 15), np.uint8)) - smooth
    depth = min(_bars(across, along, points))
    if depth < BAR:
        return none
    brows = points[landmarks.BROWS, 1]
    rows = np.arange(prior.SIZE)[:, None] + 0.5
    region = (rows > brows.min()) & (rows < points[195, 1] + 0.1 * prior.FACE) & (radius < 1.05)
    zone = region.copy()
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
    thin = np.maximum(across, along) > max(EDGE, 0.4 * depth)
    frames = zone & thin
    _, parts, stats, _ = cv2.connectedComponentsWithStats(frames.astype(np.uint8))
    large = stats[:, cv2.CC_STAT_AREA] > 0.004 * prior.FACE**2
    large[0] = False  # what is not frame
    frames = large[parts]
    lenses = _hulls(frames)
    wide = np.ones((15, 15), np.uint8)
    around = cv2.dilate(lenses, wide) > cv2.erode(lenses, wide)
    frames |= around & thin & region  # the upper rim may lie on a brow
    return cv2.dilate(frames.astype(np.uint8), np.ones((5, 5), np.uint8)) > 0


def find_lenses(small, points, radius):
    """Mark dark glasses: what is around both eyes is far less red than the cheeks.

    Brown lenses are not seen.

    Args:
        small: [SIZE, SIZE, 3] encoded photo in the face frame.
        points: [478, 2] in the face frame.
        radius: [SIZE, SIZE] as from `prior.polar`.

    Returns:
        [SIZE, SIZE] bool.
    """
    none = np.zeros(radius.shape, bool)
    redness = _redness(small, points, radius)
    rows = np.arange(prior.SIZE)[:, None] + 0.5
    below = points[195, 1]
    width = points[263, 0] - points[33, 0]
    for outer, inner, lid in ((33, 133, 145), (263, 362, 374)):
        left, right = sorted(points[[outer, inner], 0])
        top = points[lid, 1] + 0.03 * width
        part = redness[int(top) : int(top + 0.12 * width), int(left) : int(right)]
        if not part.size or np.median(part) > LENS:
            return none
    brows = points[landmarks.BROWS, 1].min() - 0.06 * prior.FACE
    zone = (rows > brows) & (rows < below + 0.1 * prior.FACE) & (radius < 1.05)
    lenses = _hulls(zone & (redness < 0.6 * LENS), 0.01 * prior.FACE**2)  # reflections too
    return cv2.dilate(lenses, np.ones((7, 7), np.uint8)) > 0


def find_reflections(small, frames, points, radius):
    """Mark what the lenses within frames mirror: less red and brighter than the cheeks.

    Args:
        small: [SIZE, SIZE, 3] encoded photo in the face frame.
        frames: [SIZE, SIZE] bool, from `find_glasses`.
        points: [478, 2] in the face frame.
        radius: [SIZE, SIZE] as from `prior.polar`.

    Returns:
        [SIZE, SIZE] bool; eyes and brows are left alone.
    """
    own = _hulls(frames)
    for contour in (*landmarks.EYES, landmarks.BROW_RIGHT, landmarks.BROW_LEFT):
        cv2.fillConvexPoly(own, cv2.convexHull(np.round(points[contour]).astype(np.int32)), 0)
    mirrored = (own > 0) & (_redness(small, points, radius) < MIRRORED)
    return cv2.dilate(mirrored.astype(np.uint8), np.ones((3, 3), np.uint8)) > 0


def find_occlusion(small, colors, hair, seed, radius):
    """Mark hair, or a shadow as dark as hair, that hides the skin of one side of the face.

    The other side can stand in for it. What hides both sides alike, as the shadow of a brim, is
    left alone: a face of nothing but guesses is no better.

    Args:
        small: [SIZE, SIZE, 3] encoded photo in the face frame.
        colors: [SIZE, SIZE] bins of `segment_models.lab_bins`.
        hair: [SIZE, SIZE] bool, where hair usually grows.
        seed: [SIZE, SIZE] bool, where skin usually is.
        radius: [SIZE, SIZE] as from `prior.polar`.

    Returns:
        [SIZE, SIZE] bool; the hair above the face is part of it.
    """
    none = np.zeros(radius.shape, bool)
    light = _log_light(small)[..., 1]
    if not seed.any():
        return none
    lit = light[seed] > np.percentile(light[seed], 60)
    dark = light - np.median(light[seed][lit]) < DARK
    skin = histogram(colors, (seed & ~dark).astype(np.float32), LAB_BINS)
    common = np.percentile(skin[colors][seed & ~dark], 20) + 1e-9
    own = hair * (1 - 0.95 * np.minimum(skin[colors] / common, 1))
    grown = histogram(colors, own.astype(np.float32), LAB_BINS)
    likelier = cv2.blur(np.log((grown + 3e-6) / (skin + 3e-6))[colors], (5, 5))
    occluded = (dark & (likelier > 0.5) & (radius < 1.25)) | (hair & (likelier > 0))
    occluded = cv2.morphologyEx(
        occluded.astype(np.uint8), cv2.MORPH_OPEN, np.ones((5, 5), np.uint8)
    )
    _, parts = cv2.connectedComponents(occluded, connectivity=4)
    roots = np.unique(parts[hair])
    occluded = np.isin(parts, roots[roots > 0])
    return one_side(occluded, seed)


def one_side(occluded, middle):
    """What is occluded, its holes closed, if it lies before one side of the face; else nothing.

    Args:
        occluded: [SIZE, SIZE] bool.
        middle: [SIZE, SIZE] bool, the part of the face that both sides are judged by.
    """
    inner = occluded & middle
    both = (inner & inner[:, ::-1]).sum() / max(inner.sum(), 1)
    if inner.sum() < COVERED * middle.sum() or both > BOTH_SIDES:
        return np.zeros_like(occluded)
    return cv2.morphologyEx(occluded.astype(np.uint8), cv2.MORPH_CLOSE, np.ones((15, 15))) > 0


def _hulls(mask, least=0.0):
    """[H, W] uint8, the convex hulls of the parts of a mask with more area than `least`."""
    edges, _ = cv2.findContours(mask.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    out = np.zeros(mask.shape, np.uint8)
    for edge in edges:
        if cv2.contourArea(edge) > least:
            cv2.fillConvexPoly(out, cv2.convexHull(edge), 1)
    return out


def _redness(small, points, radius):
    """log(red / green) [SIZE, SIZE] against that of the cheeks."""
    light = _log_light(small)
    redness = light[..., 0] - light[..., 1]
    rows = np.arange(prior.SIZE)[:, None] + 0.5
    cheeks = (radius < 0.72) & (rows > points[195, 1]) & (rows < points[2, 1] - 4)
    return redness - np.median(redness[cheeks]) if cheeks.any() else 0 * redness


def _log_light(small):
    """Log of the smoothed linear light [H, W, 3]."""
    return cv2.log(cv2.GaussianBlur(small, (0, 0), 1) ** 2.2 + 0.004)


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


def _bars(across, along, points):
    """Depth of the dark bar across the nose and of those under the right and the left eye."""
    width = points[263, 0] - points[33, 0]
    eye_row = points[landmarks.EYE_CORNERS, 1].mean()
    gap = points[362, 0] - points[133, 0]
    regions = [
        (points[133, 0] + gap / 4, points[362, 0] - gap / 4, eye_row - 0.22 * width, 0.34 * width),
        (points[33, 0], points[133, 0], points[145, 1] + 0.07 * width, 0.23 * width),
        (points[362, 0], points[263, 0], points[374, 1] + 0.07 * width, 0.23 * width),
    ]
    bridge = np.maximum(across, along)  # the rims beside it stand upright
    for (left, right, top, height), bars in zip(regions, (bridge, across, across)):
        part = bars[int(top) : int(top + height), int(left) : int(right)]
        yield float(np.percentile(part.max(0), 30)) if part.size else 0.0
