"""A head with hair, drawn plainly: what measures hair looks at."""

import numba
import numpy as np

from bakery.geometry import camera as cameras
from bakery.geometry.color import to_encoded
from bakery.geometry.raster import rasterize
from bakery.geometry.sample import bilinear, interpolate
from bakery.types import Camera, HairMesh


def draw_hair(
    color: np.ndarray, depth: np.ndarray, mesh: HairMesh, camera: Camera, level: int = 0
) -> tuple[np.ndarray, np.ndarray]:
    """Lay hair over a picture.

    Args:
        color: [H, W, 3] float32 sRGB-encoded picture of the head.
        depth: [H, W] mm to it, inf where it is not.
        level: of detail.

    Returns:
        [H, W, 3] float32 sRGB-encoded, and [H, W] float32: how much of a pixel hair covers.
    """
    points = cameras.to_camera(mesh.vertices.astype(float), camera)
    pixels, distance = cameras.project_camera(points, camera), -points[:, 2]
    shown = mesh.shown(level)
    texture = mesh.texture.astype(np.float32)
    cap = mesh.faces[shown & (mesh.kind == 0)]
    found = rasterize(pixels, distance, cap, color.shape[:2], cull=True)
    hit = found.depth < depth
    uv = (
        interpolate(found, mesh.uv[cap].astype(np.float32))
        if len(cap)
        else np.zeros((*hit.shape, 2))
    )
    own = to_encoded(bilinear(texture[..., :3], uv * len(texture)))
    color = np.where(hit[..., None], own, color).astype(np.float32)
    nearest = np.where(hit, found.depth, depth).astype(np.float64)
    alpha = hit.astype(np.float32)
    faces = np.flatnonzero(shown & (mesh.kind > 0))
    if len(faces):
        middle = distance[mesh.faces[faces]].mean(1)
        numbers = mesh.card[faces]
        total = np.bincount(numbers, middle) / np.maximum(np.bincount(numbers), 1)
        order = faces[np.argsort(-total[numbers], kind="stable")]
        _lay(
            pixels, np.where(distance > 1, 1 / np.maximum(distance, 1), 0.0), mesh.faces[order],
            (mesh.uv * len(texture)).astype(np.float64), texture, nearest, color, alpha,
        )  # fmt: skip
    return color, alpha


@numba.njit(cache=True, nogil=True)
def _encode(value):
    value = min(max(value, 0.0), 1.0)
    return value * 12.92 if value <= 0.0031308 else 1.055 * value ** (1 / 2.4) - 0.055


@numba.njit(cache=True, nogil=True)
def _lay(pixels, inverse, faces, uv, texture, depth, color, alpha):
    height, width = depth.shape
    size = texture.shape[0]
    for n in range(len(faces)):
        a, b, c = faces[n]
        wa, wb, wc = inverse[a], inverse[b], inverse[c]
        if wa <= 0 or wb <= 0 or wc <= 0:
            continue
        ax, ay = pixels[a]
        bx, by = pixels[b]
        cx, cy = pixels[c]
        area = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay)
        if area == 0:
            continue
        left = max(0, int(np.ceil(min(ax, bx, cx) - 0.5)))
        right = min(width - 1, int(np.floor(max(ax, bx, cx) - 0.5)))
        top = max(0, int(np.ceil(min(ay, by, cy) - 0.5)))
        bottom = min(height - 1, int(np.floor(max(ay, by, cy) - 0.5)))
        for row in range(top, bottom + 1):
            for column in range(left, right + 1):
                x, y = column + 0.5, row + 0.5
                la = ((bx - x) * (cy - y) - (cx - x) * (by - y)) / area
                lb = ((cx - x) * (ay - y) - (ax - x) * (cy - y)) / area
                lc = 1 - la - lb
                if la < 0 or lb < 0 or lc < 0:
                    continue
                la, lb, lc = la * wa, lb * wb, lc * wc
                near = la + lb + lc
                if 1 / near >= depth[row, column]:
                    continue
                u = (la * uv[a, 0] + lb * uv[b, 0] + lc * uv[c, 0]) / near - 0.5
                v = (la * uv[a, 1] + lb * uv[b, 1] + lc * uv[c, 1]) / near - 0.5
                i, j = int(np.floor(v)), int(np.floor(u))
                s, t = u - j, v - i
                i0, i1 = min(max(i, 0), size - 1), min(max(i + 1, 0), size - 1)
                j0, j1 = min(max(j, 0), size - 1), min(max(j + 1, 0), size - 1)
                p, q, r, e = (1 - s) * (1 - t), s * (1 - t), (1 - s) * t, s * t
                opacity = (
                    p * texture[i0, j0, 3] + q * texture[i0, j1, 3]
                    + r * texture[i1, j0, 3] + e * texture[i1, j1, 3]
                )  # fmt: skip
                if opacity < 1e-3:
                    continue
                share = min(opacity, 1.0)
                for k in range(3):
                    own = (
                        p * texture[i0, j0, k] + q * texture[i0, j1, k]
                        + r * texture[i1, j0, k] + e * texture[i1, j1, k]
                    )  # fmt: skip
                    color[row, column, k] += share * (
                        _encode(own / opacity) - color[row, column, k]
                    )
                alpha[row, column] += share * (1 - alpha[row, column])
