"""Lid skin as it is when the eye is shut: without the lashes that covered it (PITFALLS 7)."""

import cv2
import numpy as np

from bakery.generators.lids import LidSkin
from bakery.geometry.fill import diffuse, smoothstep
from bakery.geometry.masks import disk
from bakery.geometry.noise import value_noise
from bakery.landmarks import LIDS_LOWER, LIDS_UPPER

# Rings of points around the lids from the outer to the inner corner, left eye first: the first and
# the second above the upper margin, the second below the lower one.
FOLD = (
    (359, 467, 260, 259, 257, 258, 286, 414, 463),
    (130, 247, 30, 29, 27, 28, 56, 190, 243),
)
ABOVE = (
    (446, 342, 445, 444, 443, 442, 441, 413, 464),
    (226, 113, 225, 224, 223, 222, 221, 189, 244),
)
BELOW = (
    (446, 261, 448, 449, 450, 451, 452, 453, 464),
    (226, 31, 228, 229, 230, 231, 232, 233, 244),
)
TEXELS = 1024  # at most; a lid is about 60 of them high
GRAIN = 0.02  # log-luminance of the fine noise that keeps filled skin from looking flat
DARKEST = 0.8  # of the skin around, as dark as a bare lid may be
LASHES = 0.15  # what the row of lashes leaves of the light


def lid_skin(head, neutral, texture, atlas):
    """Paint both upper lids without lashes, and the row of lashes on their margin.

    Args:
        neutral: [V, 3] mm.
        texture: [T, T, 3] float32 linear, T_0.
        atlas: Atlas of the same size.

    Returns:
        LidSkin.
    """
    size = min(texture.shape[0], TEXELS)
    small = cv2.resize(texture, (size, size), interpolation=cv2.INTER_AREA)
    places = head.landmark_uv() * size
    masks, unknown = [], np.zeros((size, size), np.float32)
    line = np.ones((size, size), np.uint8)
    for eye in range(2):
        top = 0.45 * places[list(FOLD[eye])] + 0.55 * places[list(ABOVE[eye])]
        margin, lower = places[LIDS_UPPER[eye]], places[LIDS_LOWER[eye]]
        masks.append(_polygon(margin, top, size))
        unknown = np.maximum(unknown, masks[-1])
        unknown = np.maximum(unknown, _polygon(margin, lower, size))
        unknown = np.maximum(unknown, _polygon(lower, places[list(BELOW[eye])], size))
        cv2.polylines(line, [np.round(margin * 16).astype(np.int32)], False, 0, shift=4)
    known = 1 - cv2.dilate(unknown, np.ones((size // 200 | 1, size // 200 | 1), np.uint8))
    known *= cv2.resize((atlas.paint(atlas.rows("skin").astype(np.float32))), (size, size))
    color = diffuse(small, known)
    # A closing takes the thin dark lashes and leaves the shading of the fold; what stays much darker
    # than the skin around was make-up or a whole row of lashes.
    thin = disk((size // 90 | 1) / 2)
    lid = np.maximum(*(cv2.GaussianBlur(m, (0, 0), 1) for m in masks))[..., None]
    bare = cv2.morphologyEx(small * lid + color * (1 - lid), cv2.MORPH_CLOSE, thin)
    bare = cv2.GaussianBlur(bare, (0, 0), size / 500)
    color = np.maximum(bare, DARKEST * color)
    points = cv2.resize(atlas.paint(atlas.at(neutral)), (size, size), interpolation=cv2.INTER_AREA)
    flat = points.reshape(-1, 3)
    noise = sum(value_noise(flat, length, 40 + k) for k, length in enumerate((0.5, 1.1, 2.4)))
    color = color * np.exp(GRAIN * noise.reshape(size, size))[..., None]

    # The row of lashes: short dark strokes, uneven along the margin.
    away = cv2.distanceTransform(line, cv2.DIST_L2, 3) * 1024 / size
    reach = 9.0 + 2.5 * value_noise(flat, 0.5, 50).reshape(size, size)
    lashes = smoothstep(reach, 0.3 * reach, away) * 0.9
    color = color * (1 - (1 - LASHES) * lashes)[..., None]
    soft = [cv2.GaussianBlur(mask, (0, 0), size / 250) for mask in masks]
    return LidSkin(color.astype(np.float32), np.stack(soft, -1))


def _polygon(lower, upper, size):
    """1 between two lines of texels, [size, size] float32."""
    mask = np.zeros((size, size), np.float32)
    ring = np.concatenate([lower, upper[::-1]])
    cv2.fillPoly(mask, [np.round(ring * 16).astype(np.int32)], 1, shift=4)
    return mask
