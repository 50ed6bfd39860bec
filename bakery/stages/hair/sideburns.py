"""Sideburns: how far down a photo shows hair before each ear.

There the skin is seen at such a slant that a few millimetres of the fit are as much as a sideburn is wide.
So the photo is not asked at places on the head, but along lines across it: between the cheek and where the
fitted ear begins, is there any hair?
"""

import numpy as np

from bakery.geometry.fill import smoothstep
from bakery.geometry.sample import bilinear
from bakery.stages.hair.temples import HEIGHTS, Temples

# Of 157 sides of short-haired people (congress/train) those that have hair before the ear at each of
# HEIGHTS; docs/log-hair.md.
USUAL = np.array([0.05, 0.15, 0.32, 0.47, 0.66, 0.78, 0.87, 0.94, 0.96, 0.96, 0.96, 0.96])
ROW = 2.5  # mm, half the height of the strip of skin around a line
CHEEK = 0.45, 0.6  # cosines to the camera between which a line begins
BEYOND = 8.0  # mm that it goes on behind the ear's front, over which hair stands out
# mm before an ear between which skin is turned to the camera, or the photo says nothing of this side. An ear's
# own rim, nearer, may look forward where the skin does not.
BAND = 18.0, 6.0
SQUARER = (
    0.05,
    0.15,
)  # cosine there by which the other side is seen better: a little, and it tells of both
STEP = 0.5  # mm
WIDE = 1.2, 2.5  # mm of hair on it that are none, that are a sideburn


def sideburns(
    temples: Temples,
    places: np.ndarray,
    pixels: np.ndarray,
    cosine: np.ndarray,
    hair: np.ndarray,
) -> np.ndarray:
    """Whether hair grows before the (left, right) ear at HEIGHTS: [2, 12] 0..1.

    It ends where it first ends. A side that is turned away is as the other one; both, as usual.

    Args:
        temples: of the head, at those places.
        places: [n, 3] mm on the skin of its mean shape.
        pixels: [n, 2] where the photo shows them.
        cosine: [n] between the skin there and the line of sight.
        hair: [H, W] 0..1, the photo's.
    """
    heights = temples.bottom + HEIGHTS * (temples.top - temples.bottom)
    low, high = heights[[0, -1]] + [-ROW, ROW]
    across, up = temples.flat.T
    near = np.flatnonzero((across < temples.front) & (up > low) & (up < high))
    across, up, left, places, pixels, cosine = (
        each[near] for each in (across, up, temples.left, places, pixels, cosine)
    )
    cheek = (cosine > CHEEK[0]) & (cosine < CHEEK[1])
    beside = (across > temples.front - BAND[0]) & (across < temples.front - BAND[1])
    told, there, square = np.zeros((3, 2, len(heights)))
    for row, height in enumerate(heights):
        strips = [side & (np.abs(up - height) < ROW) for side in (left, ~left)]
        if not all((strip & cheek).any() for strip in strips):
            continue
        begin = [pixels[strip & cheek].mean(0) for strip in strips]
        apart = begin[0] - begin[1]
        scale = np.linalg.norm(apart) / np.linalg.norm(
            np.subtract(*(places[strip & cheek].mean(0) for strip in strips))
        )  # pixels a mm
        for k, way in enumerate((apart, -apart)):
            way = way / np.linalg.norm(way)
            reach = ((pixels[strips[k]] - begin[k]) @ way).max() / scale + BEYOND
            line = begin[k] + np.arange(0, reach, STEP)[:, None] * scale * way
            before = strips[k] & beside
            square[k, row] = np.median(cosine[before]) if before.any() else 0
            told[k, row] = square[k, row] > 0
            there[k, row] = smoothstep(*WIDE, STEP * (bilinear(hair, line) > 0.5).sum())
    told *= 1 - told[::-1] * smoothstep(*SQUARER, square[::-1] - square)
    usual = USUAL * there[:, -1].max()  # of people who have any hair above the ears
    other = told[::-1] * there[::-1] + (1 - told[::-1]) * usual
    found = told * there + (1 - told) * other
    # A single line that differs is the arm of glasses, or a mole.
    padded = np.pad(found, ((0, 0), (1, 1)), "edge")
    steady = np.median(np.lib.stride_tricks.sliding_window_view(padded, 3, 1), -1)
    down: np.ndarray = np.minimum.accumulate(steady[:, ::-1], 1)[:, ::-1]
    return down
