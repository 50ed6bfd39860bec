"""Shadow and slanting light in what a photo shows of the skin: how far its tones go, and what is left.

Harmonics of the second order know no cast shadow. Where one lies, the detail of the skin is believed and
its tone is not (Saito 2017, section 4, masks such places out).
"""

import cv2
import numpy as np

from bakery.geometry.color import LUMA
from bakery.geometry.fill import diffuse, normalized_blur, smoothstep
from bakery.geometry.masks import disk

SHADED = (0.3, 0.7)  # of the cast shadow's matte: tones are believed up to it, and not from it on
EDGE = 1 / 170  # width of a shadow's edge, of the atlas's side
# Log by which skin is darker than it should be: no shadow up to the first, one from the second on.
HALVES = (0.35, 0.8)  # than the other half of the face
LIKELY = (0.35, 0.8)  # than what is likely
WIDE, FINE = 1 / 60, 1 / 70  # of the atlas's side: halves are compared so; what is finer is detail
ODD = (0.3, 0.6)  # log by which skin off the face differs from it: all of it is taken, and none
LIT = 0.6  # of a log by which skin is lighter that a lamp explains where it is seen squarely, as on a forehead
RIM = (
    1 / 45
)  # of the atlas's side: how far light leaks into a deep shadow, and the shadow out of it
DEEP = 0.9  # log of a shadow's darkness from which its edge is lost
HARD = (0.35, 0.55)  # log over FINE: no edge but a soft terminator, and a hard shadow's edge


def penumbra(shadow: np.ndarray, albedo: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """The hard edge of a cast shadow [T, T] 0..1: neither side's tone is there. 1 on it, 0 elsewhere.

    A soft edge is none: the shade below a fringe or in the fold of a lid is drawn to the skin around.

    Args:
        shadow: [T, T] 0..1; albedo: [T, T, 3] linear.
        weight: [T, T] 0..1: seen skin, without what is dark by nature.
    """
    width = int(EDGE * len(shadow)) | 1
    return _border((shadow > 0.5).astype(np.uint8), width) * _hard(_tone(albedo, weight))


def darker_half(albedo: np.ndarray, seen: np.ndarray) -> np.ndarray:
    """How surely [T, T] 0..1 a place lies in shadow, as the other half of the face tells.

    Args:
        albedo: [T, T, 3] linear; seen: [T, T] 0..1.
    """
    tone = _tone(albedo, seen, WIDE)
    both = np.minimum(seen, seen[:, ::-1]) > 0.5
    out: np.ndarray = smoothstep(*HALVES, tone[:, ::-1] - tone) * both
    return cv2.GaussianBlur(out.astype(np.float32), (0, 0), FINE * len(albedo))


def darkness(likely: np.ndarray, albedo: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Log [T, T] by which skin is darker than what is likely, continued to where it is not seen.

    Args:
        likely, albedo: [T, T, 3] linear.
        weight: [T, T] 0..1: seen skin, without what is dark by nature.
    """
    one, other = (_tone(x, weight) for x in (likely, albedo))
    return diffuse((one - other)[..., None], weight)[..., 0]


def odd(gap: np.ndarray, even: np.ndarray) -> np.ndarray:
    """How surely [T, T] 0..1 what was seen beside the face is no even skin: sideburns, temples of glasses, glare.

    Args:
        gap: of `darkness`.
        even: [T, T] 0..1, how far tones are believed: less at a slant.
    """
    width = int(RIM * len(gap)) | 1
    off = np.maximum(gap, -gap * (1 - LIT * even))
    out: np.ndarray = cv2.dilate(np.float32(smoothstep(*ODD, off)), disk(width / 2))
    return out


def leak(gap: np.ndarray) -> np.ndarray:
    """The rim [T, T] 0..1 of deep hard shadow, where light leaks in, redder than skin; both its sides.

    Args:
        gap: of `darkness`.
    """
    dark = (gap > DEEP).astype(np.uint8)
    width = int(2 * RIM * len(gap)) | 1
    return cv2.GaussianBlur(_border(dark, width) * _hard(gap), (0, 0), width / 8)


def _tone(albedo: np.ndarray, weight: np.ndarray, width: float = FINE) -> np.ndarray:
    """Log luminance [T, T] without detail."""
    smooth = normalized_blur(albedo, weight, width * len(albedo))
    out: np.ndarray = np.log(np.maximum(smooth @ LUMA, 1e-3))
    return out


def _hard(tone: np.ndarray) -> np.ndarray:
    """How surely [T, T] 0..1 a hard shadow ends near: its log tone is steep."""
    slope = np.hypot(*np.gradient(tone)) * FINE * len(tone)
    return cv2.dilate(np.float32(smoothstep(*HARD, slope)), disk((int(RIM * len(tone)) | 1) / 2))


def _border(dark: np.ndarray, width: int) -> np.ndarray:
    """1 where a mask [T, T] uint8 ends, half the width to both sides, 0 elsewhere."""
    disc = disk(width / 2)
    return (cv2.dilate(dark, disc) - cv2.erode(dark, disc)).astype(np.float32)
