"""The lines beside nose and mouth of a smile, filled: a person's own, beyond what smiles do on average.

A fold that a smile cuts is a dark valley in the texture, narrower than what else is dark there. It is
filled to the darker of its two sides (a morphological closing of the logarithm of colour), from the wing
of the nose past the corner of the mouth, as far as the mouth moved. Bright specks at the corners are the
opposite, and are taken off by an opening.

References:
    Batool and Chellappa, "Detection and inpainting of facial wrinkles using texture orientation
    fields and Markov random field modeling", IEEE TIP 2014: folds found, and filled from beside them.
"""

import cv2
import numpy as np

from bakery import landmarks as marks
from bakery.geometry.curve import nearest_on
from bakery.geometry.fill import normalized_blur, smoothstep
from bakery.geometry.masks import disk
from bakery.heads.base import HeadModel
from bakery.stages.atlas import Atlas, texel_size, uv_polygon

# From beside the wing of the nose past the corner of the mouth, the subject's right and left.
LINES = np.array([[203, 206, 216, 212, 202], [423, 426, 436, 432, 422]])
WINGS = np.array([129, 98, 49, 64, 358, 327, 279, 294])  # of the nose, whose own crease stays
BESIDE, OFF_LIPS, OFF_NOSE = (13.0, 6.0), (1.0, 4.0), (3.0, 6.5)  # mm over which it fades
RADIUS = 4.0  # mm, half the width of what is filled
COARSE = 2.5  # pixels, standard deviation of a blur that needs no finer picture
SOFT = 0.5  # mm, standard deviation of the blur that keeps pores and stubble from being filled
MOST = 1.2  # of the logarithm
FOLD = (0.04, 0.12)  # log by which a place was filled: no fold, one
CUT, CUT_SOFT = 1.2, 0.15  # mm, half the width of the line at its bottom, and the blur
# Mean log that is filled of what is fine: none of a beard, a beard; and mm of the blur that tells it.
HAIRY, AMONG = (0.14, 0.09), 2.5
AT_CORNER = (9.0, 5.0)  # mm from a corner of the mouth over which specks are left, are taken off
OFF_CORNER = (0.3, 1.5)  # mm from the lips over which folds beside their corners begin to count
SPECK, GLINT = 2.0, 1.5  # mm, half the width of the largest; of the logarithm
# Pits there, which are smaller than folds, and what of them stays: a closed mouth has corners.
PIT, PIT_SOFT, DEEPEST, PIT_LEFT = 3.0, 0.2, 3.0, 0.4
# The nose's edge, from below its wing to beside its bridge, the subject's right and left: mm from it over
# which folds are left, are filled; half the width of the widest, the blur, and what of any stays, which is a wing's own crease.
EDGES = np.array([[98, 129, 49, 47], [327, 358, 279, 277]])
AT_EDGE, WING, WING_SOFT, WING_LEFT = (5.5, 2.5), 4.0, 0.3, 0.2
DARK = 2e-3  # linear


def filled(colors: np.ndarray, head: HeadModel, on_skin: Atlas, share: float) -> np.ndarray:
    """Colours [N, 3] linear of the skin's texels without the lines of a smile.

    Args:
        colors: [N, 3] linear; head: HeadModel; on_skin: its skin, N texels.
        share: 0..1, how much of them to fill.
    """
    if not share:
        return colors
    rows, weight, texel = _beside(head, on_skin)
    made = levelled(colors, on_skin, (rows, weight, texel), 1.0, RADIUS, MOST)
    # The cut at a fold's bottom is finer than the blur. It goes where a fold went, so that pores stay.
    lift = np.log(np.maximum(made[rows], DARK) / np.maximum(colors[rows], DARK)).max(1)
    weight = weight * smoothstep(*FOLD, lift)
    fine = levelled(made, on_skin, (rows, weight, texel), 1.0, CUT, MOST, CUT_SOFT)
    fine = np.log(np.maximum(fine[rows], DARK) / np.maximum(made[rows], DARK))
    # Not from a beard: where much is as fine, it is hairs.
    much, zone = np.zeros((2, len(colors)), np.float32)
    zone[rows] = weight > 0
    much[rows] = fine.max(1) * zone[rows]
    much = normalized_blur(on_skin.paint(much), on_skin.paint(zone), AMONG / texel)
    much = much.reshape(-1)[on_skin.index[rows]]
    made[rows] *= np.exp(fine * smoothstep(*HAIRY, much)[:, None])
    out = colors.copy()
    before = np.maximum(colors[rows], DARK)
    out[rows] = before * (np.maximum(made[rows], DARK) / before) ** share
    return out


def even_corners(colors: np.ndarray, head: HeadModel, on_skin: Atlas, share: float) -> np.ndarray:
    """Colours [N, 3] linear without the specks and pits at the corners of a mouth that smiled.

    There teeth, wet skin and the dark behind them are seen between the lips, which at rest are closed.

    Args:
        colors: [N, 3] linear; head: HeadModel; on_skin: its skin, N texels.
        share: 0..1, how much of them to take off.
    """
    if not share:
        return colors
    where = _corners(head, on_skin)
    dark = 1 / np.maximum(colors, DARK)
    found = levelled(dark, on_skin, where, share, SPECK, GLINT)
    dimmed: np.ndarray = np.where(found != dark, 1 / found, colors)
    return levelled(dimmed, on_skin, where, share, PIT, DEEPEST, PIT_SOFT, PIT_LEFT)


def even_wings(colors: np.ndarray, head: HeadModel, on_skin: Atlas, share: float) -> np.ndarray:
    """Colours [N, 3] linear without the upper ends of a smile's folds, dark specks beside the nose's wings.

    Args:
        colors: [N, 3] linear; head: HeadModel; on_skin: its skin, N texels.
        share: 0..1, how much of them to fill.
    """
    if not share:
        return colors
    points = head.landmarks(head.mean)
    rows, places, texel = _around(head, on_skin, points[EDGES.ravel()], AT_EDGE[0])
    away = np.minimum(*(_distance(places, points[edge]) for edge in EDGES))
    where = rows, smoothstep(*AT_EDGE, away), texel
    return levelled(colors, on_skin, where, share, WING, DEEPEST, WING_SOFT, WING_LEFT)


def levelled(
    colors: np.ndarray,
    on_skin: Atlas,
    where: tuple[np.ndarray, np.ndarray, float],
    share: float,
    radius: float,
    most: float,
    soft: float = SOFT,
    least: float = 0.0,
    known: np.ndarray | None = None,
) -> np.ndarray:
    """Colours [N, 3] whose dark places up to `radius` mm are as light as the darker of their sides.

    Args:
        where: texels that may change: rows [n] of the colours, how much they count [n], and mm a texel.
        share: 0..1, how much of the places to fill.
        most: of the logarithm that they may get lighter by.
        soft: mm, standard deviation of the blur that what is narrower is left out by.
        least: of the logarithm: of any place so much stays.
        known: [N] 0..1, 0 on what neither fills nor is filled, as beyond the skin's border; None has all.
    """
    rows, weight, texel = where
    if not len(rows):
        return colors
    y, x = np.divmod(on_skin.index[rows], on_skin.size)
    pad = 4 * round(radius / texel)
    top, left = max(int(y.min()) - pad, 0), max(int(x.min()) - pad, 0)
    window = np.s_[top : int(y.max()) + pad, left : int(x.max()) + pad]
    # Each channel by itself: what lies in a fold is redder than the skin beside it.
    light = on_skin.paint(np.log(np.maximum(colors, DARK)).astype(np.float32))[window]
    skin = np.ones(len(colors), np.float32) if known is None else known
    skin = on_skin.paint(np.repeat(skin[:, None], 3, 1))[window]
    # Wide places need no fine picture, and the disc costs the square of its width.
    whole, shrink = light.shape[1::-1], max(int(soft / texel / COARSE), 1)
    small = tuple(-(-n // shrink) for n in whole)

    def blur(picture):
        return cv2.GaussianBlur(picture, (0, 0), soft / texel / shrink)

    light, skin = (cv2.resize(p, small, interpolation=cv2.INTER_AREA) for p in (light * skin, skin))
    smooth = blur(light) / np.maximum(blur(skin), 1e-3)
    disc = disk(round(radius / texel / shrink))
    far = np.float32(99)  # what is no skin neither fills nor is filled
    raised = cv2.dilate(np.where(skin > 0, smooth, -far), disc)
    level = blur(cv2.erode(np.where(skin > 0, raised, far), disc))
    lift = cv2.resize(level - smooth, whole, interpolation=cv2.INTER_LINEAR)
    out = colors.copy()
    lift = np.clip(lift[y - top, x - left] - least, 0, most)
    out[rows] *= np.exp(share * weight[:, None] * lift)
    return out


def _beside(head, on_skin):
    """Texels that the lines may cross: their rows [n], how much they count [n], and mm a texel."""
    points = head.landmarks(head.mean)
    rows, places, texel = _around(head, on_skin, points[LINES.ravel()], BESIDE[0])
    off_lips = _distance(places, points[np.append(marks.LIPS_OUTER, marks.LIPS_OUTER[0])])
    wings = np.linalg.norm(places[:, None] - points[WINGS], axis=2).min(1)
    weight = smoothstep(*BESIDE, np.minimum(*(_distance(places, points[line]) for line in LINES)))
    weight = weight * smoothstep(*OFF_LIPS, off_lips) * smoothstep(*OFF_NOSE, wings)
    # The fold that a smile cuts at the corner points down once the corner does.
    mouth = uv_polygon(head, marks.LIPS_OUTER, 1.0, on_skin.size).reshape(-1)[on_skin.index[rows]]
    folds = _at_corner(places, points) * smoothstep(*OFF_CORNER, off_lips)
    weight = np.maximum(weight, folds * (1 - mouth))
    kept = weight > 0
    return rows[kept], weight[kept], texel


def _corners(head, on_skin):
    """The same of texels at the corners of the mouth."""
    points = head.landmarks(head.mean)
    rows, places, texel = _around(head, on_skin, points[marks.MOUTH_CORNERS], AT_CORNER[0])
    weight = _at_corner(places, points)
    kept = weight > 0
    return rows[kept], weight[kept], texel


def _distance(places, line):
    """mm [n] from places [n, 3] to a line through points [m, 3]."""
    return np.linalg.norm(places - nearest_on(places, line)[0], axis=1)


def _at_corner(places, points):
    """How near places [n, 3] mm are to a corner of the mouth, of landmarks [L, 3] mm: [n] 0..1."""
    away = np.linalg.norm(places[:, None] - points[marks.MOUTH_CORNERS], axis=2).min(1)
    return smoothstep(*AT_CORNER, away)


def _around(head, on_skin, points, reach):
    """Texels in the box of points [n, 3] and `reach` mm around: rows, places [m, 3] mm, and mm a texel."""
    places = on_skin.at(head.mean)
    low, high = points.min(0) - reach, points.max(0) + reach
    rows = np.flatnonzero(((places > low) & (places < high)).all(1))
    return rows, places[rows], texel_size(places[rows], on_skin.index[rows])
