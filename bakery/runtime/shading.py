"""The last loops of the fast player: from visible faces to colours, and to bytes."""

import numpy as np

from bakery.runtime.card_kernels import CLEAR, ONE, alone, under
from bakery.runtime.hair_cards import FAINT
from bakery.runtime.kernels import jit, place_on
from bakery.runtime.raster_kernels import BLOCK

TONGUE = 4  # a kind of face: on the skin's texture, but no skin that a photo may not know
CAP = 5  # another: opaque hair, on a texture that is multiplied by alpha
LEAST_ALPHA = np.float32(FAINT)


@jit
def shade(
    face: np.ndarray, box: tuple[int, int, int, int], samples: int, kind: np.ndarray, planes: np.ndarray, texels: np.ndarray, places: np.ndarray, whole: bool, cards: np.ndarray, touched: np.ndarray, hiding: np.ndarray, hair: bool, out: np.ndarray, alpha: np.ndarray
) -> None:  # fmt: skip
    """Colour the picture from what each of its samples sees, and average them.

    Args:
        face: [H n, W n] int32, n = samples; box: as from `rasterize`.
        kind: [F] uint8: 0 skin, 1 mouth proxy, 2 left and 3 right eye proxy, 4 tongue, 5 hair's cap.
        planes: [F, 9], as from `texture_planes`.
        texels: [..., 4] float32: all textures, one behind the other; a fourth channel makes a texel
            16 bytes, which are read at once.
        places: [kinds, 3] int64: where each texture begins, its width and height.
        whole: whether the fourth channel is wanted.
        cards: [H n, W n, 4] float32, as from `card_kernels.lay_cards`, in the squares that are
            touched; one lies on whole pixels.
        hiding: [H n, W n] float32, read if `whole`: how much of a photo's face those cards hide
            that do, hair and not lashes.
        hair: whether the cap and `cards` alone are coloured.
        out: [H, W, 4] float32, written: linear, premultiplied by alpha.
        alpha: [H, W] float32, written.
    """
    out[:] = 0
    alpha[:] = 0
    weigh = np.float32(1 / (samples * samples))
    for row in range(box[0], box[1]):
        for column in range(box[2], box[3]):
            red = green = blue = known = hits = np.float32(0)
            laid = touched[row * samples // BLOCK, column * samples // BLOCK]
            for y in range(row * samples, (row + 1) * samples):
                for x in range(column * samples, (column + 1) * samples):
                    # Unsigned: numba looks whether a signed index counts from the end.
                    here, there = np.uint64(y), np.uint64(x)
                    f = face[here, there]
                    over = cards[here, there, 3] if laid else np.float32(0)
                    hides = hiding[here, there] if whole else np.float32(0)
                    solid = f >= 0 and (not hair or kind[np.uint64(f)] == CAP)
                    if over > ONE - CLEAR or (over > 0 and not solid):
                        r, g, b = alone(cards[here, there])
                        red, green, blue = red + r, green + g, blue + b
                        known += over - hides
                        hits += over * weigh
                        continue
                    if not solid:
                        continue
                    which = np.uint64(kind[np.uint64(f)])
                    start, width, height = places[which, 0], places[which, 1], places[which, 2]
                    left, right, top, bottom, s, t = place_on(
                        y, x, np.uint64(f), planes, width, height
                    )
                    top, bottom = start + top * width, start + bottom * width
                    q, e = s - s * t, s * t
                    p, n = ONE - t - q, t - e
                    i, j = np.uint64(top + left), np.uint64(top + right)
                    k, m = np.uint64(bottom + left), np.uint64(bottom + right)
                    r = p * texels[i, 0] + q * texels[j, 0] + n * texels[k, 0] + e * texels[m, 0]
                    g = p * texels[i, 1] + q * texels[j, 1] + n * texels[k, 1] + e * texels[m, 1]
                    b = p * texels[i, 2] + q * texels[j, 2] + n * texels[k, 2] + e * texels[m, 2]
                    if which == CAP:
                        a = (
                            p * texels[i, 3]
                            + q * texels[j, 3]
                            + n * texels[k, 3]
                            + e * texels[m, 3]
                        )
                        gain = 1 / max(a, LEAST_ALPHA)
                        r, g, b = r * gain, g * gain, b * gain
                    if over > 0:
                        r, g, b = under(cards[here, there], r, g, b)
                    red, green, blue = red + r, green + g, blue + b
                    if whole and which == TONGUE:
                        known += 1 - hides
                    elif whole and which < TONGUE:
                        known += (1 - hides) * (
                            p * texels[i, 3]
                            + q * texels[j, 3]
                            + n * texels[k, 3]
                            + e * texels[m, 3]
                        )
                    hits += weigh
            out[row, column, 0], out[row, column, 1] = red * weigh, green * weigh
            out[row, column, 2], out[row, column, 3] = blue * weigh, known * weigh
            alpha[row, column] = hits


@jit
def encode_over(
    color: np.ndarray, alpha: np.ndarray, gray: np.float32, table: np.ndarray, out: np.ndarray
) -> None:
    """Linear colour over plain grey as sRGB bytes.

    Args:
        color: [H, W, 4] float32 premultiplied; alpha: [H, W]; gray: linear.
        table: [n] uint8: sRGB byte of k / (n - 1) linear.
        out: [H, W, 3] uint8, written.
    """
    last = np.float32(len(table) - 1)
    for row in range(color.shape[0]):
        for column in range(color.shape[1]):
            rest = gray * (1 - alpha[row, column])
            for c in range(3):
                value = min(max(color[row, column, c] + rest, np.float32(0)), np.float32(1))
                out[row, column, c] = table[int(value * last + np.float32(0.5))]
