"""Inner loops of lashes, tear line and hair: what `cards` says, sample by sample.

They are laid together first, apart from the picture: what they add and what they let through, both
in sRGB. So the picture is mixed with them once a sample, however many lie over each other. The first
to be laid is the topmost one: what lies below many others is not looked at.
"""

import numpy as np

from bakery.geometry.color import to_encoded
from bakery.runtime.kernels import inside, jit

CLEAR = np.float32(1e-3)  # less alpha, or less of what is behind, is not drawn: a quarter of a byte


STEPS = 4096
ENCODED = to_encoded(np.arange(STEPS + 1) / STEPS)  # between its entries within 2e-5


@jit
def encode(value: np.float32) -> np.float32:
    """Scene-linear to sRGB, one number; see `geometry.color`."""
    place = min(max(value, np.float32(0)), np.float32(1)) * np.float32(STEPS)
    low = min(int(place), STEPS - 1)
    between: np.float32 = ENCODED[low] + (ENCODED[low + 1] - ENCODED[low]) * (place - low)
    return between


@jit
def decode(value: np.float32) -> np.float32:
    """sRGB to scene-linear, one number."""
    if value <= np.float32(0.04045):
        return value / np.float32(12.92)
    return ((value + np.float32(0.055)) / np.float32(1.055)) ** np.float32(2.4)


@jit
def clear(out: np.ndarray, samples: int, box: tuple[int, int, int, int]) -> None:
    """Nothing but what is behind, inside the box of a picture; see `lay_cards`."""
    for row in range(box[0] * samples, box[1] * samples):
        for column in range(box[2] * samples, box[3] * samples):
            out[row, column, 0] = out[row, column, 1] = out[row, column, 2] = 0
            out[row, column, 3] = out[row, column, 4] = 1


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
    height, width = texture.shape[:2]
    for f in range(len(faces)):
        a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
        wa, wb, wc = inverse[a], inverse[b], inverse[c]
        if wa <= 0 or wb <= 0 or wc <= 0:
            continue
        ax, ay = pixels[a, 0], pixels[a, 1]
        bx, by = pixels[b, 0], pixels[b, 1]
        cx, cy = pixels[c, 0], pixels[c, 1]
        area = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay)
        if area == 0:
            continue
        left = max(box[2] * samples, int(np.ceil(min(ax, bx, cx) - 0.5)))
        right = min(box[3] * samples - 1, int(np.floor(max(ax, bx, cx) - 0.5)))
        top = max(box[0] * samples, int(np.ceil(min(ay, by, cy) - 0.5)))
        bottom = min(box[1] * samples - 1, int(np.floor(max(ay, by, cy) - 0.5)))
        if left > right:
            continue
        steps = ((by - cy) / area, (cy - ay) / area, (ay - by) / area)
        x = left + 0.5
        for row in range(top, bottom + 1):
            y = row + 0.5
            la = ((bx - x) * (cy - y) - (cx - x) * (by - y)) / area
            lb = ((cx - x) * (ay - y) - (ax - x) * (cy - y)) / area
            lc = 1 - la - lb
            first, last = inside((la, lb, lc), steps, right - left)
            for step in range(first, last + 1):
                column = np.uint64(left + step)
                through = out[row, column, 3]
                if through < CLEAR:
                    continue
                a_share = (la + step * steps[0]) * wa
                b_share = (lb + step * steps[1]) * wb
                c_share = (lc + step * steps[2]) * wc
                near = a_share + b_share + c_share
                if near <= best[row, column]:
                    continue
                a_share, b_share, c_share = a_share / near, b_share / near, c_share / near
                u = (
                    a_share * corners[f, 0, 0]
                    + b_share * corners[f, 1, 0]
                    + c_share * corners[f, 2, 0]
                )
                v = (
                    a_share * corners[f, 0, 1]
                    + b_share * corners[f, 1, 1]
                    + c_share * corners[f, 2, 1]
                )
                u, v = u - 0.5, v - 0.5
                i, j = int(np.floor(v)), int(np.floor(u))
                s, t = np.float32(u - j), np.float32(v - i)
                i0, i1 = min(max(i, 0), height - 1), min(max(i + 1, 0), height - 1)
                j0, j1 = min(max(j, 0), width - 1), min(max(j + 1, 0), width - 1)
                p, q = (1 - s) * (1 - t), s * (1 - t)
                r, e = (1 - s) * t, s * t
                opacity = (
                    p * texture[i0, j0, 3] + q * texture[i0, j1, 3]
                    + r * texture[i1, j0, 3] + e * texture[i1, j1, 3]
                )  # fmt: skip
                if opacity < CLEAR:
                    continue
                whole, opacity = opacity, min(opacity, np.float32(1)) * weights[f]
                for k in range(3):
                    own = (
                        p * texture[i0, j0, k] + q * texture[i0, j1, k]
                        + r * texture[i1, j0, k] + e * texture[i1, j1, k]
                    )  # fmt: skip
                    out[row, column, k] += through * opacity * encode(own / whole)
                out[row, column, 3] = through * (1 - opacity)
                if hides:
                    out[row, column, 4] *= 1 - opacity


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
