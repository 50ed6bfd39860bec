"""The tone of a person's teeth: as the photo shows it, else as teeth of other people are in such a light."""

from dataclasses import dataclass

import cv2
import numpy as np

from bakery.geometry.color import LUMA
from bakery.geometry.fill import smoothstep
from bakery.landmarks import LIPS_INNER, face_size

# Of 317 people of congress/train who smile with open lips: teeth against the skin of cheeks and forehead,
# in logarithms of linear colour. Luminance is OFFSET + SLOPE * skin's (sd of what is left 0.24; by one
# figure for all 0.32, by the white of the eye 0.26). The tint, colour over luminance, likewise for red and blue.
OFFSET, SLOPE = 0.059, 0.722
RED, BLUE = (0.055, 0.242), (0.001, 0.485)
SKIN = np.array([50, 280, 205, 425, 151, 9])  # cheeks, and the middle of the forehead
PATCH = 0.02  # of the distance of the outer eye corners: half the side of a patch of skin
INSIDE = 0.012  # of it, that teeth are away from the lips' rim
PALE = 1.6  # red over green, above which a pixel is gum, tongue or lip
PALE_SHARE = 0.35, 0.6  # of what lies between the lips, that is teeth
AREA = 0.008, 0.025  # of the square of that distance, in which teeth tell their tone
# Luminance over that of likely teeth, up to which they are an empty mouth; four in five people have 0.74 to 1.36.
NO_TEETH = 0.35, 0.6
LIT = 0.5, 0.9  # quantiles of the luminance of pale pixels: no gaps, no glints


@dataclass(frozen=True, eq=False)
class Teeth:
    """Teeth that a photo shows."""

    color: np.ndarray  # [3] linear, of what is lit
    share: float  # 0..1, how far they can be trusted


def seen_teeth(linear: np.ndarray, points: np.ndarray) -> Teeth | None:
    """The teeth between open lips; None where a photo shows none.

    Args:
        linear: [H, W, 3].
        points: [L, 2] pixels.
    """
    between, eyes = _between_lips(linear.shape[:2], points)
    colors = linear[between]
    pale = colors[:, 0] < PALE * colors[:, 1]
    area = pale.sum() / eyes**2
    share = smoothstep(*PALE_SHARE, pale.mean() if len(pale) else 0.0) * smoothstep(*AREA, area)
    if share <= 0:
        return None
    teeth = colors[pale]
    light = teeth @ LUMA
    low, high = np.quantile(light, LIT)
    return Teeth(np.median(teeth[(light >= low) & (light <= high)], 0), float(share))


def likely_teeth(linear: np.ndarray, points: np.ndarray) -> np.ndarray:
    """The colour [3] that teeth have, by the skin of the face in its light; arguments as above."""
    half = max(PATCH * float(face_size(points)), 1)
    skin = []
    for x, y in points[SKIN]:
        rows, columns = (slice(max(int(at - half), 0), int(at + half) + 1) for at in (y, x))
        skin.append(linear[rows, columns].reshape(-1, 3))
    tone = np.maximum(np.median(np.concatenate(skin), 0), 1e-3)
    light = tone @ LUMA
    red, blue = (
        np.exp(offset + slope * np.log(tone[k] / light)) for k, (offset, slope) in ((0, RED), (2, BLUE))
    )  # fmt: skip
    green = (1 - LUMA[0] * red - LUMA[2] * blue) / LUMA[1]
    return np.exp(OFFSET + SLOPE * np.log(light)) * np.array([red, green, blue])


def teeth_color(linear: np.ndarray, points: np.ndarray, likely: np.ndarray) -> np.ndarray:
    """The colour [3] linear of a person's teeth where light falls on them, in the light of the photo.

    Args:
        likely: [3], of `likely_teeth`: for teeth that are not seen, or are too dark to be any.
    """
    seen = seen_teeth(linear, points)
    if seen is None:
        return likely
    share = seen.share * smoothstep(*NO_TEETH, seen.color @ LUMA / (likely @ LUMA))
    return likely * (np.maximum(seen.color, 1e-3) / likely) ** share


def _between_lips(shape, points):
    """Where [H, W] the mouth's interior is seen, off the rim of the lips; the distance of the eyes."""
    eyes = float(face_size(points))
    mouth = np.zeros(shape, np.uint8)
    cv2.fillPoly(mouth, [np.round(points[LIPS_INNER]).astype(np.int32)], 1)
    return cv2.distanceTransform(mouth, cv2.DIST_L2, 3) > max(INSIDE * eyes, 1), eyes
