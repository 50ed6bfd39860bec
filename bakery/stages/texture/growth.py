"""Where hair may grow on the atlas of a head, whatever a photo shows."""

import cv2
import numpy as np

from bakery.geometry.fill import diffuse, smoothstep
from bakery.geometry.masks import disk
from bakery.heads.base import HeadModel
from bakery.heads.scalp import BROW, EYE, ear_box, ear_depth, nape_line, scalp, unrolled
from bakery.landmarks import CHIN, OVAL
from bakery.stages.atlas import Atlas, uv_polygon

HAIRLINE = 1 / 25  # of the atlas's side: twice how far off the scalp a hairline's strip reaches
UP_TO_SCALP = 1.08  # of the face's contour: between it and the scalp nothing gapes
JAW = 20.0  # mm above the chin, where the layer has gone
SIDEBURN = (-14.0, -2.0)  # mm above the middle of an ear, up to which the layer shows none, all
LOBE = 6.0  # mm before an ear from which it shows all
OVAL_EAR = 2.5  # exponent of an ear's outline: in the corners of its box hair grows
STANDS = 2.0  # mm off the skull's side, from which skin is of an ear
UPPER = 0.6  # share of an ear's height, from where on that tells; below it is a shell's hollow
# Share of the atlas that bald scalp is wide at least, for less is a high hairline; over which hair is sparse beside it.
BALD, BESIDE_BALD = 8, 24
COARSE = 256  # texels a side at which that is found
# mm above the nape's line, and behind an ear, over which hair gets less.
NAPE, BEHIND = (-14.0, 14.0), (10.0, 30.0)


def growth_on(head: HeadModel, atlas: Atlas) -> np.ndarray:
    """The scalp on an atlas of the skin: [T, T] 0..1."""
    return atlas.paint(atlas.at(scalp(head)[:, None])[:, 0])


def forehead(head: HeadModel, size: int) -> np.ndarray:
    """1 within the face's contour above the brows [T, T] float32, 0 from the eyes down.

    It is seen squarely: what of hair lies on it, a photo shows as it is.
    """
    eye, brow = (head.landmark_uv()[mark, 1] for mark in (EYE, BROW))
    down = (np.arange(size) + 0.5) / size
    inside = cv2.GaussianBlur(uv_polygon(head, OVAL, UP_TO_SCALP, size), (0, 0), size / 200)
    return (inside * smoothstep(eye, brow, down)[:, None]).astype(np.float32)


def before_ears(head: HeadModel, atlas: Atlas) -> np.ndarray:
    """1 on the skin before the ears and above their middle [T, T] float32, where sideburns are."""
    flat = unrolled(head)(atlas.at(head.mean))
    front, _, low, high = ear_box(head)
    middle = (low + high) / 2
    above = smoothstep(*(middle + np.array(SIDEBURN)), flat[:, 1])
    found: np.ndarray = atlas.paint(above * smoothstep(front, front - LOBE, flat[:, 0]))
    return found.astype(np.float32)


def above_nape(head: HeadModel, atlas: Atlas) -> np.ndarray:
    """How many of the hairs [N] 0..1 grow on the texels of an atlas: fewer and fewer down to the nape."""
    flat = unrolled(head)(atlas.at(head.mean))
    above = flat[:, 1] - nape_line(head, flat[:, 0])
    behind = smoothstep(*BEHIND, flat[:, 0] - ear_box(head)[1])
    return (1 - behind * (1 - smoothstep(*NAPE, above))).astype(np.float32)


def beside_scalp(growth: np.ndarray) -> np.ndarray:
    """Where [T, T] 0..1 the strip of skin beside hair belongs to a hairline, not to a cheek.

    Args:
        growth: [T, T] 0..1, the scalp.
    """
    width = int(HAIRLINE * len(growth)) | 1
    near: np.ndarray = cv2.GaussianBlur(cv2.dilate(growth, disk(width / 2)), (0, 0), width / 6)
    return near


def bald_around(bare: np.ndarray) -> np.ndarray:
    """How much of what is around is bald scalp [T, T] 0..1, by the scalp that has no hair [T, T] 0..1.

    Beside it hair is sparse; a high hairline leaves a narrow strip bare, and may be dense.
    """
    size = len(bare)
    small = cv2.resize(bare.astype(np.float32), (COARSE, COARSE), interpolation=cv2.INTER_AREA)
    wide = cv2.morphologyEx(small, cv2.MORPH_OPEN, disk(COARSE / BALD / 2))
    soft = cv2.GaussianBlur(wide, (0, 0), COARSE / BESIDE_BALD)
    return cv2.resize(soft, (size, size), interpolation=cv2.INTER_LINEAR)


def on_ears(head: HeadModel, atlas: Atlas) -> np.ndarray:
    """1 on the ears [n] float32, where no hair grows.

    Above and before their upper part, it grows up to where they stand out of the skull.
    """
    points = atlas.at(head.mean)
    flat = unrolled(head)(points)
    box = ear_box(head)
    ear = ear_depth(flat, box, OVAL_EAR) < 1
    out = np.abs(points[:, 0])
    skull = diffuse(atlas.paint(out)[..., None], atlas.paint(~ear).astype(np.float32))
    stands = out - skull[..., 0].reshape(-1)[atlas.index] > STANDS
    low, high = box[2:]
    below = flat[:, 1] < low + UPPER * (high - low)
    return (ear & (stands | below)).astype(np.float32)


def above_the_neck(head: HeadModel, atlas: Atlas) -> np.ndarray:
    """1 on the head, 0 on the neck, [N]: hair on the neck hangs from the head, which turns alone."""
    chin = head.landmarks(head.mean)[CHIN, 1].mean()
    return smoothstep(chin, chin + JAW, atlas.at(head.mean)[:, 1])
