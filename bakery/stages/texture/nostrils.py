"""One pair of nostrils: no made-up ones in the hollows of a head's nose where its photo shows its own above.

The nose of a head model ends lower than people's (docs/log-heads.md): a photo's nostrils are painted 5 to
8 mm above the model's. What fills the model's is made up, and darker than what surrounds it: a second
pair. It gets the tone of the skin around. Where no nostril was seen, or where the model has it, it stays.
"""

import cv2
import numpy as np

from bakery.geometry.color import LUMA
from bakery.geometry.fill import diffuse, normalized_blur, smoothstep
from bakery.geometry.masks import disk
from bakery.heads.base import HeadModel
from bakery.landmarks import NOSE_BASE
from bakery.memo import once_per_object
from bakery.stages.atlas import Atlas, make_atlas, texel_size
from bakery.stages.texture.occlusion import openness

HOLLOW = (0.9, 0.75)  # openness from which skin is of a hollow, not and wholly
REACH = (13.0, 9.0)  # mm from the nose's base
RIM, SOFT = 3.0, 1.3  # mm, how far its rim goes beyond, and the blur of its border
# Share of a hollow from which on skin tells nothing of what surrounds it, up to which it does.
BEYOND = (0.25, 0.03)
PORES = 0.25  # mm: what is finer stays
SHADE = (0.4, 0.6)  # of the brightness around: darker is the photo's own nostril
DARKER = 0.7  # of the brightness around: from there on a texel counts, by the square of what it is darker
# mm above the hollows' middle, of the mean of what is dark: 1.3 below to 5.5 above where a head itself was
# photographed (6 painted people), 4.8 to 8.0 for portraits of people; and how much darker the darkest is.
ABOVE, DARKEST = (5.0, 6.0), (0.15, 0.3)
BOX = (9.0, 12.0, 5.0)  # mm beside, above and below the middle of a hollow, where it is looked for
SEEN = (0.75, 0.98)  # how well the photo shows a texel: what is less is made up, in part
DARK = 1e-3  # linear


@once_per_object
def hollows(head: HeadModel, size: int) -> tuple[np.ndarray, float]:
    """Where the head's nostrils are, on an atlas of so many texels a side: [T, T] 0..1, and mm a texel."""
    atlas = make_atlas(head, size).take("skin")
    open_to = atlas.at(openness(head, head.mean).everywhere[:, None])[:, 0]
    places = atlas.at(head.mean)
    base = head.landmarks(head.mean)[NOSE_BASE]
    away = np.linalg.norm(places[:, None] - base, axis=2).min(1)
    found = atlas.paint(
        (smoothstep(*HOLLOW, open_to) * smoothstep(*REACH, away)).astype(np.float32)
    )
    near = away < REACH[0]
    texel = texel_size(places[near], atlas.index[near])
    found = cv2.dilate(found, disk(max(round(RIM / texel), 1)))
    return cv2.GaussianBlur(found, (0, 0), SOFT / texel), texel


def one_pair(colors: np.ndarray, seen: np.ndarray, head: HeadModel, atlas: Atlas) -> np.ndarray:
    """Colours [N, 3] linear of the skin's texels, the hollows filled where they were not seen.

    Args:
        seen: [N] 0..1, how well the photo shows each texel.
        atlas: of the head's skin, N texels.
    """
    where, texel = hollows(head, atlas.size)
    if where.max() <= 0.5:  # a head without nostrils
        return colors
    rows, columns = np.nonzero(where > 0.01)
    pad = round(max(BOX) / texel)
    window = np.s_[
        max(rows.min() - pad, 0) : rows.max() + pad,
        max(columns.min() - pad, 0) : columns.max() + pad,
    ]
    hollow = where[window]
    shown, sight = (atlas.paint(x.astype(np.float32))[window] for x in (colors, seen))
    on_skin = atlas.paint(np.ones(len(colors), np.float32))[window]
    luma = shown @ LUMA
    usual = np.median(luma[(hollow < BEYOND[1]) & (on_skin > 0)])
    known = np.maximum(smoothstep(*BEYOND, hollow), smoothstep(*SEEN, sight)) * on_skin
    known *= smoothstep(*SHADE, luma / max(usual, DARK))
    log = np.log(np.maximum(shown, DARK)).astype(np.float32)
    change = diffuse(log, known.astype(np.float32)) - normalized_blur(log, on_skin, PORES / texel)
    weight = hollow * (1 - smoothstep(*SEEN, sight))
    weight = weight * _shown_above(luma, sight, hollow, texel)
    full = np.zeros((atlas.size, atlas.size, 3), np.float32)
    full[window] = weight[..., None] * change
    return colors * np.exp(full.reshape(-1, 3)[atlas.index])


def _shown_above(luma, sight, hollow, texel):
    """Whether a photo shows nostrils above the head's own: 0..1.

    Args:
        luma, sight, hollow: [h, w], brightness, how well the photo shows it, and `hollows`.
        texel: mm.
    """
    row, column = np.nonzero(hollow > 0.5)
    middle = (column.min() + column.max()) / 2
    total = darkest = above = 0.0
    for side in (column < middle, column > middle):
        if not side.any():
            continue
        y, x = row[side].mean(), column[side].mean()
        beside, up, down = (round(reach / texel) for reach in BOX)
        top = max(int(y) - up, 0)
        box = np.s_[top : int(y) + down, max(int(x) - beside, 0) : int(x) + beside]
        well = sight[box] > SEEN[1] - 0.1
        if not well.any():
            continue
        dark = (
            np.maximum(DARKER - luma[box] / max(np.median(luma[box][well]), DARK), 0) * sight[box]
        )
        total += (dark**2).sum()
        above += ((dark**2).sum(1) * (y - top - np.arange(len(dark)))).sum() * texel
        darkest = max(darkest, float(dark.max()))
    found: float = smoothstep(*ABOVE, above / max(total, 1e-9)) * smoothstep(*DARKEST, darkest)
    return found
