"""Inner loops of lashes, tear line and hair: what `cards` says, sample by sample.

They are laid together first, apart from the picture: what they add and what they let through, both
in sRGB. So the picture is mixed with them once a sample, however many lie over each other. The first
to be laid is the topmost one: what lies below many others is not looked at.
"""

import numpy as np

from bakery.geometry.color import to_encoded, to_linear
from bakery.runtime.kernels import jit
from bakery.runtime.raster_kernels import BLOCK, behind_all, inside

CLEAR = np.float32(1e-3)  # less of what is behind is not drawn: a quarter of a byte
ONE = np.float32(1)  # a plain 1 would make all that it meets twice as wide
STEPS = 4096
STEP = np.arange(STEPS + 1) / STEPS
ENCODED = to_encoded(STEP).astype(np.float32)  # between its entries within 2e-5
DECODED = to_linear(STEP).astype(np.float32)  # within 2e-7


@jit
def _looked_up(table: np.ndarray, value: np.float32) -> np.float32:
    place = min(max(value, np.float32(0)), np.float32(1)) * np.float32(STEPS)
    low = np.uint64(min(int(place), STEPS - 1))
    between: np.float32 = table[low] + (table[low + np.uint64(1)] - table[low]) * (
        place - np.float32(low)
    )
    return between


@jit
def encode(value: np.float32) -> np.float32:
    """Scene-linear to sRGB, one number; see `geometry.color`."""
    return _looked_up(ENCODED, value)


@jit
def decode(value: np.float32) -> np.float32:
    """sRGB to scene-linear, one number."""
    return _looked_up(DECODED, value)


def encoded(texture: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A card's texture as `lay_cards` wants it.

    Args:
        texture: [h, w, 4] float32 linear, colour multiplied by alpha.

    Returns:
        [h, w, 4] float32: sRGB multiplied by alpha, 0..1; and [h + 1, w + 1] bool: whether there is
        anything between the rows of texels i - 1 and i, and the columns j - 1 and j.
    """
    alpha = np.clip(texture[..., 3:], 0, 1)
    straight = texture[..., :3] / np.maximum(texture[..., 3:], 1e-6)
    some = np.pad(alpha[..., 0] > 0, 1)
    some = some[1:] | some[:-1]
    layer = np.concatenate([to_encoded(np.clip(straight, 0, 1)) * alpha, alpha], -1)
    return layer.astype(np.float32), some[:, 1:] | some[:, :-1]


@jit
def _lay_face(
    pixels: np.ndarray,
    inverse: np.ndarray,
    face: np.ndarray,
    corners: np.ndarray,
    weight: np.float32,
    texture: np.ndarray,
    some: np.ndarray,
    best: np.ndarray,
    bounds: tuple[int, int, int, int],
    out: np.ndarray,
) -> None:
    """One face of `lay_cards`; bounds: as in `behind_all`."""
    height, width = texture.shape[:2]
    a, b, c = face[0], face[1], face[2]
    ax, ay = pixels[a, 0], pixels[a, 1]
    bx, by = pixels[b, 0], pixels[b, 1]
    cx, cy = pixels[c, 0], pixels[c, 1]
    area = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay)
    if area == 0:
        return
    left, right = bounds[2], bounds[3]
    steps = ((by - cy) / area, (cy - ay) / area, (ay - by) / area)
    # Over depth, all that is linear on the face is linear in the picture.
    wa, wb, wc = inverse[a], inverse[b], inverse[c]
    further = steps[0] * wa + steps[1] * wb + steps[2] * wc
    # Counted from the middle of a texel before the first: as `some` is.
    u = ((corners[0, 0] + 0.5) * wa, (corners[1, 0] + 0.5) * wb, (corners[2, 0] + 0.5) * wc)
    v = ((corners[0, 1] + 0.5) * wa, (corners[1, 1] + 0.5) * wb, (corners[2, 1] + 0.5) * wc)
    u_further = steps[0] * u[0] + steps[1] * u[1] + steps[2] * u[2]
    v_further = steps[0] * v[0] + steps[1] * v[1] + steps[2] * v[2]
    x = left + 0.5
    for row in range(bounds[0], bounds[1] + 1):
        y = row + 0.5
        la = ((bx - x) * (cy - y) - (cx - x) * (by - y)) / area
        lb = ((cx - x) * (ay - y) - (ax - x) * (cy - y)) / area
        lc = 1 - la - lb
        first, last = inside((la, lb, lc), steps, right - left)
        near_first = la * wa + lb * wb + lc * wc
        u_first = la * u[0] + lb * u[1] + lc * u[2]
        v_first = la * v[0] + lb * v[1] + lc * v[2]
        here = np.uint64(row)
        for step in range(first, last + 1):
            column = np.uint64(left + step)
            near = near_first + step * further
            if near <= best[here, column]:
                continue
            through = ONE - out[here, column, 3]
            if through < CLEAR:
                continue
            depth = 1 / near
            across = min(max((u_first + step * u_further) * depth, 0.0), float(width))
            down = min(max((v_first + step * v_further) * depth, 0.0), float(height))
            i, j = int(down), int(across)
            if not some[np.uint64(i), np.uint64(j)]:
                continue
            s, t = np.float32(across - j), np.float32(down - i)
            i0, i1 = np.uint64(max(i - 1, 0)), np.uint64(min(i, height - 1))
            j0, j1 = np.uint64(max(j - 1, 0)), np.uint64(min(j, width - 1))
            laid = through * weight
            e = s * t * laid
            q, r = s * laid - e, t * laid - e
            p = laid - q - r - e
            for k in range(4):
                out[here, column, k] += (
                    p * texture[i0, j0, k] + q * texture[i0, j1, k]
                    + r * texture[i1, j0, k] + e * texture[i1, j1, k]
                )  # fmt: skip


@jit
def lay_cards(
    pixels: np.ndarray,
    inverse: np.ndarray,
    faces: np.ndarray,
    corners: np.ndarray,
    weights: np.ndarray,
    texture: np.ndarray,
    some: np.ndarray,
    best: np.ndarray,
    farthest: np.ndarray,
    touched: np.ndarray,
    out: np.ndarray,
) -> None:
    """Lay faces under those that were laid before, where nothing is before them.

    Args:
        pixels: [V, 2] float64; inverse: [V] 1/depth, 0 behind the camera.
        faces: [F, 3] int32, the topmost first; corners: [F, 3, 2] texels of `texture`, 0.5 the
            middle of the first.
        weights: [F] float32: how much of each face shows.
        texture, some: as `encoded` gives them.
        best, farthest: as from `raster_kernels.rasterize`.
        touched: [ceil(H n / BLOCK), ceil(W n / BLOCK)] bool, changed: the squares of `out` that
            hold anything; begin with none.
        out: [H n, W n, 4] float32, changed: sRGB of the faces, multiplied by alpha, and alpha.
    """
    height, width = best.shape
    for f in range(len(faces)):
        a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
        if min(inverse[a], inverse[b], inverse[c]) <= 0:
            continue
        (ax, ay), (bx, by), (cx, cy) = pixels[a], pixels[b], pixels[c]
        left = max(0, int(np.ceil(min(ax, bx, cx) - 0.5)))
        right = min(width - 1, int(np.floor(max(ax, bx, cx) - 0.5)))
        top = max(0, int(np.ceil(min(ay, by, cy) - 0.5)))
        bottom = min(height - 1, int(np.floor(max(ay, by, cy) - 0.5)))
        bounds = (top, bottom, left, right)
        near = max(inverse[a], inverse[b], inverse[c])
        if left > right or behind_all(near, farthest, bounds):
            continue
        for i in range(top // BLOCK, bottom // BLOCK + 1):
            for j in range(left // BLOCK, right // BLOCK + 1):
                if not touched[i, j]:
                    touched[i, j] = True
                    out[i * BLOCK : (i + 1) * BLOCK, j * BLOCK : (j + 1) * BLOCK] = 0
        _lay_face(
            pixels, inverse, faces[f], corners[f], weights[f], texture, some, best, bounds, out
        )


@jit
def keep_alpha(touched: np.ndarray, cards: np.ndarray, out: np.ndarray) -> None:
    """The alpha [H n, W n] of cards as `lay_cards` left them, 0 where none was laid."""
    out[:] = 0
    for i in range(touched.shape[0]):
        for j in range(touched.shape[1]):
            if touched[i, j]:
                rows = slice(i * BLOCK, (i + 1) * BLOCK)
                columns = slice(j * BLOCK, (j + 1) * BLOCK)
                out[rows, columns] = cards[rows, columns, 3]


@jit
def under(
    card: np.ndarray, red: np.float32, green: np.float32, blue: np.float32
) -> tuple[np.float32, np.float32, np.float32]:
    """A solid sample's colour, linear, as it is seen through cards [4]."""
    clear = ONE - card[3]
    return (
        decode(encode(red) * clear + card[0]),
        decode(encode(green) * clear + card[1]),
        decode(encode(blue) * clear + card[2]),
    )


@jit
def alone(card: np.ndarray) -> tuple[np.float32, np.float32, np.float32]:
    """Cards [4] with nothing behind: linear colour multiplied by alpha, which is not 0."""
    alpha = card[3]
    return (
        decode(card[0] / alpha) * alpha,
        decode(card[1] / alpha) * alpha,
        decode(card[2] / alpha) * alpha,
    )
