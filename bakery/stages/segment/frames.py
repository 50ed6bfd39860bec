"""Where the colours of a photo show frames of glasses: lenses and skin beside them can be seen."""

import cv2
import numpy as np

from bakery.geometry.fill import diffuse
from bakery.geometry.masks import disk, opened
from bakery.landmarks import BROW_LEFT, BROW_RIGHT, EYES

THICK = 18.0  # CIELAB distance from the skin around, of frames and of what lenses mirror
THIN = 7.0  # CIELAB, by which a line differs from both of its sides
GOES_ON = 0.6  # of that, where a line is fainter
NOISE = 3.0  # times what lines differ by on the face's skin
LIGHT = 0.7  # of a difference of lightness, beside one of hue
WIDTH = 5.0  # mm: wider than a line
SMOOTH = 0.4, 0.9  # mm over which a colour is taken; in grainy photos another time
SPECK = 2.0  # mm2: smaller spots are no frame
EDGE = 1.1  # mm around what was found, where frames shine and cast shadows
BROW = 1.15  # times a brow, within which it is
TOLD = 0.2  # of that: so much must be labelled brow to tell its colour
BROWN = 12.0  # CIELAB distance from a brow's colour, of its own hairs
LENS = 150.0  # mm2 of a lens at least
DARK_LENS = 6.0  # mm, half the width from which it is no brow
RIM = 2.0  # mm on both sides of a lens's outline
ON_RIM = 0.4  # of THIN, where a lens that has a rim has it
RIMMED = 0.6  # of the outline: with so much of a rim, there is one all around
OTHER = 0.6  # of that, where the other lens has one
LASHES = 1.25  # times an eye's opening, within which lines are its lashes


def length(vectors: np.ndarray) -> np.ndarray:
    """Lengths [H, W] of vectors [H, W, n]: a third of the time that numpy's norm takes."""
    out: np.ndarray = np.sqrt(np.einsum("ijk,ijk->ij", vectors, vectors))
    return out


def frames(
    picture: np.ndarray,
    worn: np.ndarray,
    lens: np.ndarray,
    skin: np.ndarray,
    brows: np.ndarray,
    points: np.ndarray,
    scale: float,
) -> np.ndarray:
    """Where [H, W] bool glasses hide the face, within the wider band that is labelled so.

    Args:
        picture: [H, W, 3] float32 sRGB-encoded.
        worn: [H, W] bool, the region of glasses; nothing outside is looked at.
        lens, skin, brows: [H, W] bool, so labelled.
        points: [L, 2] pixels.
        scale: pixels a millimetre.
    """
    plain = skin & ~brows
    core = cv2.erode(plain.astype(np.uint8), np.ones((3, 3), np.uint8)).astype(np.float32)
    if not core.any():
        return worn
    fine, coarse = (mm * scale for mm in SMOOTH)
    lab = _lab(picture, fine)
    off = length(lab - diffuse(lab, core))
    line, grain = _beyond_grain(lab, core > 0, scale)
    if grain > THIN:
        line = np.maximum(line, _beyond_grain(_lab(picture, coarse), core > 0, scale)[0])
    found = worn & ((off > THICK) | (line > 1))
    faint = worn & (line > GOES_ON)
    spared = _drawn(points, EYES, LASHES, worn.shape) & (off < 2 * THICK)
    for contour in (BROW_RIGHT, BROW_LEFT):
        brow = _drawn(points, (contour,), BROW, worn.shape)
        told = brow & brows if (brow & brows).sum() > TOLD * brow.sum() else brow
        if told.any():  # what is like the brow is one; a dark frame before it does not show
            like = length(lab - np.median(lab[told], 0)) < BROWN
            spared |= brow & like
    rims = _rims(lens, found, scale)
    found |= worn & rims & (line > ON_RIM)
    spared &= ~rims & ~opened(found, DARK_LENS * scale)
    found &= ~spared
    _, number = cv2.connectedComponents((found | (faint & ~spared)).astype(np.uint8))
    large = np.bincount(number[found], minlength=number.max() + 1) > SPECK * scale**2
    wide = disk(np.ceil(EDGE * scale))
    out: np.ndarray = worn & (cv2.dilate(large[number].astype(np.uint8), wide) > 0)
    return out


def _lab(picture, pixels):
    """CIELAB [H, W, 3] of a picture that is blurred by so many pixels, lightness at LIGHT of its weight."""
    lab = cv2.cvtColor(cv2.GaussianBlur(picture, (0, 0), max(pixels, 0.3)), cv2.COLOR_RGB2LAB)
    lab[..., 0] *= LIGHT
    return lab


def _beyond_grain(lab, core, scale):
    """How lines stand out [H, W]: 1 is a frame's, which none on the skin `core` is like; and what those have."""
    line = _lines(lab, WIDTH * scale)
    grain = NOISE * float(np.median(line[core]))
    return line / max(THIN, grain), grain


def _lines(lab, width):
    """By how much lines narrower than `width` pixels differ from both of their sides, [H, W]."""
    wide = disk(width / 2)
    out = np.zeros(lab.shape[:2], np.float32)
    for channel in cv2.split(lab):
        for how in (cv2.MORPH_BLACKHAT, cv2.MORPH_TOPHAT):
            out = np.maximum(out, cv2.morphologyEx(channel, how, wide))
    return out


def _rims(lens, found, scale):
    """The outlines [H, W] bool of lenses that have a rim: so much of them, or of the other, was found to be one."""
    wide = disk(np.ceil(RIM * scale))
    near = cv2.dilate(found.astype(np.uint8), wide) > 0
    whole = cv2.morphologyEx(lens.astype(np.uint8), cv2.MORPH_CLOSE, wide)
    count, number, stats, _ = cv2.connectedComponentsWithStats(whole)
    lines, shares = [], []
    for one in range(1, count):
        if stats[one, cv2.CC_STAT_AREA] < LENS * scale**2:
            continue
        own = (number == one).astype(np.uint8)
        edge = (own > 0) & (cv2.erode(own, np.ones((3, 3), np.uint8)) == 0)
        lines.append((cv2.dilate(own, wide) > 0) & (cv2.erode(own, wide) == 0))
        shares.append(near[edge].mean())
    least = RIMMED * (OTHER if max(shares, default=0) > RIMMED else 1)
    rimmed = [line for line, share in zip(lines, shares) if share > least]
    out: np.ndarray = np.any(rimmed, axis=0) if rimmed else np.zeros_like(lens)
    return out


def _drawn(points, contours, larger, shape):
    """The hulls of contours, so many times as large, [H, W] bool."""
    out = np.zeros(shape, np.uint8)
    for contour in contours:
        own = points[list(contour)]
        hull = cv2.convexHull((own + (larger - 1) * (own - own.mean(0))).astype(np.float32))
        cv2.fillConvexPoly(out, np.round(hull * 16).astype(np.int32), 1, shift=4)
    return out > 0
