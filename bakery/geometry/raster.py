"""Z-buffer rasteriser: which face each pixel centre sees, and where on it.

`rasterize` compiles once with numba (2.3 s, then cached on disk); `rasterize_reference` is the same
in plain numpy, face by face, and the tests hold the two equal.
"""

import numba
import numpy as np

from bakery.types import Fragments


@numba.njit(cache=True, nogil=True)
def _fill(pixels, inverse, faces, cull, face_out, barycentric_out, best):
    """Paint faces into the buffers; `best` holds 1/depth, larger is nearer."""
    height, width = best.shape
    for f in range(faces.shape[0]):
        a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
        wa, wb, wc = inverse[a], inverse[b], inverse[c]
        if wa <= 0 or wb <= 0 or wc <= 0:
            continue
        ax, ay = pixels[a, 0], pixels[a, 1]
        bx, by = pixels[b, 0], pixels[b, 1]
        cx, cy = pixels[c, 0], pixels[c, 1]
        area = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay)
        if area == 0 or (cull and area > 0):
            continue
        left = max(0, int(np.ceil(min(ax, bx, cx) - 0.5)))
        right = min(width - 1, int(np.floor(max(ax, bx, cx) - 0.5)))
        top = max(0, int(np.ceil(min(ay, by, cy) - 0.5)))
        bottom = min(height - 1, int(np.floor(max(ay, by, cy) - 0.5)))
        side = 1.0 if area > 0 else -1.0
        for row in range(top, bottom + 1):
            y = row + 0.5
            for column in range(left, right + 1):
                x = column + 0.5
                la = (bx - x) * (cy - y) - (cx - x) * (by - y)
                lb = (cx - x) * (ay - y) - (ax - x) * (cy - y)
                if la * side < 0 or lb * side < 0:  # half of the box is outside: spare it divisions
                    continue
                la, lb = la / area, lb / area
                lc = 1.0 - la - lb
                if lc < 0:
                    continue
                w = la * wa + lb * wb + lc * wc
                if w > best[row, column]:
                    best[row, column] = w
                    face_out[row, column] = f
                    barycentric_out[row, column, 0] = la * wa / w
                    barycentric_out[row, column, 1] = lb * wb / w
                    barycentric_out[row, column, 2] = lc * wc / w


def _fill_reference(pixels, inverse, faces, cull, face_out, barycentric_out, best):
    height, width = best.shape
    for f, corners in enumerate(faces):
        w = inverse[corners]
        (ax, ay), (bx, by), (cx, cy) = pixels[corners]
        area = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay)
        if (w <= 0).any() or area == 0 or (cull and area > 0):
            continue
        low = np.maximum(np.ceil(pixels[corners].min(0) - 0.5).astype(int), 0)
        high = np.minimum(
            np.floor(pixels[corners].max(0) - 0.5).astype(int), [width - 1, height - 1]
        )
        if (low > high).any():
            continue
        y, x = np.mgrid[low[1] : high[1] + 1, low[0] : high[0] + 1] + 0.5
        la = ((bx - x) * (cy - y) - (cx - x) * (by - y)) / area
        lb = ((cx - x) * (ay - y) - (ax - x) * (cy - y)) / area
        weights = np.stack([la, lb, 1.0 - la - lb], -1)
        depth = weights @ w
        window = (slice(low[1], high[1] + 1), slice(low[0], high[0] + 1))
        nearer = (weights >= 0).all(-1) & (depth > best[window])
        best[window][nearer] = depth[nearer]
        face_out[window][nearer] = f
        barycentric_out[window][nearer] = (weights * w / np.where(depth > 0, depth, 1)[..., None])[
            nearer
        ]


def _rasterize(fill, pixels, depth, faces, size, cull):
    height, width = size
    pixels = np.ascontiguousarray(pixels, np.float64)
    faces = np.ascontiguousarray(faces, np.int32)
    if depth is None:
        inverse = np.ones(len(pixels))
    else:
        depth = np.asarray(depth, np.float64)
        inverse = np.where(depth > 1e-6, 1 / np.where(depth > 1e-6, depth, 1), 0)
    face = np.full((height, width), -1, np.int32)
    barycentric = np.zeros((height, width, 3), np.float32)
    best = np.zeros((height, width))
    fill(pixels, inverse, faces, cull, face, barycentric, best)
    out = np.where(best > 0, 1 / np.where(best > 0, best, 1), np.inf).astype(np.float32)
    return Fragments(face, barycentric, out)


def rasterize(
    pixels: np.ndarray,
    depth: np.ndarray | None,
    faces: np.ndarray,
    size: tuple[int, int],
    cull: bool = False,
) -> Fragments:
    """Find the nearest face under each pixel centre.

    Args:
        pixels: [V, 2] projected vertices; for a texture atlas, uv times its size.
        depth: [V] mm in front of the camera (negative camera-space z), or None for a flat layout.
            Faces with a corner at or behind the camera are left out.
        faces: [F, 3] int.
        size: (H, W) pixels.
        cull: leave out faces that turn their back (clockwise on a right-handed screen).

    Returns:
        Fragments; of equally near faces the first in the list wins.
    """
    return _rasterize(_fill, pixels, depth, faces, size, cull)


def rasterize_reference(
    pixels: np.ndarray,
    depth: np.ndarray | None,
    faces: np.ndarray,
    size: tuple[int, int],
    cull: bool = False,
) -> Fragments:
    """`rasterize` in plain numpy, slow and clear."""
    return _rasterize(_fill_reference, pixels, depth, faces, size, cull)
