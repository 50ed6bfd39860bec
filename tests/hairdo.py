"""Test data: hair with volume on a head, made by plain rules. A bob to the chin, a thicker one, a crop."""

import numpy as np

from bakery.geometry.mesh import vertex_normals
from bakery.heads.scalp import scalp
from bakery.landmarks import CHIN
from bakery.types import HairMesh

SIDE, COLUMNS, ROWS = 256, 4, 8  # texels; painted strips; segments of a card
BROWN = np.array([0.10, 0.045, 0.02])
STYLES = {  # cards, mm of length, of width and over the skin, share that hangs before the face
    "bob": (220, 190.0, 17.0, (5.0, 17.0), True),
    "thick": (380, 190.0, 17.0, (5.0, 22.0), True),
    "crop": (160, 28.0, 12.0, (4.0, 9.0), False),
}


def hairdo(head, neutral, style="bob", seed=0, color=BROWN):
    """A HairMesh on a head, neutral [V, 3] mm."""
    rng = np.random.default_rng(seed)
    count, length, width, lift, fringe = STYLES[style]
    share = scalp(head)[: len(neutral)]
    skin = head.faces[head.part_faces("skin")]
    normals = vertex_normals(neutral, skin)
    hairy = skin[(share[skin] > 0.4).all(1)]
    cap = _cap(neutral, normals, hairy)
    on = np.unique(hairy)
    roots = rng.choice(on, count, p=share[on] / share[on].sum())
    lifts = np.sort(rng.uniform(*lift, count))  # from the skull outwards
    chin = neutral[head.landmark_vertices[CHIN]].reshape(-1, 3)[:, 1].min()
    pieces = [cap]
    front = np.quantile(neutral[on, 2], 0.9)
    for number, (root, up) in enumerate(zip(roots, lifts)):
        ahead = neutral[root, 2] > front
        if ahead and not fringe:
            continue
        reach = 60.0 if ahead else length * rng.uniform(0.85, 1.0)
        path = _grown(neutral, normals, on, root, up, reach, ahead, chin - 8)
        pieces.append(_card(path, width, rng.integers(COLUMNS), number, 2 if ahead else 1))
    return _joined(pieces, *_atlas(rng, color), chin)


def _cap(neutral, normals, faces):
    used, index = np.unique(faces, return_inverse=True)
    points = neutral[used] + 3.0 * normals[used]
    away = points - (points.min(0) + points.max(0)) / 2
    away /= np.linalg.norm(away, axis=1, keepdims=True)
    radius = np.arccos(np.clip(away[:, 1], -1, 1)) / np.pi  # a chart about the crown
    flat = away[:, [0, 2]] / np.maximum(
        np.linalg.norm(away[:, [0, 2]], axis=1, keepdims=True), 1e-6
    )
    uv = np.array([0.25, 0.5]) + 0.24 * radius[:, None] * flat
    index = index.reshape(-1, 3)
    return points, index, uv, np.zeros(len(index)), np.full(len(index), -1), np.full(len(index), 7)


def _grown(neutral, normals, on, root, up, length, ahead, lowest):
    """The middle line [ROWS + 1, 6] of a card and its normals: out of the skin, then down along it."""
    point, step = neutral[root] + up * normals[root], length / ROWS
    line = [np.r_[point, normals[root]]]
    for _ in range(ROWS):
        near = on[((neutral[on] - point) ** 2).sum(1).argmin()]
        normal = normals[near]
        way = np.array([0.0, -1.0, 0.25 if ahead else -0.1])
        way -= normal * min(way @ normal, 0)  # along the skin where it would go in
        point = point + step * way / np.linalg.norm(way)
        point = point + normal * max(up - (point - neutral[near]) @ normal, 0) * (
            np.linalg.norm(point - neutral[near]) < 3 * step
        )
        point[1] = max(point[1], lowest)
        flat = normal * [1, 0.2, 1]
        line.append(np.r_[point, flat / np.linalg.norm(flat)])
    return np.array(line)


def _card(path, width, column, number, kind):
    points, normals = path[:, :3], path[:, 3:]
    along = np.gradient(points, axis=0) + [0, -1e-3, 0]
    aside = np.cross(along, normals)
    aside *= width / 2 / np.maximum(np.linalg.norm(aside, axis=1, keepdims=True), 1e-6)
    vertices = np.concatenate([points - aside, points + aside])
    down = np.linspace(0.02, 0.98, len(points))
    left = 0.5 + (column + np.array([0.06, 0.94])) / (2 * COLUMNS)
    uv = np.concatenate([np.stack([np.full_like(down, x), down], 1) for x in left])
    a, n = np.arange(len(points) - 1), len(points)
    faces = np.concatenate([np.stack([a, a + 1, a + n], 1), np.stack([a + n, a + 1, a + n + 1], 1)])
    levels = 1 | 2 * (number % 2 == 0) | 4 * (number % 4 == 0)
    many = np.ones(len(faces))
    return vertices, faces, uv, kind * many, number * many, levels * many


def _atlas(rng, color):
    """Texture [S, S, 4], direction [S, S, 2], root to tip [S, S]: the cap on the left, strips."""
    texture = np.zeros((SIDE, SIDE, 4))
    streaks = 0.6 + 0.5 * rng.random((1, SIDE // 2, 1))
    texture[:, : SIDE // 2] = np.concatenate(
        [
            0.5 * color * np.broadcast_to(streaks, (SIDE, SIDE // 2, 1)),
            np.ones((SIDE, SIDE // 2, 1)),
        ],
        -1,
    )
    down, wide = np.linspace(0, 1, SIDE), SIDE // 2 // COLUMNS
    for column in range(COLUMNS):
        for _ in range(14):
            middle = rng.uniform(4, wide - 4) + rng.uniform(-2, 2) * down
            thin = np.clip((rng.uniform(0.7, 1.05) - down) / 0.3, 0, 1)
            x = np.arange(wide)[None]
            alpha = thin[:, None] * np.clip(1.8 - np.abs(x + 0.5 - middle[:, None]), 0, 1)
            shade = color * rng.uniform(0.5, 1.8) * (0.6 + 0.7 * down[:, None, None])
            own = texture[:, SIDE // 2 + column * wide :][:, :wide]
            own *= 1 - alpha[..., None]
            own += np.concatenate([shade * alpha[..., None], alpha[..., None]], -1)
    direction = np.zeros((SIDE, SIDE, 2))
    direction[..., 1] = 1
    return texture, direction, np.repeat(down[:, None], SIDE, 1)


def _joined(pieces, texture, direction, root_to_tip, chin):
    counts = [len(piece[0]) for piece in pieces]
    starts = np.cumsum([0, *counts[:-1]])
    vertices, faces, uv, kind, card, levels = (
        np.concatenate(
            [piece[n] + (start if n == 1 else 0) for piece, start in zip(pieces, starts)]
        )
        for n in range(6)
    )
    return HairMesh(
        vertices=vertices.astype(np.float32),
        faces=faces.astype(np.int32),
        uv=uv.astype(np.float32),
        kind=kind.astype(np.uint8),
        card=card.astype(np.int32),
        levels=levels.astype(np.uint8),
        hang=np.clip((chin - vertices[:, 1]) / 40, 0, 1).astype(np.float32),
        texture=texture.astype(np.float16),
        direction=direction.astype(np.float16),
        root_to_tip=root_to_tip.astype(np.float16),
        source=np.where(texture[..., 3] > 0, 3, 0).astype(np.uint8),
    )
