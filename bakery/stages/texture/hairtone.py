"""The colour of hair that is made up, from what the photo shows of it."""

import cv2
import numpy as np

from bakery.geometry.color import LUMA, held, to_encoded
from bakery.geometry.fill import around, diffuse, normalized_blur, smoothstep, sparse_blur

DIFFERS = 0.5, 0.12  # log brightness, and tint, by which what is made up differs from the middle
UNLIKE = 0.08  # distance of sRGB colours of hair and skin that can be told apart
LIKE = (0.5, 0.7)  # of the way from skin's colour to hair's: no hair up to it, all from it on
SHINING = (1.8, 2.4)  # upper over lower fifth of hair's lightness: even, shining
MIXED = 0.03  # of the root of hair's area: over which single hairs make one tone
GLOSS = (1.4, 1.9)  # lightness over that of dull hair: such, highlights
AROUND = 0.045  # the same over which the hair around a pixel has its tone
REACH = 25  # share of the atlas over which what is made up passes to the hair's middle colour
LEFT = 0.05  # of what is labelled hair


def tone_of(
    color: np.ndarray,
    sure: np.ndarray,
    own: np.ndarray,
    linear: np.ndarray,
    hair: np.ndarray,
    skin: np.ndarray,
    local: np.ndarray,
    near: np.ndarray,
) -> np.ndarray:
    """Log colour [T, T, 3] of hair that is made up: of what is `sure` [T, T], continued.

    What is nearer to the skin's colour than to that of the photo's hair is of bald tops and hairlines.
    Far from all else, and where little is left of it, what is made up has the hair's middle colour. A
    shaded rim, continued over a side, would be hair of another colour: it is about as light as the rest.
    What the camera sees at a slant is as the hair around its pixel, or a line of another colour shows there.

    Args:
        color: [T, T, 3] linear, the photo unwrapped.
        sure: [T, T] 0..1, where that is surely hair.
        own: of `from_both`.
        linear: [H, W, 3] float32 photo.
        hair, skin: [H, W] 0..1, where it shows such.
        local: [T, T, 3], the log colour of the hair around each texel's pixel, as of `tone_around`.
        near: [T, T] 0..1, how far that counts.
    """

    def as_around(tone):
        return tone + near[..., None] * (local - tone)

    dark = np.log(np.maximum(color, 1e-3))
    inner = _inner(hair)
    bare = skin > 0.9
    if not (inner.any() and bare.any()):
        return from_both(dark, sure, own)
    both = [np.median(linear[where], 0) for where in (inner, bare)]
    dull, shining = _dull(linear, inner)
    level = to_encoded(np.maximum(color @ LUMA, 0)) / max(float(to_encoded(dull @ LUMA)), 1e-3)
    middle = np.log(np.maximum(both[0] + shining * (dull - both[0]), 1e-3)).astype(np.float32)
    kept = sure * (1 - shining * smoothstep(*GLOSS, level))
    if np.linalg.norm(to_encoded(both[0]) - to_encoded(both[1])) >= UNLIKE:
        shown = to_encoded(np.maximum(color, 0))
        off = [np.linalg.norm(shown - to_encoded(each), axis=-1) for each in both]
        kept = kept * smoothstep(*LIKE, off[1] / np.maximum(off[0] + off[1], 1e-6))
    elif shining == 0:
        return held(as_around(from_both(dark, sure, own)), middle, *DIFFERS)
    tone: np.ndarray = np.broadcast_to(middle, dark.shape)
    if kept.sum() >= LEFT * sure.sum():
        # The border of what is seen is a hairline, where skin shines through: it does not tell of the back.
        tone = middle + _beside(kept) * (from_both(dark, kept.astype(np.float32), own) - middle)
    tone = held(as_around(tone), middle, *DIFFERS)
    if shining == 0:
        return tone
    # A highlight fades out, or what is made up would end at its border.
    return tone + shining * _beside(sure - kept) * (from_both(dark, sure, own) - tone)


def tone_around(linear: np.ndarray, hair: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Log colour [H, W, 3] of the hair around each pixel of a photo, and how near any is [H, W] 0..1.

    Args:
        linear: [H, W, 3] float32 photo; hair: [H, W] 0..1, where it shows such.
    """
    inner = _inner(hair).astype(np.float32)
    width = AROUND * np.sqrt(max(inner.sum(), 1.0))
    near = np.clip(4 * cv2.GaussianBlur(inner, (0, 0), width), 0, 1)
    return np.log(np.maximum(normalized_blur(linear, inner, width), 1e-3)), near


def _inner(hair):
    """Where [H, W] bool a photo surely shows hair, off its border, whose colour is mixed."""
    return cv2.erode((hair > 0.9).astype(np.uint8), np.ones((5, 5), np.uint8)) > 0


def _beside(sure):
    """How near texels are to what is `sure` [T, T]: [T, T, 1] 0..1."""
    near = sparse_blur(sure.astype(np.float32), len(sure) / REACH)
    return np.clip(2 * near, 0, 1)[..., None]


def _dull(linear, hair):
    """The colour [3] of a photo's `hair` [H, W] off its highlights, and how far it has such, 0..1.

    Cropped hair shines where the lamp is, on top: its back and sides do not. Grey hairs among dark ones
    are no highlights: they are everywhere.
    """
    where = around(hair, 0)
    hair = hair[where]
    width = MIXED * np.sqrt(hair.sum())
    colors = normalized_blur(linear[where], hair.astype(np.float32), width)[hair]
    level = to_encoded(colors @ LUMA)
    low, high = np.quantile(level, (0.2, 0.8))
    shining = float(smoothstep(*SHINING, high / max(low, 1e-3)))
    return np.median(colors[level <= low], 0), shining


def from_both(values: np.ndarray, sure: np.ndarray, own: np.ndarray) -> np.ndarray:
    """Values [T, T, C] continued from where they are `sure` [T, T], the other side's too.

    Args:
        own: [T, T] 0..1, how squarely a side is seen: a far one takes after the near one.
    """
    sure = np.clip(sure, 0, 1)  # interpolation leaves -1e-7, which would divide by nothing
    other = sure[:, ::-1] * (1 - own) * (sure < 0.5)
    weight = sure + other
    both = values * sure[..., None] + values[:, ::-1] * other[..., None]
    both = (both / np.maximum(weight, 1e-6)[..., None]).astype(np.float32)
    return diffuse(both, np.minimum(weight, 1).astype(np.float32))
