"""Inner loops of lashes, tear line and hair: what `cards` says, sample by sample.

They are laid together first, apart from the picture: what they add and what they let through, both
in sRGB. So the picture is mixed with them once a sample, however many lie over each other. The first
to be laid is the topmost one: what lies below many others is not looked at.
"""

import numpy as np

from bakery.geometry.color import to_encoded, to_linear
from bakery.runtime.kernels import inside, jit

CLEAR = np.float32(1e-3)  # less alpha, or less of what is behind, is not drawn: a quarter of a byte


TILE = 16  # samples on a side of the squares in which a face may be behind all that is seen
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


@jit
def clear(out: np.ndarray, samples: int, box: tuple[int, int, int, int]) -> None:
    """Nothing but what is behind, inside the box of a picture; see `lay_cards`."""
    for row in range(box[0] * samples, box[1] * samples):
        for column in range(box[2] * samples, box[3] * samples):
            out[row, column, 0] = out[row, column, 1] = out[row, column, 2] = 0
            out[row, column, 3] = out[row, column, 4] = 1


@jit
def _lay_face(
    pixels: np.ndarray,
    inverse: np.ndarray,
    face: np.ndarray,
    corners: np.ndarray,
    weight: np.float32,
    texture: np.ndarray,
    best: np.ndarray,
    bounds: tuple[int, int, int, int],
    hides: bool,
    out: np.ndarray,
) -> None:
    """One face of `lay_cards`.

    Args:
        bounds: (top, bottom, left, right): the first and last rows and columns that it may cover.
    """
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
    u = (corners[0, 0] * wa, corners[1, 0] * wb, corners[2, 0] * wc)
    v = (corners[0, 1] * wa, corners[1, 1] * wb, corners[2, 1] * wc)
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
            through = out[here, column, 3]
            if through < CLEAR:
                continue
            depth = 1 / near
            across = (u_first + step * u_further) * depth - 0.5
            down = (v_first + step * v_further) * depth - 0.5
            i, j = int(np.floor(down)), int(np.floor(across))
            s, t = np.float32(across - j), np.float32(down - i)
            i0 = np.uint64(min(max(i, 0), height - 1))
            i1 = np.uint64(min(max(i + 1, 0), height - 1))
            j0 = np.uint64(min(max(j, 0), width - 1))
            j1 = np.uint64(min(max(j + 1, 0), width - 1))
            q, e = s - s * t, s * t
            p, r = 1 - t - q, t - e
            whole = (
                p * texture[i0, j0, 3] + q * texture[i0, j1, 3]
                + r * texture[i1, j0, 3] + e * texture[i1, j1, 3]
            )  # fmt: skip
            if whole < CLEAR:
                continue
            opacity = min(whole, np.float32(1)) * weight
            straight, laid = np.float32(1) / whole, through * opacity
            for k in range(3):
                own = (
                    p * texture[i0, j0, k] + q * texture[i0, j1, k]
                    + r * texture[i1, j0, k] + e * texture[i1, j1, k]
                )  # fmt: skip
                out[here, column, k] += laid * encode(own * straight)
            out[here, column, 3] = through * (1 - opacity)
            if hides:
                out[here, column, 4] *= 1 - opacity


@jit
def lay_cards(
    pixels: np.ndarray,
    inverse: np.ndarray,
    faces: np.ndarray,
    corners: np.ndarray,
    weights: np.ndarray,
    texture: np.ndarray,
    best: np.ndarray,
    samples: int,
    box: tuple[int, int, int, int],
    hides: bool,
    out: np.ndarray,
) -> None:
    """Lay faces under those that were laid before, where nothing is before them.

    Args:
        pixels: [V, 2] float64; inverse: [V] 1/depth, 0 behind the camera.
        faces: [F, 3] int32, the topmost first; corners: [F, 3, 2] texels of `texture`, 0.5 the
            middle of the first.
        weights: [F] float32: how much of each face shows.
        texture: [h, w, 4] float32 linear, colour multiplied by alpha.
        best: [H n, W n] float32: 1/depth of what is nearest, from `kernels.rasterize`.
        box: (top, bottom, left, right) of the picture that the faces may cover.
        hides: whether the photo's face is hidden by them: hair, not lashes.
        out: [H n, W n, 5] float32, changed inside the box: sRGB of the faces, multiplied by alpha,
            the share of what is behind that comes through, and that of those that hide alone;
            begin with `clear`.
    """
    farthest = _farthest(best, samples, box)
    for f in range(len(faces)):
        a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
        near, least = (
            max(inverse[a], inverse[b], inverse[c]),
            min(inverse[a], inverse[b], inverse[c]),
        )
        if least <= 0:
            continue
        (ax, ay), (bx, by), (cx, cy) = pixels[a], pixels[b], pixels[c]
        left = max(box[2] * samples, int(np.ceil(min(ax, bx, cx) - 0.5)))
        right = min(box[3] * samples - 1, int(np.floor(max(ax, bx, cx) - 0.5)))
        top = max(box[0] * samples, int(np.ceil(min(ay, by, cy) - 0.5)))
        bottom = min(box[1] * samples - 1, int(np.floor(max(ay, by, cy) - 0.5)))
        if left > right or top > bottom:
            continue
        tiles = farthest[top // TILE : bottom // TILE + 1, left // TILE : right // TILE + 1]
        if near > tiles.min():
            _lay_face(
                pixels, inverse, faces[f], corners[f], weights[f], texture, best,
                (top, bottom, left, right), hides, out,
            )  # fmt: skip


@jit
def _farthest(best: np.ndarray, samples: int, box: tuple[int, int, int, int]) -> np.ndarray:
    """The least of `best` in each square of TILE samples that the box touches; see `lay_cards`.

    A face that is farther than all of it there, as most on the back of a head, is not looked at.
    """
    found = np.full((best.shape[0] // TILE + 1, best.shape[1] // TILE + 1), np.float32(np.inf))
    for row in range(box[0] * samples, box[1] * samples):
        for column in range(box[2] * samples, box[3] * samples):
            tile = row // TILE, column // TILE
            found[tile] = min(found[tile], best[row, column])
    return found


@jit
def under(
    card: np.ndarray, red: np.float32, green: np.float32, blue: np.float32
) -> tuple[np.float32, np.float32, np.float32]:
    """A solid sample's colour, linear, as it is seen through cards [5]."""
    clear = card[3]
    return (
        decode(encode(red) * clear + card[0]),
        decode(encode(green) * clear + card[1]),
        decode(encode(blue) * clear + card[2]),
    )


@jit
def alone(card: np.ndarray) -> tuple[np.float32, np.float32, np.float32, np.float32]:
    """Cards [5] with nothing behind: colour multiplied by alpha, and alpha."""
    opacity = 1 - card[3]
    return (
        decode(card[0] / opacity) * opacity,
        decode(card[1] / opacity) * opacity,
        decode(card[2] / opacity) * opacity,
        opacity,
    )
