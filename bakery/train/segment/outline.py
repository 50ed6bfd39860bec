"""The outline of a person before a plain backdrop, where it is sure.

Two judges look at each pixel. One models the backdrop's colour as a smooth surface over the picture,
fitted to its border, and measures how far a pixel is from it; the other is a graph cut with colour
models of its own, begun from what the first is sure of. Where both agree the answer is sure.
"""

from dataclasses import dataclass

import cv2
import numpy as np

from bakery.detectors import frames

SIDE = 480  # pixels of the longer side that it is computed at
NEAR, FAR = 3.0, 7.0  # spreads of the backdrop: below surely backdrop, above surely not
PLAIN = 6.0  # the largest spread of a plain backdrop, CIE Lab
RIM = 0.06  # largest share of unsure pixels in a sure outline, over the person's
BACKDROP, PERSON, UNSURE = 0, 1, 255


@dataclass(frozen=True)
class Outline:
    """Where the person is."""

    person: np.ndarray  # [H, W] uint8: 0 backdrop, 1 person, 255 nobody knows
    spread: float  # of the backdrop around its smooth colour, CIE Lab; small is plain
    unsure: float  # unsure pixels over the person's

    @property
    def sure(self) -> bool:
        """Whether the backdrop is plain and nearly all pixels are known."""
        return self.spread < PLAIN and self.unsure < RIM


def find_outline(image: np.ndarray, points: np.ndarray, whole: bool = True) -> Outline:
    """Cut a person from a plain backdrop.

    Args:
        image: [H, W, 3] uint8 sRGB.
        points: [478, 2+] pixels.
        whole: False where clothes may be of the backdrop's colour: all below the chin is unsure.
    """
    height, width = image.shape[:2]
    scale = SIDE / max(height, width)
    size = (round(width * scale), round(height * scale))
    small = cv2.resize(image, size, interpolation=cv2.INTER_AREA)
    frame = frames.frame_of_points(points[:, :2] * scale)
    lab = cv2.cvtColor(np.float32(small) / 255, cv2.COLOR_RGB2LAB)
    lab = cv2.GaussianBlur(lab, (0, 0), 0.8)
    y, x = np.mgrid[: size[1], : size[0]].astype(np.float32)
    x, y = (x + 0.5 - frame.center[0]) / frame.size, (y + 0.5 - frame.center[1]) / frame.size
    edge = np.minimum(x - x.min(), x.max() - x) < 0.12
    seed = (edge & (y < 0.45)) | (y - y.min() < 0.07)
    seed &= np.hypot(x, y * 0.8) > 0.62
    away, spread = _away(lab, x, y, seed)
    face = np.hypot(x, y) < 0.42
    body = (np.abs(x) < 0.3) & (y > 0.4)
    trimap = np.full(size[::-1], cv2.GC_PR_FGD, np.uint8)
    trimap[away < FAR] = cv2.GC_PR_BGD
    trimap[(away < NEAR) & ~face & ~body] = cv2.GC_BGD
    far = cv2.erode((away > 2 * FAR).astype(np.uint8), np.ones((5, 5), np.uint8)) > 0
    trimap[far | face] = cv2.GC_FGD
    cut = trimap.copy()
    cv2.setRNGSeed(0)
    cv2.grabCut(small, cut, None, np.zeros((1, 65)), np.zeros((1, 65)), 3, cv2.GC_INIT_WITH_MASK)
    cut = _whole((cut & 1).astype(np.uint8))
    by_color = _whole((cv2.GaussianBlur(away, (0, 0), 1.0) > (NEAR + FAR) / 2).astype(np.uint8))
    person = np.where(cut == by_color, cut, UNSURE).astype(np.uint8)
    person[(np.abs(x) < 0.25) & (y > 0.5)] = PERSON  # a shirt may look like the backdrop
    if not whole:
        person[y > 0.42] = BACKDROP
    unsure = float((person == UNSURE).sum() / max((person == PERSON).sum(), 1))
    if not whole:
        person[y > 0.42] = UNSURE
    person = cv2.resize(person, (width, height), interpolation=cv2.INTER_NEAREST)
    return Outline(person, spread, unsure)


def _away(lab, x, y, seed):
    """How many spreads [H, W] each pixel is from the backdrop's smooth colour, and the spread."""
    terms = np.stack([np.ones_like(x), x, y, x * x, x * y, y * y, y**3], -1)
    keep = seed.copy()
    for _ in range(4):
        weights, *_ = np.linalg.lstsq(terms[keep], lab[keep], rcond=None)
        rest = np.linalg.norm(lab - terms @ weights, axis=-1)
        spread = float(np.median(rest[keep])) if keep.any() else 99.0
        keep = seed & (rest < max(3.5 * spread, 2.0))
        if keep.sum() < 200:
            return np.full(x.shape, 0, np.float32), 99.0
    # A backdrop that differs between the borders and the middle is followed from its sure parts.
    return (rest / max(spread, 1.2)).astype(np.float32), spread


def _whole(mask):
    """The largest part of a mask [H, W] uint8 0..1 without its holes and without hairs of noise."""
    mask = cv2.morphologyEx(mask, cv2.MORPH_OPEN, np.ones((3, 3), np.uint8))
    count, parts, stats, _ = cv2.connectedComponentsWithStats(mask)
    if count < 2:
        return mask
    mask = (parts == 1 + stats[1:, cv2.CC_STAT_AREA].argmax()).astype(np.uint8)
    count, holes, stats, _ = cv2.connectedComponentsWithStats(1 - mask, connectivity=4)
    for k in range(1, count):
        left, top, wide, high, area = stats[k]
        inner = min(left, top) > 0 and left + wide < mask.shape[1] and top + high < mask.shape[0]
        if inner and area < 0.004 * mask.size:
            mask[holes == k] = 1
    return mask
