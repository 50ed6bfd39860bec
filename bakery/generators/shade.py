"""Shading in the picture: how lids darken eyes and lips darken the mouth's interior."""

import cv2
import numpy as np

from bakery.geometry import harmonics
from bakery.geometry.color import LUMA
from bakery.geometry.fill import smoothstep
from bakery.heads.base import MOUTH, PARTS

EYES = ("eye_left", "eye_right")
BLUR = 4.5  # standard deviations, beyond which cv2.GaussianBlur of floats sees nothing


def is_part(part, *names):
    """Mask of the pixels [H, W] uint8 whose part is one of the named."""
    found = part == PARTS.index(names[0])
    for name in names[1:]:
        found |= part == PARTS.index(name)
    return found


def lid_occlusion(part, depth, focal):
    """Light [H, W] 0..1 that reaches the eyes under the lids; 1 away from them.

    The upper lid hides about half of the sky from the strip below it; lashes add to that. A blur of
    what is not eye, shifted down by the radius, is the share of the hidden sky.
    """
    eyes = is_part(part, *EYES)
    if not eyes.any():
        return np.ones(part.shape, np.float32)
    radius = max(focal / float(np.median(depth[eyes])) * 1.4, 0.6)  # 1.4 mm in pixels
    covered = cv2.GaussianBlur((~eyes).astype(np.float32), (0, 0), radius)
    shift = np.float32([[1, 0, 0], [0, 1, 0.9 * radius]])
    covered = cv2.warpAffine(
        covered, shift, part.shape[::-1], flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
    )
    return np.where(eyes, 1 - 0.72 * smoothstep(0.15, 1.0, covered), 1).astype(np.float32)


def lip_occlusion(part, depth, focal, lip_depth):
    """Light [H, W] 0..1 that reaches the mouth's interior between the lips; 1 elsewhere.

    Args:
        lip_depth: mm in front of the camera, of the opening between the lips.

    Two effects: a point near a lip sees less sky (a blur of the opening), and a point deep inside
    sees the opening under a smaller angle. Depth darkens over about 2 cm (PITFALLS 5).
    """
    mouth = is_part(part, *MOUTH)
    if not mouth.any():
        return np.ones(part.shape, np.float32)
    per_mm = focal / lip_depth
    opening = mouth.astype(np.float32)
    near = cv2.GaussianBlur(opening, (0, 0), max(1.2 * per_mm, 0.6))
    far = cv2.GaussianBlur(opening, (0, 0), max(5.0 * per_mm, 1.0))
    behind = np.where(mouth, np.maximum(depth - lip_depth, 0), 0)
    deep = 1 / (1 + (behind / 17.0) ** 2)
    # Real smiles show teeth almost evenly lit up to the lips and dark only in the corners: the shade
    # of the lips takes less than half, depth takes the rest.
    sky = 0.55 + 0.45 * smoothstep(0.25, 0.95, near)
    wide = 0.75 + 0.25 * smoothstep(0.1, 0.6, far)
    return np.where(mouth, sky * wide * deep, 1).astype(np.float32)


def relative_irradiance(normals, light, low=0.5, high=1.35):
    """Luminance of the light at normals [..., 3] over that at a frontal one: [...], clipped."""
    front = harmonics.irradiance(np.array([0.0, 0.0, 1.0]), light) @ LUMA
    return np.clip(harmonics.irradiance(normals, light) @ LUMA / max(front, 1e-4), low, high)
