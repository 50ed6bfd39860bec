"""Smooth completion of pictures with holes."""

import cv2
import numpy as np
from numpy.typing import ArrayLike

REACH = 4.5  # standard deviations, beyond which cv2.GaussianBlur of floats sees nothing
# Pixels that OpenCV takes at once, at most: what is left of a row is rounded in another way.
LANES = 16
COARSE = 4.0  # pixels, standard deviation of a blur that needs no finer picture
# Variance, of its squared pixels, that making a picture small and large adds: 1/12 and, of a straight
# line between two, up to 1/6; with this edges are best.
RESIZED = 0.15


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


def blurred(picture: np.ndarray, sigma: float) -> np.ndarray:
    """Gaussian blur of a picture [H, W] or [H, W, C] of floats, edges of it to 0.005 of their height.

    The time of `cv2.GaussianBlur`, the reference, goes with the width: a wide blur is done at a size at
    which it costs little.
    """
    shrink = _shrink(sigma)
    if shrink == 1:
        return cv2.GaussianBlur(picture, (0, 0), sigma)
    height, width = picture.shape[:2]
    size = (-(-width // shrink), -(-height // shrink))
    more = (0, size[1] * shrink - height, 0, size[0] * shrink - width)
    whole = cv2.copyMakeBorder(picture, *more, cv2.BORDER_REFLECT) if any(more) else picture
    small = cv2.resize(whole, size, interpolation=cv2.INTER_AREA)
    small = cv2.GaussianBlur(small, (0, 0), (sigma**2 / shrink**2 - RESIZED) ** 0.5)
    large = (size[0] * shrink, size[1] * shrink)
    return cv2.resize(small, large, interpolation=cv2.INTER_LINEAR)[:height, :width]


def sparse_blur(picture: np.ndarray, sigma: float) -> np.ndarray:
    """`blurred` of a picture [H, W] or [H, W, C] of floats, only where it is not 0 all around.

    The same numbers: what a blur cannot reach stays 0.
    """
    out = np.zeros(picture.shape, picture.dtype)
    there = picture.any(2) if picture.ndim > 2 else picture != 0
    if there.any():
        window = _reached(there, sigma)
        out[window] = blurred(picture[window], sigma).reshape(out[window].shape)
    return out


def normalized_blur(values: np.ndarray, weight: np.ndarray, sigma: float) -> np.ndarray:
    """Gaussian blur of values [H, W] or [H, W, C] over what has weight [H, W] 0..1.

    The same numbers as `normalized_blur_reference` where that is narrow: what no weight reaches is 0.
    """
    out = np.zeros(values.shape, np.result_type(values, weight))
    if weight.any():
        window = _reached(weight != 0, sigma)
        out[window] = _normalized(values[window], weight[window], sigma, blurred)
    return out


def _shrink(sigma: float) -> int:
    """How many times smaller a picture may be for a blur."""
    return max(int(sigma / COARSE), 1)


def _reached(there: np.ndarray, sigma: float) -> tuple[slice, slice]:
    """Slices that hold all that the blur of a mask [H, W], not empty, reaches.

    They are cut so that OpenCV rounds, or makes small, as in the whole picture.
    """
    shrink = _shrink(sigma)
    rows, columns = around(there, REACH * sigma + shrink + LANES)
    steps = (LANES if shrink == 1 else shrink), shrink
    columns, rows = (slice(s.start // n * n, s.stop) for s, n in zip((columns, rows), steps))
    return rows, columns


def normalized_blur_reference(values: np.ndarray, weight: np.ndarray, sigma: float) -> np.ndarray:
    """`normalized_blur` of the whole picture, and of its own size."""
    return _normalized(values, weight, sigma, lambda p, s: cv2.GaussianBlur(p, (0, 0), s))


def _normalized(values, weight, sigma, blur):
    mass = np.maximum(blur(weight, sigma), 1e-3)
    deep = (...,) + (None,) * (values.ndim - 2)
    out: np.ndarray = blur(values * weight[deep], sigma).reshape(values.shape) / mass[deep]
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
