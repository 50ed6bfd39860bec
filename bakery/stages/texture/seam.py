"""Closed lips of a photo whose lips were open: the colour of lips where none was seen, and their seam.

Lips in front of teeth turn their rims away from the camera, which then are filled from the skin around
and smeared with the teeth's colour; and they do not shade each other. Rims that the photo does not show
take on the colour of the lip beside them. How dark closed lips get toward their seam was measured in the
62 neutral photos of london/train (docs/log-rest.md): lips that are brighter are taken down to it.
"""

import cv2
import numpy as np

from bakery import landmarks as marks
from bakery.geometry.color import LUMA
from bakery.geometry.curve import nearest_on
from bakery.geometry.fill import smoothstep
from bakery.heads.base import HeadModel
from bakery.stages.atlas import Atlas
from bakery.stages.fit.lips import CLOSED, LOWER, OPEN, UPPER, mouth_axes
from bakery.stages.fit.warp import opened

RINGS = (  # of each lip, the rim at the opening and the border to the skin
    (marks.LIPS_INNER_UPPER, marks.LIPS_OUTER_UPPER),
    (marks.LIPS_INNER_LOWER, marks.LIPS_OUTER_LOWER),
)
NEAR = 12.0  # mm around the lips in which texels are looked at
LIP = (0.7, 1.0)  # of the way from rim to border; there a lip fades into skin
END = 0.05  # of the mouth's width, over which what is done fades at both corners
BODY = (0.15, 0.85)  # of the same, whose colour counts
SEEN = (0.3, 0.7)  # facing from which a texel begins to count as seen, and from which in full
INSIDE = -0.3  # sine of the angle behind its rim, below which a point lies inside the mouth
DEEP = 3.0  # mm that skin reaches into the mouth
THIN = 1.0  # mm, the least height of a lip, as at its ends
COLUMNS, FEW = 24, 6  # along the mouth, in which colours are told apart; texels that tell one
SMOOTH = 1.5  # columns, standard deviation over which their colours are smoothed
# Logarithm of luminance at the seam over that of the lip's body, and mm over which it fades; on the
# upper lip it is more toward the corners, which begin so far from the middle, in mouth widths.
DEPTH_LOWER, FADE_LOWER = 0.8, 1.35
DEPTH_UPPER, FADE_UPPER, DEPTH_CORNER, CORNER = 0.45, 2.0, 0.4, (0.36, 0.48)
SOFT = 0.15  # log ratio over which a texel counts as brighter
# The same by which it is darker than a closed lip: not yet, and wholly what lies behind a gap beside a corner.
BEHIND = 0.35, 0.8
BESIDE = 0.15, 0.28  # of the mouth's width off its middle, from which such gaps are looked for
DARKEST = 0.3  # log by which a lip's own colour may be darker than its median along the mouth
DARK = 1e-4  # linear


def openness(points: np.ndarray) -> np.ndarray:
    """How open the lips are [9] 0..1, column by column from right to left, of points [L, 2] pixels."""
    _, down, width = mouth_axes(points)
    gap = (points[LOWER] - points[UPPER]) @ down / max(width, 1e-9)
    return np.interp(gap, (CLOSED, OPEN), (0.0, 1.0))


def closed_lips(
    colors: np.ndarray,
    facing: np.ndarray,
    head: HeadModel,
    neutral: np.ndarray,
    on_skin: Atlas,
    points: np.ndarray,
) -> np.ndarray:
    """Colours [N, 3] linear of the skin's texels, with lips as they are when they are closed.

    Args:
        colors: [N, 3] linear, of the photo; facing: [N] 0..1, how well it shows them.
        head: HeadModel; neutral: [V, 3] mm, at rest.
        on_skin: the head's skin, N texels.
        points: [L, 2] pixels, landmarks of the photo; lips that are closed there are left alone.
    """
    share = openness(points)
    if not share.any():
        return colors
    at_rest, apart = head.landmarks(neutral), opened(head)
    wide = head.landmarks(apart)
    places = on_skin.at(apart)
    ring = wide[marks.LIPS_OUTER]
    near = np.flatnonzero(((places > ring.min(0) - NEAR) & (places < ring.max(0) + NEAR)).all(1))
    places, resting = places[near], on_skin.at(neutral)[near]
    ways = [_way(places, wide[rim], wide[border]) for rim, border in RINGS]
    upper = ways[0][1] <= ways[1][1]
    line = at_rest[marks.LIPS_INNER_LOWER]
    seam, _ = nearest_on(resting, line)
    along = np.clip((resting[:, 0] - line[0, 0]) / (line[-1, 0] - line[0, 0]), 0, 1)
    from_seam = np.linalg.norm(resting - seam, axis=1)
    hidden = upper & (resting[:, 1] < seam[:, 1])  # by the lower lip
    from_seam = np.where(hidden, 0, from_seam)
    wanted_share = np.interp(along, np.linspace(0, 1, len(share) + 2)[1:-1], share)
    ends = smoothstep(0, END, np.minimum(along, 1 - along))
    wanted_share = wanted_share * ends
    beside = ends * smoothstep(*BESIDE, np.abs(along - 0.5))
    out = colors.copy()
    for number, (way, _) in enumerate(ways):
        rows = np.flatnonzero((upper if number == 0 else ~upper) & (way < LIP[1]))
        here, seen = colors[near[rows]], smoothstep(*SEEN, facing[near[rows]])
        body = _body(
            here, along[rows], (seen > 0.5) & (way[rows] > BODY[0]) & (way[rows] < BODY[1])
        )
        if body is None:
            continue
        fall = _fall(number == 0, along[rows], np.where(way[rows] < 0, 0, from_seam[rows]))
        wanted = body * np.exp(fall)[:, None]
        above = np.log(np.maximum(here @ LUMA, DARK) / np.maximum(wanted @ LUMA, DARK))
        brighter = smoothstep(0, SOFT, above) * -np.expm1(fall) / -np.expm1(fall.min())
        weight = wanted_share[rows] * np.maximum(1 - seen, brighter)
        behind = beside[rows] * smoothstep(*BEHIND, -above)
        weight = np.maximum(weight, behind) * smoothstep(LIP[1], LIP[0], way[rows])
        out[near[rows]] = here + weight[:, None] * (wanted - here)
    return out


def _way(places, rim, border):
    """How far [N] places lie on the way from a lip's rim (0) to its border (1), negative inside the
    mouth, and their distance [N] mm from the lip's rim."""
    begin, end = nearest_on(places, rim)[0], nearest_on(places, border)[0]
    off = places - begin
    distance = np.linalg.norm(off, axis=1)
    way = distance / np.maximum(np.linalg.norm(end - begin, axis=1), THIN)
    within = (off[:, 2] < INSIDE * distance) & (distance < DEEP)
    return np.where(within, -way, way), distance


def _fall(upper, along, distance):
    """Logarithm [N] of how much darker closed lips are, this far from the seam, than their body."""
    if not upper:
        return -DEPTH_LOWER * np.exp(-((distance / FADE_LOWER) ** 2))
    depth = DEPTH_UPPER + DEPTH_CORNER * smoothstep(*CORNER, np.abs(along - 0.5))
    return -depth * np.exp(-((distance / FADE_UPPER) ** 2))


def _body(colors, along, counts):
    """The lip's own colour [N, 3] beside each texel: the median of those that count, by column.

    None if the photo shows no such texel.
    """
    column = np.minimum((along * COLUMNS).astype(int), COLUMNS - 1)
    known = [k for k in range(COLUMNS) if (counts & (column == k)).sum() >= FEW]
    if not known:
        return None
    medians = np.array([np.median(colors[counts & (column == k)], 0) for k in known])
    centers, every = (np.array(known) + 0.5) / COLUMNS, (np.arange(COLUMNS) + 0.5) / COLUMNS
    each = np.stack([np.interp(every, centers, medians[:, c]) for c in range(3)], 1)
    light = np.maximum(each @ LUMA, DARK)
    each *= np.maximum(np.exp(-DARKEST) * np.median(light) / light, 1)[:, None]
    each = cv2.GaussianBlur(each, (1, 0), sigmaX=1, sigmaY=SMOOTH, borderType=cv2.BORDER_REPLICATE)
    return np.stack([np.interp(along, every, each[:, c]) for c in range(3)], 1)
