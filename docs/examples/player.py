"""Draw a frame of a bundle from docs/bundle.md alone: numpy, OpenEXR, nothing of bakery.

    python player.py NAME.avatar out.exr '{"jawOpen": 0.6}' '[30, 0]' '[10, 0]'

After the two files: weights, view and gaze (yaw and pitch, degrees), size. The picture is linear,
over grey. Numbers in comments are sections and steps of docs/bundle.md.
"""

import json
import sys
from pathlib import Path

import numpy as np
import OpenEXR

LIPS = "61 146 91 181 84 17 314 405 321 375 291 409 270 269 267 0 37 39 40 185 78 95 88 178 87 14"
LIPS += " 317 402 318 324 308 415 310 311 312 13 82 81 80 191"
LIPS, CHIN = [int(number) for number in LIPS.split()], [152, 148, 377, 175]
PROXIES = ["mouth_sheet", "eye_cap_left", "eye_cap_right"]
LOOKS = "OutLeft InLeft InRight OutRight UpLeft UpRight DownLeft DownRight".split()
LOOK = np.array([(1, 0), (-1, 0), (1, 0), (-1, 0), (0, 1), (0, 1), (0, -1), (0, -1)])


def exr(path, parts):
    found = {part.name(): part.channels for part in OpenEXR.File(str(path)).parts}
    return [next(iter(found[part].values())).pixels.astype(np.float32) for part in parts]


def encode(x):
    x = np.clip(x, 0, 1)
    return np.where(x <= 0.0031308, 12.92 * x, 1.055 * np.maximum(x, 1e-3) ** (1 / 2.4) - 0.055)


def decode(x):
    return np.where(x <= 0.04045, x / 12.92, ((x + 0.055) / 1.055) ** 2.4)


def read(texture, uv):  # 1
    h, w = texture.shape[:2]
    place = uv * [w, h] - 0.5
    low = np.floor(place).astype(int)
    s, t = np.moveaxis((place - low)[..., None], -2, 0)
    i, k = (np.clip(low[..., 0] + n, 0, w - 1) for n in (0, 1))
    j, m = (np.clip(low[..., 1] + n, 0, h - 1) for n in (0, 1))
    upper = texture[j, i] * (1 - s) + texture[j, k] * s
    return upper * (1 - t) + (texture[m, i] * (1 - s) + texture[m, k] * s) * t


def matrix(rotation):  # 1
    angle = max(np.linalg.norm(rotation), 1e-12)
    k = np.cross(np.eye(3), np.divide(rotation, angle))
    return np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k


def covered(corners, inverse, best):
    """Samples [n] where a triangle [3, 2] is nearest: (rows, columns), weights [n, 3], 1 / depth."""
    low = np.clip(np.ceil(corners.min(0) - 0.5), 0, best.shape[::-1]).astype(int)
    high = np.clip(np.floor(corners.max(0) + 0.5), low, best.shape[::-1]).astype(int)
    y, x = (n.ravel() for n in np.mgrid[low[1] : high[1], low[0] : high[0]])
    ax, ay = (corners[:, None] - np.stack([x + 0.5, y + 0.5], -1)).transpose(2, 0, 1)
    area = ax[[1, 2, 0]] * ay[[2, 0, 1]] - ax[[2, 0, 1]] * ay[[1, 2, 0]]
    whole = area.sum(0)
    weights = (area / np.where(whole, whole, np.nan)).T
    near = weights @ inverse
    seen = (weights >= 0).all(1) & (near > best[y, x]) & (inverse > 0).all()
    return (y[seen], x[seen]), (weights * inverse / near[:, None])[seen], near[seen]


def mix(color, alpha, at, card):
    """6.10: lay premultiplied texels [n, 4] over a premultiplied picture."""
    o, behind = np.clip(card[:, 3:], 0, 1), alpha[at][:, None]
    own, back = card[:, :3] / np.maximum(o, 1e-6), color[at] / np.maximum(behind, 1e-6)
    whole = o + behind * (1 - o)
    mixed = encode(own) * o + encode(back) * behind * (1 - o)
    color[at], alpha[at] = decode(mixed / np.maximum(whole, 1e-6)) * whole, whole[:, 0]


def framed(fit, points, hair, view, size):
    """6, Views: focal length, centre, R and t of a picture that holds the head."""
    c = (points.min(0) + points.max(0)) / 2
    points = np.append(points, hair, 0)
    for n in range(1, 200 if len(hair) else 1):
        far = points[((points - c) ** 2).sum(1).argmax()]
        c = c + (far - c) * [0, 1, 1] / (n + 1)
    radius = np.linalg.norm(points - c, axis=1).max()
    p = matrix(fit["rotation"]) @ c + fit["translation"]
    middle = np.arctan2(p[:2] * [1, -1], -p[2])
    half = np.arcsin(np.minimum(1.06 * radius / np.hypot(p[:2], p[2]), 0.9))
    ends = fit["center"] + fit["focal"] * np.tan([middle - half, middle + half])
    k = size / (ends[1] - ends[0]).max()
    R = matrix([0, np.radians(view[0]), 0]) @ matrix([-np.radians(view[1]), 0, 0])
    return k * fit["focal"], k * (fit["center"] - ends.mean(0)) + size / 2, R, p - R @ c


def draw(folder, weights, view=(0, 0), gaze=None, size=512):
    """A frame [size, size, 3], linear over grey, and its alpha [size, size]."""
    folder, fine = Path(folder), (2 * size, 2 * size)
    table = json.loads((folder / "avatar.json").read_text(encoding="utf-8"))
    fit, mouths, names = table["fit"]["camera"], table["mouths"], table["expressions"]
    head = dict(np.load(folder / "head.npz"))  # 4
    mean, start = head["mean"].astype(float), head["expression_start"]
    shapes, moved = np.zeros((52, *mean.shape)), head["expression_value"]
    for e, which in enumerate(map(slice, start[:-1], start[1:])):
        shapes[e, head["expression_vertex"][which]] = moved[which]
    corners, places = head["faces"], head["uv"][head["uv_faces"]]
    parts, hair = head["part_names"][head["face_part"]], np.zeros((0, 3))
    card, atlas = np.zeros(len(corners), int), np.zeros((1, 1, 4))
    if "hair_mesh" in table:
        (atlas,) = exr(folder / "hair_cards.exr", ["texture"])
        mesh = dict(np.load(folder / "hair_mesh.npz"))
        kinds = np.where(mesh["levels"] & 1, mesh["kind"], 3)
        parts = np.append(parts, np.array(["cap", "card", "card", ""])[kinds])
        corners = np.append(corners, mesh["faces"] + len(mean), 0)
        places = np.append(places, mesh["uv"][mesh["faces"]], 0)
        hair, card = mesh["vertices"], np.append(card, mesh["card"])

    def part(*names):
        return np.flatnonzero(np.isin(parts, names))

    def landmarks(shape, which):
        around = shape[corners[head["landmark_faces"][which]]]
        return np.einsum("lkc,lk->lc", around, head["landmark_barycentric"][which])

    looks = [names.index("eyeLook" + look) for look in LOOKS]
    a = np.array([weights.get(name, 0.0) for name in names])
    if gaze:  # 5
        a[looks] = np.clip(LOOK @ np.divide(gaze, [30, 25]), 0, 1)
    gaze = gaze or (a[looks] @ LOOK / 2 * [30, 25]).tolist()
    vertices = mean + np.tensordot(a, shapes, 1)  # 6.1
    skin, open_mouth = mean[np.unique(corners[part("skin")])], shapes[names.index("jawOpen")]
    skin = skin[skin[:, 1] > landmarks(mean, CHIN)[:, 1].min()]
    points = np.append(skin, landmarks(mean + open_mouth, CHIN), 0)
    f, center, R, t = framed(fit, points, hair, view, 2 * size)  # 6.2
    p = np.append(vertices, hair, 0) @ R.T + t
    pixels = (center + f * p[:, :2] / -p[:, 2:] * [1, -1])[corners]
    far = 8.0 * (parts == "mouth_sheet")[:, None] - p[corners, 2]  # 6.3
    inverse = np.where(far > 1e-6, 1 / far, -1)
    best, seen, uv = np.zeros(fine), np.full(fine, -1), np.zeros((*fine, 2))
    shown = part("skin", "eye_socket", *PROXIES, "tongue", "cap")
    b, c = ((pixels[shown, k] - pixels[shown, 0]).T for k in (1, 2))
    for k in shown[(b[0] * c[1] < c[0] * b[1]) | (parts[shown] == "cap")]:
        at, shares, near = covered(pixels[k], inverse[k], best)
        best[at], seen[at], uv[at] = near, k, shares @ places[k]
    what, color, alpha = np.append(parts, "")[seen], np.zeros((*fine, 3)), (seen >= 0) * 1.0
    masks = np.stack(exr(folder / "masks.exr", names))  # 6.4: equation 4, and the hair layer
    keys = [[key["weights"].get(name, 0) for name in names] for key in table["keys"]]
    w = [np.tensordot(key * a, masks, 1) for key in keys]
    w = np.stack([np.maximum(0, 1 - sum(w)), *w], -1)
    w /= np.maximum(w.sum(-1, keepdims=True), 1e-6)
    (layer,) = exr(folder / "hair.exr", [table["hair"]["part"]])
    side = (np.arange(len(layer)) + 0.5) / len(layer)
    w = np.moveaxis(read(w, np.stack(np.meshgrid(side, side), -1)), -1, 0)[..., None]
    faces = exr(folder / "face.exr", ["neutral", *(key["part"] for key in table["keys"])])
    texture = (w * faces).sum(0) * (1 - layer[..., 3:]) + layer[..., :3]
    on_skin, cap = np.isin(what, ("skin", "eye_socket", "tongue")), what == "cap"
    color[on_skin] = read(texture, uv[on_skin])
    away = np.subtract(gaze, table["gaze"]["directions"])  # 6.5
    nearest = (away**2).sum(1).argmin()
    (eyes,) = exr(folder / "gaze.exr", [table["gaze"]["parts"][nearest]])
    rest, now = landmarks(mean, LIPS), landmarks(vertices, LIPS)  # 6.6
    wide = np.linalg.norm(rest[LIPS.index(61)] - rest[LIPS.index(291)])
    lips = ((now - rest.mean(0))[:, :2] * [1, -1] / wide).ravel()
    known = np.reshape(mouths["landmarks"], (-1, lips.size))
    far = 1 - known @ lips / np.linalg.norm(known, axis=1) / np.linalg.norm(lips)
    near = np.argsort(far, kind="stable")[:50]
    strip = np.concatenate(exr(folder / "mouth.exr", mouths["parts"]))
    rows = np.split(strip, mouths["rows"] * len(mouths["parts"]))
    cells = np.stack([cell for row in rows for cell in np.split(row, mouths["columns"], 1)])
    pull = np.exp((far[near[0]] - far[near]) / max(0.25 * far[near[0]], 1e-4))
    order = np.argsort(cells[near], axis=0, kind="stable")
    running = np.cumsum(pull[order], axis=0)
    rank = (running >= 0.5 * running[-1]).argmax(0)[None]
    mouth = np.take_along_axis(cells[near], np.take_along_axis(order, rank, 0), 0)[0]
    for name, picture in zip(PROXIES, (mouth, *np.split(eyes, 2, 1))):
        slide = (name != "mouth_sheet") * away[nearest] * [1, -1] / 130
        local = (uv[what == name] - table["uv"][name][:2]) / table["uv"][name][2:] - slide
        color[what == name] = read(picture, local)
    texels = read(atlas, uv[cap])  # 6.7
    color[cap] = texels[:, :3] / np.maximum(texels[:, 3:], 1e-3)
    own, hairy = color * cap[..., None], cap * 1.0
    cards, lashes = part("card"), part("lashes", "tear")
    angle = np.degrees(np.arccos(min(R[2] @ matrix(fit["rotation"])[2], 1)))  # 6.8
    blink = a[[names.index("eyeBlinkLeft"), names.index("eyeBlinkRight")]]
    s = np.clip(np.maximum((angle - 8) / 24, (blink - 0.2) / 0.55), 0, 1)
    shown = [layer * share for share in 0.25 + 0.75 * s * s * (3 - 2 * s)]
    middles, number = hair[corners[cards] - len(mean)].mean(1) @ R[2], card[cards]  # 6.9
    depth = (np.bincount(number, middles) / np.maximum(np.bincount(number), 1))[number]
    todo = [(k, shown[int(mean[corners[k], 0].mean() < 0)], color, alpha) for k in lashes]
    todo += [(k, atlas, own, hairy) for k in cards[np.lexsort((cards, depth))]]
    for k, texture, *target in todo:
        at, shares, _ = covered(pixels[k], inverse[k], best)
        mix(*target, at, read(texture, shares @ places[k]))
    mix(color, alpha, np.nonzero(hairy), np.dstack([own, hairy])[hairy > 0])
    color, alpha = (x.reshape(size, 2, size, 2, -1).mean((1, 3)) for x in (color, alpha))
    return color + (1 - alpha) * 0.18, alpha[..., 0]  # 6.11


if __name__ == "__main__":
    picture, _ = draw(sys.argv[1], *map(json.loads, sys.argv[3:]))
    OpenEXR.File({}, {"RGB": picture.astype(np.float16)}).write(sys.argv[2])
