"""Inner loops of the fast player: what `render`, `blend` and `mouth` say, texel by texel.

Which face is seen where, what lies over the head, and the last loop of all stand in
`raster_kernels`, `card_kernels` and `shading`.

Each compiles once with numba and is kept on disk; none holds the interpreter's lock, so that frames
are drawn side by side in threads.
"""

import numba
import numpy as np

jit = numba.njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "arcp", "nsz"})
TILE = 16  # texels on a side of the squares that are blended or left alone
LEAST = np.float32(1e-4)  # weights below change no byte


@jit
def deform(rest: np.ndarray, basis: np.ndarray, expression: np.ndarray, out: np.ndarray) -> None:
    """rest [3 v] + expression [E] @ basis [E, 3 v], float32, into out [3 v]."""
    out[:] = rest
    for e in range(len(expression)):
        weight = expression[e]
        if weight != 0:
            row = basis[e]
            for n in range(len(out)):
                out[n] += weight * row[n]


@jit
def blend_tiles(
    needed: np.ndarray,
    textures: np.ndarray,
    unit: np.float32,
    masks: np.ndarray,
    start: np.ndarray,
    which: np.ndarray,
    place: np.ndarray,
    share: np.ndarray,
    product: np.ndarray,
    plain: np.ndarray,
    out: np.ndarray,
) -> None:
    """Equation 4 on the visible tiles; see `blend.face_texture`.

    All that a tile needs lies together: without that, fetching masks and textures took twice as long
    as working with them.

    Args:
        needed: [tiles] bool.
        textures: [tiles, 1 + K, 3, TILE TILE] uint16, the neutral one first; times unit.
        masks: [n, r r] float32: the masks around each tile, those alone that are felt there.
        start: [tiles + 1]: masks start[t]:start[t + 1] belong to tile t.
        which: [n] into E: whose mask it is.
        place: [T] int32, share: [T] float32: along either axis, texel x lies between the mask texels
            place[x] and place[x] + 1 of its tile's masks, at this share.
        product: [K, E] float32: a_e^k a_e^t.
        plain: [tiles] bool: whether out holds the neutral texture there; kept from frame to frame.
        out: [T, T, 4] float32, the first three written where needed.
    """
    keys, size, area = product.shape[0], out.shape[0], masks.shape[1]
    reach = int(np.sqrt(area) + 0.5)
    across = (size + TILE - 1) // TILE
    weight, total = np.empty((1 + keys, area), np.float32), np.empty(area, np.float32)
    wide, fine = np.empty((reach, TILE), np.float32), np.empty(TILE * TILE, np.float32)
    color, used = np.empty((3, TILE * TILE), np.float32), np.empty(1 + keys, np.bool_)
    low, part = np.zeros(TILE, np.uint32), np.zeros(TILE, np.float32)
    for tile in range(len(needed)):
        if not needed[tile]:
            continue
        top, left = tile // across * TILE, tile % across * TILE
        rows, columns = min(TILE, size - top), min(TILE, size - left)
        used[:] = False
        for n in range(start[tile], start[tile + 1]):
            for k in range(keys):
                factor = product[k, which[n]]
                if factor > LEAST:
                    if not used[1 + k]:
                        weight[1 + k] = 0
                    used[1 + k] = True
                    for m in range(area):
                        weight[1 + k, m] += factor * masks[n, m]
        still = not used.any()
        if still and plain[tile]:
            continue
        plain[tile], used[0], total[:] = still, True, 0
        for k in range(1, 1 + keys):
            if used[k]:
                for m in range(area):
                    total[m] += weight[k, m]
        for m in range(area):
            weight[0, m] = max(np.float32(0), 1 - total[m])
            total[m] = unit / max(weight[0, m] + total[m], np.float32(1e-6))
        for column in range(columns):
            low[column], part[column] = place[left + column], share[left + column]
        color[:] = 0
        for k in range(1 + keys):
            if not used[k]:
                continue
            for m in range(area):
                weight[k, m] *= total[m]
            for i in range(reach):
                line = weight[k, i * reach : (i + 1) * reach]
                for column in range(TILE):
                    j = low[column]
                    wide[i, column] = line[j] + (line[j + np.uint32(1)] - line[j]) * part[column]
            for row in range(rows):
                i, down = place[top + row], share[top + row]
                for column in range(TILE):
                    w = wide[i, column] + (wide[i + 1, column] - wide[i, column]) * down
                    fine[row * TILE + column] = w
            for c in range(3):
                for n in range(TILE * TILE):
                    color[c, n] += fine[n] * np.float32(textures[tile, k, c, n])
        for row in range(rows):
            for column in range(columns):
                n = row * TILE + column
                target = out[top + row, left + column]
                target[0], target[1], target[2] = color[0, n], color[1, n], color[2, n]


@jit
def texture_planes(
    seen: np.ndarray,
    pixels: np.ndarray,
    inverse: np.ndarray,
    faces: np.ndarray,
    corners: np.ndarray,
    kind: np.ndarray,
    slides: np.ndarray,
    planes: np.ndarray,
) -> None:
    """What turns a sample's centre into a place on the texture: u/w, v/w and 1/w are planes.

    Args:
        seen: [F] bool: the visible faces.
        corners: [F, 3, 2] texels; 0 is a border, 0.5 the middle of the first.
        kind: [F] uint8; slides: [kinds, 2] texels that each texture moves right and down.
        planes: [F, 9] float64, written: constant, per column and per row of u/w, v/w, 1/w.
    """
    for f in range(len(faces)):
        if not seen[f]:
            continue
        a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
        ax, ay = pixels[a, 0], pixels[a, 1]
        bx, by = pixels[b, 0] - ax, pixels[b, 1] - ay
        cx, cy = pixels[c, 0] - ax, pixels[c, 1] - ay
        scale = 1.0 / (bx * cy - cx * by)
        for n in range(3):
            va, vb, vc = inverse[a], inverse[b], inverse[c]
            if n < 2:
                shift = slides[kind[f], n] + 0.5
                va *= corners[f, 0, n] - shift
                vb *= corners[f, 1, n] - shift
                vc *= corners[f, 2, n] - shift
            vb -= va
            vc -= va
            along = (vb * cy - vc * by) * scale
            down = (vc * bx - vb * cx) * scale
            planes[f, 3 * n] = va + along * (0.5 - ax) + down * (0.5 - ay)
            planes[f, 3 * n + 1] = along
            planes[f, 3 * n + 2] = down


@jit
def place_on(
    row: float, column: float, f: int | np.uint64, planes: np.ndarray, width: int, height: int
) -> tuple[int, int, int, int, np.float32, np.float32]:
    """The texels around the place on its texture that a sample sees.

    Returns:
        left, right, top, bottom; the shares of the right and of the bottom.
    """
    whole = 1.0 / (planes[f, 6] + planes[f, 7] * column + planes[f, 8] * row)
    u = (planes[f, 0] + planes[f, 1] * column + planes[f, 2] * row) * whole
    v = (planes[f, 3] + planes[f, 4] * column + planes[f, 5] * row) * whole
    low_u, low_v = np.floor(u), np.floor(v)
    left, top = int(low_u), int(low_v)
    right, bottom = min(max(left + 1, 0), width - 1), min(max(top + 1, 0), height - 1)
    left, top = min(max(left, 0), width - 1), min(max(top, 0), height - 1)
    return left, right, top, bottom, np.float32(u - low_u), np.float32(v - low_v)


@jit
def mark_texels(
    face: np.ndarray,
    box: tuple[int, int, int, int],
    samples: int,
    kind: np.ndarray,
    which: int,
    planes: np.ndarray,
    marks: np.ndarray,
) -> int:
    """Mark the texels [h, w] of one proxy that are visible; returns how many samples see it.

    The box need not be larger than the proxy.
    """
    marks[:] = False
    height, width = marks.shape
    count = 0
    for row in range(box[0] * samples, box[1] * samples):
        for column in range(box[2] * samples, box[3] * samples):
            f = face[row, column]
            if f >= 0 and kind[f] == which:
                left, right, top, bottom, _, _ = place_on(row, column, f, planes, width, height)
                marks[top, left] = marks[top, right] = True
                marks[bottom, left] = marks[bottom, right] = True
                count += 1
    return count


@jit
def median_texels(
    marks: np.ndarray,
    pictures: np.ndarray,
    order: np.ndarray,
    weights: np.ndarray,
    values: np.ndarray,
    out: np.ndarray,
) -> None:
    """Weighted median of the marked texels; see `mouth.weighted_median`.

    Args:
        marks: [h, w] bool.
        pictures: [h, w, 3, M] uint16 that sort as the colours they stand for (`player.sortable`).
        order: [n] int64 into M; weights: [n] float32.
        values: [65536] float32: colour of each number.
        out: [h, w, 4] float32, the first three written where marked.
    """
    count = len(order)
    number, mass = np.empty(count, np.uint16), np.empty(count, np.float32)
    half = np.float32(0.5) * weights.sum()
    for row in range(marks.shape[0]):
        for column in range(marks.shape[1]):
            if not marks[row, column]:
                continue
            for channel in range(3):
                source = pictures[row, column, channel]
                for n in range(count):
                    number[n], mass[n] = source[order[n]], weights[n]
                low, high, before = 0, count, np.float32(0)
                while True:
                    pivot = number[low]  # of those left the nearest mouth, hence the heaviest
                    less = equal = np.float32(0)
                    for n in range(low, high):
                        if number[n] < pivot:
                            less += mass[n]
                        elif number[n] == pivot:
                            equal += mass[n]
                    upper = before + less < half
                    if upper and before + less + equal >= half:
                        break
                    kept = low
                    for n in range(low, high):
                        if (number[n] > pivot) if upper else (number[n] < pivot):
                            number[kept], mass[kept] = number[n], mass[n]
                            kept += 1
                    if kept == low:
                        break
                    high = kept
                    if upper:
                        before += less + equal
                out[row, column, channel] = values[pivot]
