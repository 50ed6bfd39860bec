"""One pair of nostrils: the skin in the hollows of a head model's nose where its photo shows none.

The nose of a head model ends lower than people's (docs/log-heads.md): a photo's nostrils are painted in
front of the model's. What fills those hollows is made up, and darker than what surrounds it: a second
pair. They get the tone of the skin around.
"""

import cv2
import numpy as np

from bakery.geometry.color import LUMA
from bakery.geometry.fill import diffuse, normalized_blur, smoothstep
from bakery.geometry.masks import disk
from bakery.heads.base import HeadModel
from bakery.landmarks import NOSE_BASE
from bakery.memo import once_per_object
from bakery.stages.atlas import Atlas, make_atlas
from bakery.stages.texture.occlusion import openness

HOLLOW = (0.9, 0.75)  # openness from which skin is of a hollow, not and wholly
REACH = (13.0, 9.0)  # mm from the nose's base
RIM, SOFT = 3.0, 1.3  # mm, how far its rim goes beyond, and the blur of its border
BEYOND = (0.25, 0.03)  # share of a hollow from which on skin tells nothing of it, up to which it does
PORES = 0.5  # mm: what is finer stays
SHADE = (0.6, 0.8)  # of the brightness around: darker is the photo's own nostril, or a moustache
DARK = 1e-3  # linear


@once_per_object
def hollows(head: HeadModel, size: int) -> tuple[np.ndarray, float]:
    """Where the head's nostrils are, on an atlas of so many texels a side: [T, T] 0..1, and mm a texel."""
    atlas = make_atlas(head, size).take("skin")
    open_to, places = atlas.at(openness(head, head.mean)[:, None])[:, 0], atlas.at(head.mean)
    base = head.landmarks(head.mean)[NOSE_BASE]
    away = np.linalg.norm(places[:, None] - base, axis=2).min(1)
    found = atlas.paint((smoothstep(*HOLLOW, open_to) * smoothstep(*REACH, away)).astype(np.float32))
    texel = _texel(places, atlas, away < REACH[0])
    found = cv2.dilate(found, disk(max(round(RIM / texel), 1)))
    return cv2.GaussianBlur(found, (0, 0), SOFT / texel), texel


def _texel(places, atlas, where):
    """mm a texel, around there."""
    rows = np.flatnonzero(where)
    steps = np.linalg.norm(np.diff(places[rows], axis=0), axis=1)
    return float(np.median(steps[np.diff(atlas.index[rows]) == 1]))


def one_pair(
    colors: np.ndarray, seen: np.ndarray, head: HeadModel, atlas: Atlas
) -> np.ndarray:
    """Colours [N, 3] linear of the skin's texels, the hollows filled where they were not seen.

    Args:
        seen: [N] 0..1, how well the photo shows each texel.
        atlas: of the head's skin, N texels.
    """
    where, texel = hollows(head, atlas.size)
    rows, columns = np.nonzero(where > 0.01)
    pad = max(int(0.03 * atlas.size), 4)
    window = np.s_[
        max(rows.min() - pad, 0) : rows.max() + pad, max(columns.min() - pad, 0) : columns.max() + pad
    ]
    weight = where[window] * (1 - atlas.paint(seen.astype(np.float32))[window])
    shown = atlas.paint(colors.astype(np.float32))[window]
    on_skin = atlas.paint(np.ones(len(colors), np.float32))[window]
    luma = shown @ LUMA
    usual = np.median(luma[(weight < 0.01) & (on_skin > 0)])
    known = on_skin * smoothstep(*BEYOND, where[window])
    known = known * smoothstep(*SHADE, luma / max(usual, DARK))
    log = np.log(np.maximum(shown, DARK)).astype(np.float32)
    change = diffuse(log, known.astype(np.float32)) - normalized_blur(log, on_skin, PORES / texel)
    full = np.zeros((atlas.size, atlas.size, 3), np.float32)
    full[window] = weight[..., None] * change
    return colors * np.exp(full.reshape(-1, 3)[atlas.index])
