"""Reading values between pixels and between vertices."""

import cv2
import numpy as np


def interpolate(fragments, corners):
    """Blend per-face corner values over the picture.

    Args:
        fragments: Fragments [H, W].
        corners: [F, 3, C] the value at each corner of each face (`values[faces]`).

    Returns:
        [H, W, C] float32; 0 where there is no face.
    """
    seen = fragments.face >= 0
    out = np.zeros(fragments.face.shape + corners.shape[2:], np.float32)
    out[seen] = np.einsum(
        "nk,nkc->nc",
        fragments.barycentric[seen],
        corners[fragments.face[seen]].astype(np.float32, copy=False),
    )
    return out


def bilinear(image, points):
    """Sample at pixels between centres; outside, the border is repeated.

    Args:
        image: [H, W] or [H, W, C] float32 or uint8.
        points: [..., 2] pixels (centres at +0.5).

    Returns:
        [...] or [..., C].
    """
    points = np.asarray(points, np.float32) - np.float32(0.5)
    flat = points.reshape(-1, 2)
    # cv2.remap fails above 32,767 columns, so the list of points is folded into rows of 8,192.
    width = 8192
    rows = -(-len(flat) // width)
    padded = np.zeros((rows * width, 2), np.float32)
    padded[: len(flat)] = flat
    grid = padded.reshape(rows, width, 2)
    out = cv2.remap(image, grid, None, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return out.reshape((rows * width,) + image.shape[2:])[: len(flat)].reshape(
        points.shape[:-1] + image.shape[2:]
    )
