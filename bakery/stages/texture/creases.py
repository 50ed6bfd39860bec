"""The lines beside nose and mouth of a smile, filled: a person's own, beyond what smiles do on average.

A fold that a smile cuts is a dark valley in the texture, narrower than what else is dark there. It is
filled to the darker of its two sides (a morphological closing of the logarithm of colour), from the wing
of the nose past the corner of the mouth, as far as the mouth moved.

References:
    Batool and Chellappa, "Detection and inpainting of facial wrinkles using texture orientation
    fields and Markov random field modeling", IEEE TIP 2014: folds found, and filled from beside them.
"""

import cv2
import numpy as np

from bakery import landmarks as marks
from bakery.geometry.curve import nearest_on
from bakery.geometry.fill import smoothstep
from bakery.heads.base import HeadModel
from bakery.stages.atlas import Atlas

# From beside the wing of the nose past the corner of the mouth, the subject's right and left.
LINES = np.array([[203, 206, 216, 212, 202], [423, 426, 436, 432, 422]])
WINGS = np.array([129, 98, 49, 64, 358, 327, 279, 294])  # of the nose, whose own crease stays
BESIDE, OFF_LIPS, OFF_NOSE = (13.0, 6.0), (1.0, 4.0), (3.0, 6.5)  # mm over which it fades
RADIUS = 4.0  # mm, half the width of what is filled
SOFT = 0.5  # mm, standard deviation of the blur that keeps pores and stubble from being filled
MOST = 0.6  # of the logarithm
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
    y, x = np.divmod(on_skin.index[rows], on_skin.size)
    pad = 4 * round(RADIUS / texel)
    top, left = max(int(y.min()) - pad, 0), max(int(x.min()) - pad, 0)
    window = np.s_[top : int(y.max()) + pad, left : int(x.max()) + pad]
    # Each channel by itself: what lies in a fold is redder than the skin beside it.
    light = on_skin.paint(np.log(np.maximum(colors, DARK)).astype(np.float32))[window]
    skin = on_skin.paint(np.ones((len(colors), 3), np.float32))[window]

    def blur(picture):
        return cv2.GaussianBlur(picture, (0, 0), SOFT / texel)

    soft = blur(light * skin) / np.maximum(blur(skin), 1e-3)
    side = 2 * round(RADIUS / texel) + 1
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (side, side))
    far = np.float32(99)  # what is no skin neither fills nor is filled
    raised = cv2.dilate(np.where(skin > 0, soft, -far), disc)
    level = blur(cv2.erode(np.where(skin > 0, raised, far), disc))
    lift = np.clip(level - soft, 0, MOST)[y - top, x - left]
    out = colors.copy()
    out[rows] *= np.exp(share * weight[:, None] * lift)
    return out


def _beside(head, on_skin):
    """Texels that the lines may cross: their rows [n], how much they count [n], and mm a texel."""
    places, points = on_skin.at(head.mean), head.landmarks(head.mean)
    around = points[LINES.ravel()]
    low, high = around.min(0) - BESIDE[0], around.max(0) + BESIDE[0]
    rows = np.flatnonzero(((places > low) & (places < high)).all(1))
    places = places[rows]

    def distance(line):
        return np.linalg.norm(places - nearest_on(places, line)[0], axis=1)

    lips = points[np.append(marks.LIPS_OUTER, marks.LIPS_OUTER[0])]
    wings = np.linalg.norm(places[:, None] - points[WINGS], axis=2).min(1)
    weight = smoothstep(*BESIDE, np.minimum(*(distance(points[line]) for line in LINES)))
    weight = weight * smoothstep(*OFF_LIPS, distance(lips)) * smoothstep(*OFF_NOSE, wings)
    steps = np.linalg.norm(np.diff(places, axis=0), axis=1)
    beside = np.diff(on_skin.index[rows]) == 1
    kept = weight > 0
    return rows[kept], weight[kept], float(np.median(steps[beside]))
