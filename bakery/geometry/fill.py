"""Smooth completion of pictures with holes."""

import cv2
import numpy as np
from numpy.typing import ArrayLike

REACH = 4.5  # standard deviations, beyond which cv2.GaussianBlur of floats sees nothing
# Pixels that OpenCV takes at once, at most: what is left of a row is rounded in another way.
LANES = 16


def around(mask: np.ndarray, margin: float) -> tuple[slice, slice]:
    """Slices (rows, columns) that hold all of a mask [H, W], not empty, and `margin` pixels around it."""
    out = []
    for axis in (1, 0):
        at = np.flatnonzero(mask.any(axis))
        out.append(slice(max(at[0] - int(np.ceil(margin)), 0), at[-1] + int(np.ceil(margin)) + 1))
    rows, columns = out
    return rows, columns


def diffuse(values: np.ndarray, weight: np.ndarray, floor: float = 1e-4) -> np.ndarray:
    """Continue known values smoothly into the unknown (pull-push pyramid).

    Where the weight is 1 the value stays as it is; where it is 0 the value comes from ever wider
    neighbourhoods, so steps between known and unknown do not show.

    Args:
        values: [H, W, C] float32.
        weight: [H, W] float32 0..1.
        floor: weight below which a level says nothing.

    Returns:
        [H, W, C] float32.

    References:
        Gortler, Grzeszczuk, Szeliski and Cohen, "The Lumigraph", SIGGRAPH 1996, section 3.4.1.
    """
    values = np.asarray(values, np.float32)
    weight = np.maximum(np.asarray(weight, np.float32), 0)  # rounding leaves -1e-7, and 1 over that
    levels = [(values * weight[..., None], weight)]
    while min(levels[-1][1].shape) > 2:
        total, mass = levels[-1]
        size = (max(mass.shape[1] // 2, 1), max(mass.shape[0] // 2, 1))
        total = cv2.resize(cv2.GaussianBlur(total, (0, 0), 1.0), size, interpolation=cv2.INTER_AREA)
        mass = cv2.resize(cv2.GaussianBlur(mass, (0, 0), 1.0), size, interpolation=cv2.INTER_AREA)
        total = total.reshape(mass.shape + values.shape[2:])
        # A coarse cell with any knowledge at all speaks with more than its share of the area.
        gain = np.minimum(1, 4 * mass) / np.maximum(mass, 1e-20)
        levels.append((total * gain[..., None], mass * gain))
    total, mass = levels.pop()
    out = total / np.maximum(mass, 1e-12)[..., None]
    while levels:
        total, mass = levels.pop()
        size = (mass.shape[1], mass.shape[0])
        out = cv2.resize(out, size, interpolation=cv2.INTER_LINEAR).reshape(mass.shape + (-1,))
        out = cv2.GaussianBlur(out, (0, 0), 0.8).reshape(mass.shape + (-1,))
        known = mass[..., None]
        out = np.where(known > floor, total + (1 - known) * out, out)
    return out


def sparse_blur(picture: np.ndarray, sigma: float) -> np.ndarray:
    """`cv2.GaussianBlur` of a picture [H, W] or [H, W, C] of floats, only where it is not 0 all around.

    The same numbers: what a blur cannot reach stays 0.
    """
    out = np.zeros(picture.shape, picture.dtype)
    there = picture.any(2) if picture.ndim > 2 else picture != 0
    if there.any():
        window = _reached(there, sigma)
        out[window] = cv2.GaussianBlur(picture[window], (0, 0), sigma).reshape(out[window].shape)
    return out


def normalized_blur(values: np.ndarray, weight: np.ndarray, sigma: float) -> np.ndarray:
    """Gaussian blur of values [H, W] or [H, W, C] over what has weight [H, W] 0..1.

    The same numbers as `normalized_blur_reference`: what no weight reaches is 0.
    """
    out = np.zeros(values.shape, np.result_type(values, weight))
    if weight.any():
        window = _reached(weight != 0, sigma)
        out[window] = normalized_blur_reference(values[window], weight[window], sigma)
    return out


def _reached(there: np.ndarray, sigma: float) -> tuple[slice, slice]:
    """Slices that hold all that the blur of a mask [H, W], not empty, reaches.

    Its rows are cut so that OpenCV rounds as in rows of the whole picture.
    """
    rows, columns = around(there, REACH * sigma + 1 + LANES)
    return rows, slice(columns.start // LANES * LANES, columns.stop)


def normalized_blur_reference(values: np.ndarray, weight: np.ndarray, sigma: float) -> np.ndarray:
    """`normalized_blur` of the whole picture."""
    mass = np.maximum(cv2.GaussianBlur(weight, (0, 0), sigma), 1e-3)
    deep = (...,) + (None,) * (values.ndim - 2)
    out: np.ndarray = cv2.GaussianBlur(values * weight[deep], (0, 0), sigma) / mass[deep]
    return out


def smoothstep(low: float, high: float, x: ArrayLike) -> np.ndarray:
    """0 below `low`, 1 above `high`, a smooth cubic between; `low` may be the larger."""
    t = np.clip((np.asarray(x) - low) / (high - low), 0, 1)
    return t * t * (3 - 2 * t)


def soft_limit(x: np.ndarray, most: np.ndarray | float) -> np.ndarray:
    """x where it is small, bent smoothly towards plus or minus `most` where it is not."""
    out: np.ndarray = most * np.tanh(x / most)
    return out


def enclosed(mask: np.ndarray) -> np.ndarray:
    """Where [H, W] bool the pixels of a mask [H, W] have no way to the picture's edge."""
    _, parts = cv2.connectedComponents(mask.astype(np.uint8))
    outside = np.concatenate([parts[0], parts[-1], parts[:, 0], parts[:, -1]])
    return ~np.isin(parts, [0, *np.unique(outside)])
