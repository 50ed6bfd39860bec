"""Reading values between pixels and between vertices."""

import cv2
import numba
import numpy as np
from numpy.typing import ArrayLike

from bakery.types import Fragments


def interpolate(fragments: Fragments, corners: np.ndarray) -> np.ndarray:
    """Blend per-face corner values over the picture.

    Args:
        fragments: Fragments [H, W].
        corners: [F, 3, C] the value at each corner of each face (`values[faces]`).

    Returns:
        [H, W, C] float32; 0 where there is no face.
    """
    out = np.zeros(fragments.face.shape + corners.shape[2:], np.float32)
    flat = out.reshape(fragments.face.size, -1)
    _blend(
        fragments.face.ravel(),
        fragments.barycentric.reshape(-1, 3),
        np.ascontiguousarray(corners, np.float32).reshape(len(corners), 3, -1),
        flat,
    )
    return out


@numba.njit(cache=True, nogil=True)
def _blend(face, barycentric, corners, out):
    for n in range(len(face)):
        f = face[n]
        if f >= 0:
            for c in range(out.shape[1]):
                out[n, c] = (
                    barycentric[n, 0] * corners[f, 0, c]
                    + barycentric[n, 1] * corners[f, 1, c]
                    + barycentric[n, 2] * corners[f, 2, c]
                )


def at_corners(values: ArrayLike, corners: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Values [V, C] of three corners [N, 3] each, blended by weights [N, 3]: [N, C] float32."""
    values = np.ascontiguousarray(values, np.float32)
    out = np.empty((len(corners), values.shape[1]), np.float32)
    _at_corners(values, corners, weights, out)
    return out


def at_corners_reference(values: ArrayLike, corners: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """`at_corners` in plain numpy."""
    first, second, third = np.asarray(values, np.float32)[corners.T]
    return first * weights[:, :1] + second * weights[:, 1:2] + third * weights[:, 2:]


@numba.njit(cache=True, nogil=True)
def _at_corners(values, corners, weights, out):
    for n in range(len(corners)):
        a, b, c = corners[n, 0], corners[n, 1], corners[n, 2]
        first, second, third = weights[n, 0], weights[n, 1], weights[n, 2]
        for k in range(values.shape[1]):
            out[n, k] = values[a, k] * first + values[b, k] * second + values[c, k] * third


def interpolate_reference(fragments, corners):
    """`interpolate` in plain numpy."""
    seen = fragments.face >= 0
    out = np.zeros(fragments.face.shape + corners.shape[2:], np.float32)
    weights, values = fragments.barycentric[seen], corners[fragments.face[seen]]
    out[seen] = np.einsum("nk,nkc->nc", weights, values)
    return out


def bilinear(image: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Sample at pixels between centres; outside, the border is repeated.

    Args:
        image: [H, W] or [H, W, C] float32 or uint8.
        points: [..., 2] pixels (centres at +0.5).

    Returns:
        [...] or [..., C].
    """
    return _sampled(image, points, cv2.INTER_LINEAR)


def bicubic(image, points):
    """As `bilinear`, without its blur: beside an edge values swing beyond those of the image."""
    return _sampled(image, points, cv2.INTER_CUBIC)


def _sampled(image, points, how):
    points = np.asarray(points, np.float32) - np.float32(0.5)
    flat = points.reshape(-1, 2)
    # cv2.remap fails above 32,767 columns, so the list of points is folded into rows of 8,192.
    width = 8192
    rows = max(-(-len(flat) // width), 1)  # nor does it take none
    padded = np.zeros((rows * width, 2), np.float32)
    padded[: len(flat)] = flat
    grid = padded.reshape(rows, width, 2)
    out = cv2.remap(image, grid, None, how, borderMode=cv2.BORDER_REPLICATE)
    return out.reshape((rows * width,) + image.shape[2:])[: len(flat)].reshape(
        points.shape[:-1] + image.shape[2:]
    )
