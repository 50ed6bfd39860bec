"""Inner loops of the fast player: what `render`, `blend` and `mouth` say, texel by texel.

Each compiles once with numba and is kept on disk; none holds the interpreter's lock, so that frames
are drawn side by side in threads.
"""

import numba
import numpy as np

_jit = numba.njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "arcp", "nsz"})
TILE = 16  # texels on a side of the squares that are blended or left alone
LEAST = np.float32(1e-4)  # weights below change no byte


@_jit
def deform(rest, basis, expression, out):
    """rest [3 v] + expression [E] @ basis [E, 3 v], float32, into out [3 v]."""
    out[:] = rest
    for e in range(len(expression)):
        weight = expression[e]
        if weight != 0:
            row = basis[e]
            for n in range(len(out)):
                out[n] += weight * row[n]


@_jit
def rasterize(pixels, inverse, faces, face_out, best):
    """Nearest face under each pixel centre; `geometry.raster` with backs left out.

    Args:
        pixels: [V, 2] float64; inverse: [V] 1/depth, 0 behind the camera.
        faces: [F, 3] int32.
        face_out: [H, W] int32, written: -1 for none.
        best: [H, W] float32, scratch.
    """
    height, width = best.shape
    best[:] = 0
    face_out[:] = -1
    for f in range(faces.shape[0]):
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
        if left > right:
            continue
        scale = 1.0 / area
        la_x, lb_x = (by - cy) * scale, (cy - ay) * scale
        x = left + 0.5
        for row in range(top, bottom + 1):
            y = row + 0.5
            la = ((bx - x) * (cy - y) - (cx - x) * (by - y)) * scale
            lb = ((cx - x) * (ay - y) - (ax - x) * (cy - y)) * scale
            for column in range(left, right + 1):
                lc = 1.0 - la - lb
                if la >= 0 and lb >= 0 and lc >= 0:
                    w = np.float32(la * wa + lb * wb + lc * wc)
                    if w > best[row, column]:
                        best[row, column] = w
                        face_out[row, column] = f
                la += la_x
                lb += lb_x


@_jit
def needed_tiles(face, tile_start, tile_list, seen, needed):
    """Mark the tiles that faces in sight touch.

    Args:
        face: [H, W] int32, as from `rasterize`.
        tile_start: [F + 1], tile_list: [...]: the tiles of face f are tile_list[start[f]:start[f+1]].
        seen: [F] bool, scratch; needed: [tiles] bool, written.
    """
    seen[:] = False
    needed[:] = False
    for row in range(face.shape[0]):
        for column in range(face.shape[1]):
            f = face[row, column]
            if f >= 0:
                seen[f] = True
    for f in range(len(seen)):
        if seen[f]:
            for k in range(tile_start[f], tile_start[f + 1]):
                needed[tile_list[k]] = True


@_jit
def blend_tiles(needed, textures, masks, start, which, place, share, product, out):
    """Equation 4 on the tiles in sight; see `blend.face_texture`.

    All that a tile needs lies together: without that, fetching masks and textures took twice as long
    as working with them.

    Args:
        needed: [tiles] bool.
        textures: [tiles, 1 + K, TILE, 3 TILE] float32, the neutral one first.
        masks: [n, r, r] float32: the masks around each tile, those alone that are felt there.
        start: [tiles + 1]: masks start[t]:start[t + 1] belong to tile t.
        which: [n] into E: whose mask it is.
        place: [T] int32, share: [T] float32: along either axis, texel x lies between the mask texels
            place[x] and place[x] + 1 of its tile's masks, at this share.
        product: [K, E] float32: a_e^k a_e^t.
        out: [T, T, 3] float32, written where needed.
    """
    keys, size, reach = product.shape[0], out.shape[0], masks.shape[1]
    flat = out.reshape(size, 3 * size)
    across = (size + TILE - 1) // TILE
    weight = np.empty((1 + keys, reach, reach), np.float32)
    used = np.empty(1 + keys, np.bool_)
    fine, line = np.empty(3 * TILE, np.float32), np.empty(reach, np.float32)
    for tile in range(len(needed)):
        if not needed[tile]:
            continue
        top, left = tile // across * TILE, tile % across * TILE
        rows, columns = min(TILE, size - top), min(TILE, size - left)
        weight[:] = 0
        for n in range(start[tile], start[tile + 1]):
            for k in range(keys):
                factor = product[k, which[n]]
                if factor > LEAST:
                    for i in range(reach):
                        for j in range(reach):
                            weight[1 + k, i, j] += factor * masks[n, i, j]
        for i in range(reach):
            for j in range(reach):
                total = np.float32(0)
                for k in range(1, 1 + keys):
                    total += weight[k, i, j]
                neutral = max(np.float32(0), 1 - total)
                scale = 1 / max(neutral + total, np.float32(1e-6))
                weight[0, i, j] = neutral * scale
                for k in range(1, 1 + keys):
                    weight[k, i, j] *= scale
        for k in range(1 + keys):
            used[k] = weight[k].max() > LEAST
        for row in range(rows):
            i, down = place[top + row], share[top + row]
            target = flat[top + row, 3 * left : 3 * (left + columns)]
            target[:] = 0
            for k in range(1 + keys):
                if not used[k]:
                    continue
                for j in range(reach):
                    line[j] = weight[k, i, j] + (weight[k, i + 1, j] - weight[k, i, j]) * down
                for column in range(columns):
                    j = place[left + column]
                    w = line[j] + (line[j + 1] - line[j]) * share[left + column]
                    fine[3 * column] = fine[3 * column + 1] = fine[3 * column + 2] = w
                source = textures[tile, k, row]
                for n in range(3 * columns):
                    target[n] += fine[n] * source[n]


@_jit
def texture_planes(seen, pixels, inverse, faces, corners, planes):
    """What turns a pixel centre into a place on the texture: u/w, v/w and 1/w are planes.

    Args:
        seen: [F] bool: the faces in sight.
        corners: [F, 3, 2] texels.
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
                va *= corners[f, 0, n]
                vb *= corners[f, 1, n]
                vc *= corners[f, 2, n]
            vb -= va
            vc -= va
            along = (vb * cy - vc * by) * scale
            down = (vc * bx - vb * cx) * scale
            planes[f, 3 * n] = va + along * (0.5 - ax) + down * (0.5 - ay)
            planes[f, 3 * n + 1] = along
            planes[f, 3 * n + 2] = down


@_jit
def _place(row, column, f, planes):
    """Where on its texture a pixel centre falls: x, y in texels."""
    whole = 1.0 / (planes[f, 6] + planes[f, 7] * column + planes[f, 8] * row)
    u = (planes[f, 0] + planes[f, 1] * column + planes[f, 2] * row) * whole
    v = (planes[f, 3] + planes[f, 4] * column + planes[f, 5] * row) * whole
    return u, v


@_jit
def _corners(place, size):
    """The two texels around a place along one axis, and the share of the second."""
    place -= 0.5
    low = int(np.floor(place))
    share = np.float32(place - low)
    return min(max(low, 0), size - 1), min(max(low + 1, 0), size - 1), share


@_jit
def mark_texels(face, kind, which, planes, marks):
    """Mark the texels [h, w] of one carrier that are in sight; returns how many pixels see it."""
    marks[:] = False
    height, width = marks.shape
    count = 0
    for row in range(face.shape[0]):
        for column in range(face.shape[1]):
            f = face[row, column]
            if f >= 0 and kind[f] == which:
                u, v = _place(row, column, f, planes)
                left, right, _ = _corners(u, width)
                top, bottom, _ = _corners(v, height)
                marks[top, left] = marks[top, right] = True
                marks[bottom, left] = marks[bottom, right] = True
                count += 1
    return count


@_jit
def median_texels(marks, pictures, order, weights, values, out):
    """Weighted median of the marked texels; see `mouth.weighted_median`.

    Args:
        marks: [h, w] bool.
        pictures: [h, w, 3, M] uint16 that sort as the colours they stand for (`player.sortable`).
        order: [n] int64 into M; weights: [n] float32.
        values: [65536] float32: colour of each number.
        out: [h, w, 3] float32, written where marked.
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


@_jit
def shade(face, kind, planes, skin, mouth, eyes, slide, known, samples, out, share):
    """Colour the picture from what each of its samples sees, and average them.

    Args:
        face: [H n, W n] int32, n = samples.
        kind: [F] uint8: 0 skin, 1 mouth sheet, 2 left and 3 right eye cap.
        planes: [F, 9], as from `texture_planes`.
        skin: [T, T, 3]; mouth: [h, w, 3]; eyes: [2, h, w, 3]; float32 linear.
        slide: [2] texels that the eyes' pictures move right and down (`blend.gaze_slide`).
        known: [T, T] float32, or [1, 1] to leave share[..., 1] alone.
        out: [H, W, 3] float32, written: linear, premultiplied by alpha.
        share: [H, W, 2] float32, written: alpha and `Frame.face`.
    """
    height, width = out.shape[0], out.shape[1]
    weigh = np.float32(1 / (samples * samples))
    for row in range(height):
        for column in range(width):
            red = green = blue = alpha = sure = np.float32(0)
            for i in range(samples):
                for j in range(samples):
                    y, x = row * samples + i, column * samples + j
                    f = face[y, x]
                    if f < 0:
                        continue
                    u, v = _place(y, x, f, planes)
                    which = kind[f]
                    if which == 0:
                        picture = skin
                    elif which == 1:
                        picture = mouth
                    else:
                        picture = eyes[which - 2]
                        u -= slide[0]
                        v -= slide[1]
                    left, right, s = _corners(u, picture.shape[1])
                    top, bottom, t = _corners(v, picture.shape[0])
                    a, b = (1 - s) * (1 - t), s * (1 - t)
                    c, d = (1 - s) * t, s * t
                    red += (
                        a * picture[top, left, 0] + b * picture[top, right, 0]
                        + c * picture[bottom, left, 0] + d * picture[bottom, right, 0]
                    )  # fmt: skip
                    green += (
                        a * picture[top, left, 1] + b * picture[top, right, 1]
                        + c * picture[bottom, left, 1] + d * picture[bottom, right, 1]
                    )  # fmt: skip
                    blue += (
                        a * picture[top, left, 2] + b * picture[top, right, 2]
                        + c * picture[bottom, left, 2] + d * picture[bottom, right, 2]
                    )  # fmt: skip
                    alpha += 1
                    if which > 0:
                        sure += 1
                    elif known.shape[0] > 1:
                        sure += (
                            a * known[top, left] + b * known[top, right]
                            + c * known[bottom, left] + d * known[bottom, right]
                        )  # fmt: skip
            out[row, column, 0] = red * weigh
            out[row, column, 1] = green * weigh
            out[row, column, 2] = blue * weigh
            share[row, column, 0] = alpha * weigh
            share[row, column, 1] = sure * weigh


@_jit
def encode_over(color, share, gray, table, out):
    """Linear colour over plain grey as sRGB bytes.

    Args:
        color: [H, W, 3] float32 premultiplied; share: [H, W, 2]; gray: linear.
        table: [n] uint8: sRGB byte of k / (n - 1) linear.
        out: [H, W, 3] uint8, written.
    """
    last = np.float32(len(table) - 1)
    for row in range(color.shape[0]):
        for column in range(color.shape[1]):
            rest = gray * (1 - share[row, column, 0])
            for c in range(3):
                value = min(max(color[row, column, c] + rest, np.float32(0)), np.float32(1))
                out[row, column, c] = table[int(value * last + np.float32(0.5))]
