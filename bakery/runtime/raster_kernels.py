"""Inner loops of the fast player: which face each sample sees, sample by sample."""

import numpy as np

from bakery.runtime.kernels import jit

BLOCK = 16  # samples on a side of the squares in which a face may be behind all that is seen
ROUNDING = 1e-9  # columns: a pixel on the edge of two faces must not be missed by both


@jit
def reach(
    pixels: np.ndarray, inverse: np.ndarray, samples: int, height: int, width: int
) -> tuple[int, int, int, int]:
    """The box of a picture that the points in front of the camera span; see `rasterize`."""
    top, bottom, left, right = np.inf, -np.inf, np.inf, -np.inf
    for v in range(len(pixels)):
        if inverse[v] > 0:
            left, right = min(left, pixels[v, 0]), max(right, pixels[v, 0])
            top, bottom = min(top, pixels[v, 1]), max(bottom, pixels[v, 1])
    return (
        int(min(max(top // samples, 0), height)), int(min(max(bottom // samples + 1, 0), height)),
        int(min(max(left // samples, 0), width)), int(min(max(right // samples + 1, 0), width)),
    )  # fmt: skip


@jit
def inside(
    at: tuple[float, float, float], steps: tuple[float, float, float], count: int
) -> tuple[int, int]:
    """The first and the last column, from 0 to `count`, at which no barycentric weight is below 0.

    Args:
        at: the three weights at column 0; steps: what a column adds to each.
    """
    first, last = 0.0, float(count)
    for value, step in zip(at, steps):
        if step > 0:
            first = max(first, np.ceil(-value / step - ROUNDING))
        elif step < 0:
            last = min(last, np.floor(-value / step + ROUNDING))
        elif value < 0:
            last = -1.0
    return int(first), int(last)


@jit
def rasterize(
    pixels: np.ndarray,
    inverse: np.ndarray,
    faces: np.ndarray,
    late: int,
    samples: int,
    face_out: np.ndarray,
    best: np.ndarray,
    farthest: np.ndarray,
) -> tuple[int, int, int, int]:
    """Nearest face under each pixel centre; `geometry.raster` with backs left out.

    Args:
        pixels: [V, 2] float64; inverse: [V] 1/depth, 0 behind the camera.
        faces: [F, 3] int32; those from `late` on are mostly hidden, and looked for behind the others.
        samples: n, per pixel and axis of the picture.
        face_out: [H n, W n] int32, written inside the box: -1 for none.
        best: [H n, W n] float32: 1/depth of what is nearest, written inside the box.
        farthest: [ceil(H n / BLOCK), ceil(W n / BLOCK)] float32, written: no more than the least of
            `best` in each square, inf outside the box.

    Returns:
        box: (top, bottom, left, right) of the picture, pixels; all faces lie inside.
    """
    height, width = best.shape
    box = reach(pixels, inverse, samples, height // samples, width // samples)
    for row in range(box[0] * samples, box[1] * samples):
        best[row, box[2] * samples : box[3] * samples] = 0
        face_out[row, box[2] * samples : box[3] * samples] = -1
    farthest[:] = 0
    _draw_faces(pixels, inverse, faces, 0, late, farthest, face_out, best)
    farthest[:] = np.inf
    for row in range(box[0] * samples, box[1] * samples):
        here = farthest[row // BLOCK]
        for column in range(box[2] * samples, box[3] * samples):
            block = np.uint64(column // BLOCK)
            here[block] = min(here[block], best[row, column])
    _draw_faces(pixels, inverse, faces, late, len(faces), farthest, face_out, best)
    return box


@jit
def behind_all(near: float, farthest: np.ndarray, bounds: tuple[int, int, int, int]) -> bool:
    """Whether nothing of a face can be seen.

    Args:
        near: 1/depth of its nearest corner; farthest: as from `rasterize`.
        bounds: (top, bottom, left, right): the first and last rows and columns that it may cover.
    """
    for i in range(bounds[0] // BLOCK, bounds[1] // BLOCK + 1):
        for j in range(bounds[2] // BLOCK, bounds[3] // BLOCK + 1):
            if near > farthest[i, j]:
                return False
    return True


@jit
def _draw_faces(
    pixels: np.ndarray,
    inverse: np.ndarray,
    faces: np.ndarray,
    begin: int,
    end: int,
    farthest: np.ndarray,
    face_out: np.ndarray,
    best: np.ndarray,
) -> None:
    """The faces of `rasterize` from `begin` to before `end`."""
    height, width = best.shape
    for f in range(begin, end):
        a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
        wa, wb, wc = inverse[a], inverse[b], inverse[c]
        if wa <= 0 or wb <= 0 or wc <= 0:
            continue
        ax, ay = pixels[a, 0], pixels[a, 1]
        bx, by = pixels[b, 0], pixels[b, 1]
        cx, cy = pixels[c, 0], pixels[c, 1]
        area = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay)
        if area >= 0:
            continue
        left = max(0, int(np.ceil(min(ax, bx, cx) - 0.5)))
        right = min(width - 1, int(np.floor(max(ax, bx, cx) - 0.5)))
        top = max(0, int(np.ceil(min(ay, by, cy) - 0.5)))
        bottom = min(height - 1, int(np.floor(max(ay, by, cy) - 0.5)))
        if left > right or behind_all(max(wa, wb, wc), farthest, (top, bottom, left, right)):
            continue
        scale = 1.0 / area
        la_x, lb_x = (by - cy) * scale, (cy - ay) * scale
        w_x = la_x * (wa - wc) + lb_x * (wb - wc)
        steps = (la_x, lb_x, -la_x - lb_x)
        x = left + 0.5
        for row in range(top, bottom + 1):
            y = row + 0.5
            la = ((bx - x) * (cy - y) - (cx - x) * (by - y)) * scale
            lb = ((cx - x) * (ay - y) - (ax - x) * (cy - y)) * scale
            first, last = inside((la, lb, 1.0 - la - lb), steps, right - left)
            w = wc + la * (wa - wc) + lb * (wb - wc)
            for column in range(first, last + 1):
                near = np.float32(w + column * w_x)
                if near > best[row, left + column]:
                    best[row, left + column] = near
                    face_out[row, left + column] = f


@jit
def needed_tiles(
    face: np.ndarray,
    box: tuple[int, int, int, int],
    samples: int,
    tile_start: np.ndarray,
    tile_list: np.ndarray,
    seen: np.ndarray,
    needed: np.ndarray,
) -> None:
    """Mark the tiles that visible faces touch.

    Args:
        face, box: as from `rasterize`.
        tile_start: [F + 1], tile_list: [...]: the tiles of face f are tile_list[start[f]:start[f+1]].
        seen: [F] bool, scratch; needed: [tiles] bool, written.
    """
    seen[:] = False
    needed[:] = False
    for row in range(box[0] * samples, box[1] * samples):
        for column in range(box[2] * samples, box[3] * samples):
            f = face[row, column]
            if f >= 0:
                seen[f] = True
    for f in range(len(seen)):
        if seen[f]:
            for k in range(tile_start[f], tile_start[f + 1]):
                needed[tile_list[k]] = True
