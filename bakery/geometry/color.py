"""sRGB transfer and luma."""

import cv2
import numpy as np
from numpy.typing import ArrayLike

LUMA = np.array([0.2126, 0.7152, 0.0722], np.float32)  # Rec.709


def to_linear(encoded: ArrayLike) -> np.ndarray:
    """sRGB-encoded 0..1 to scene-linear, float32 (IEC 61966-2-1)."""
    encoded = np.asarray(encoded, np.float32)
    return np.where(
        encoded <= 0.04045, encoded / 12.92, ((np.maximum(encoded, 0.04045) + 0.055) / 1.055) ** 2.4
    ).astype(np.float32)


def to_encoded(linear: ArrayLike) -> np.ndarray:
    """Scene-linear to sRGB-encoded, clipped to 0..1, float32."""
    linear = np.clip(np.asarray(linear, np.float32), 0, 1)
    return np.where(
        linear <= 0.0031308,
        linear * 12.92,
        1.055 * np.maximum(linear, 0.0031308) ** (1 / 2.4) - 0.055,
    ).astype(np.float32)


def to_bytes(encoded: np.ndarray) -> np.ndarray:
    """sRGB-encoded colours [H, W, 3] float32 0..1 to uint8, the nearest byte; clipped."""
    # One pass that clips both ends: `convertScaleAbs` would make negative ones positive.
    return cv2.addWeighted(encoded, 255, encoded, 0, 0, dtype=cv2.CV_8U)


def held(logs: np.ndarray, middle: np.ndarray, most: float, tint: float = np.inf) -> np.ndarray:
    """Log colours [..., 3] near a middle one [3].

    Args:
        most: by which their luminance differs from its at most.
        tint: by which a channel, over their luminance, differs at most.
    """
    off = logs - middle
    level = (off @ LUMA.astype(logs.dtype))[..., None]
    out: np.ndarray = (
        middle + np.clip(level, -most, most) + np.clip(off - level, -tint, tint)
    ).astype(logs.dtype)
    return out
