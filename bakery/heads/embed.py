"""Where the 478 face-mesh points lie on a head: fit, cast onto the surface, average, repeat.

Closed lips and lids have both sides under one pixel, so each of their points may only land on the
side it belongs to; sides are told apart by what jawOpen and eyeBlink move.
"""

from dataclasses import replace

import cv2
import numpy as np

from bakery.errors import ModelError
from bakery.geometry import camera as cameras
from bakery.geometry.mesh import boundary_loops
from bakery.geometry.raster import rasterize
from bakery.heads import boundaries
from bakery.heads.base import PARTS, PROXIES
from bakery.heads.eyes import iris_vertices
from bakery.heads.file import save_arrays
from bakery.heads.place import place, place_head
from bakery.heads.proxies import split_ring
from bakery.landmarks import EYE_CORNERS, FACE
from bakery.paths import ASSETS
from bakery.types import EXPRESSION_INDEX

EMBEDDINGS = ASSETS / "embeddings"
SIZE = 720  # pixels of the picture that points are cast in
OUTLINE = (15.0, 25.0)  # mm: what lies this far below a surface, and this far behind it, is throat


def _numbers(text):
    return np.array([int(word) for word in text.split()])


# Points of the public face mesh, the subject's right to left.
UPPER_LIP = _numbers("""185 40 39 37 0 267 269 270 409 184 74 73 72 11 302 303 304 408
    183 42 41 38 12 268 271 272 407 191 80 81 82 13 312 311 310 415""")
LOWER_LIP = _numbers("""146 91 181 84 17 314 405 321 375 77 90 180 85 16 315 404 320 307
    96 89 179 86 15 316 403 319 325 95 88 178 87 14 317 402 318 324""")
UPPER_LID = {
    "right": _numbers("246 161 160 159 158 157 173 247 30 29 27 28 56 190"),
    "left": _numbers("466 388 387 386 385 384 398 467 260 259 257 258 286 414"),
}
LOWER_LID = {
    "right": _numbers("7 163 144 145 153 154 155 25 110 24 23 22 26 112"),
    "left": _numbers("249 390 373 374 380 381 382 255 339 254 253 252 256 341"),
}
# Iris points 469-472 and 474-477 seen from their centre: +x (the subject's left), up, -x, down.
IRIS_DIRECTIONS = np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]])
# A few points that the shape alone gives away, to start from.
START = "33 133 362 263 159 145 386 374 61 291 13 14 1 152"


def mirror_points(points):
    """The point [468] on the other side of each, from the mean of many faces.

    Args:
        points: [N, 468, 2] pixels.
    """
    mean = np.mean([_upright(face[:FACE]) for face in points], axis=0)
    flipped = mean * [-1, 1]
    far = np.linalg.norm(mean[:, None] - flipped[None], axis=-1)
    other = far.argmin(1)
    unsure = np.flatnonzero(other[other] != np.arange(FACE))
    pairs = far[np.ix_(unsure, unsure)]
    while np.isfinite(pairs).any():  # near the middle: nearest first
        a, b = np.unravel_index((pairs + pairs.T).argmin(), pairs.shape)
        other[unsure[a]], other[unsure[b]] = unsure[b], unsure[a]
        pairs[[a, b]] = pairs[:, [a, b]] = np.inf
    return other


def _upright(face):
    """Points [N, 2] turned, moved and scaled so that the outer eye corners lie at x = -1 and 1."""
    a, b = face[EYE_CORNERS]
    axis = (b - a) / 2
    rest = face - (a + b) / 2
    length = axis @ axis
    return np.stack([rest @ axis, rest @ np.array([-axis[1], axis[0]])], -1) / length


def skin_rims(head):
    """The lip ring and the two lid rings (left, right): vertices in order."""
    mean, skin = head.mean, head.faces[head.part_faces("skin")]
    loops = sorted(boundary_loops(skin), key=lambda loop: mean[loop, 1].mean())
    loops = [loop for loop in loops if len(loop) >= 12 and mean[loop, 2].mean() > -30]
    lids = [loop for loop in loops if abs(mean[loop, 0].mean()) > 15]
    lips = [loop for loop in loops if abs(mean[loop, 0].mean()) < 3 and mean[loop, 1].mean() > -110]
    if len(lips) != 1 or len(lids) != 2:
        raise ModelError("the skin has no lip ring and two lid rings; is the head complete?")
    lids.sort(key=lambda loop: -mean[loop, 0].mean())
    return lips[0], lids


def lower_side(head, ring, shape):
    """Which faces [F] belong to the lower of two lips or lids.

    Args:
        ring: the border between the skin and what lies behind.
        shape: name of the expression that moves one side more than the other (down is lower
            for lips; for lids the upper side moves down).
    """
    move = head.expression_basis[EXPRESSION_INDEX[shape]][:, 1].astype(float)
    one, two = split_ring(ring, head.mean, head.expression_basis[EXPRESSION_INDEX[shape]])
    x = head.mean[:, 0]
    middle = (
        np.interp(x, x[one], move[one]) + np.interp(x, x[two], move[two])
    ) / 2  # both run right to left
    moves_more = move[head.faces].mean(1) < middle[head.faces].mean(1)
    return moves_more if shape == "jawOpen" else ~moves_more


def sides(head):
    """For each of the 468 points, the faces [F] it may lie on: list of (points, allowed)."""
    lips, (left, right) = skin_rims(head)
    skin = head.face_part == PARTS.index("skin")
    lower = lower_side(head, lips, "jawOpen")
    groups = [(UPPER_LIP, skin & ~lower), (LOWER_LIP, skin & lower)]
    for side, ring, blink in (("left", left, "eyeBlinkLeft"), ("right", right, "eyeBlinkRight")):
        below = lower_side(head, ring, blink)
        groups += [(UPPER_LID[side], skin & ~below), (LOWER_LID[side], skin & below)]
    taken = np.concatenate([points for points, _ in groups])
    return [(np.setdiff1d(np.arange(FACE), taken), skin), *groups]


def start_points(head):
    """Vertices of the points of START, from the shape alone."""
    mean = head.mean
    lips, (left, right) = skin_rims(head)
    upper, lower = split_ring(lips, mean, head.expression_basis[EXPRESSION_INDEX["jawOpen"]])

    def corners(ring):
        ring = np.array(ring)
        return ring[mean[ring, 0].argmin()], ring[mean[ring, 0].argmax()]

    def lids(ring):
        ring = np.array(ring)
        return ring[mean[ring, 1].argmax()], ring[mean[ring, 1].argmin()]

    skin = head.part_vertices("skin")
    middle = skin[np.abs(mean[skin, 0]) < 4]
    nose = middle[mean[middle, 2].argmax()]
    jaw = middle[(mean[middle, 2] > 0) & (mean[middle, 1] < mean[lower, 1].mean() - 15)]
    chin = jaw[(mean[jaw, 2] - 1.2 * mean[jaw, 1]).argmax()]
    right_eye, left_eye = corners(right), corners(left)
    return np.array(
        [
            *right_eye,
            *left_eye,
            *lids(right),
            *lids(left),
            upper[0],
            upper[-1],
            upper[len(upper) // 2],
            lower[len(lower) // 2],
            nose,
            chin,
        ]
    )


def cast(head, vertices, camera, points, groups):
    """Where pixels fall on a posed head: (faces [468], barycentric [468, 3])."""
    low, high = points.min(0), points.max(0)
    reach = (high - low).max() * 1.3
    corner = (low + high) / 2 - reach / 2
    view = cameras.crop(camera, *corner, SIZE, SIZE, SIZE / reach)
    shown = ~np.isin(head.face_part, [PARTS.index(p) for p in (*PROXIES, "lashes", "tear")])
    shown = np.flatnonzero(shown)
    there = cameras.to_camera(vertices, view)
    seen = rasterize(
        cameras.project_camera(there, view), -there[:, 2], head.faces[shown], (SIZE, SIZE), True
    )
    face = np.where(seen.face >= 0, shown[np.maximum(seen.face, 0)], -1)
    face[beneath(seen.depth, cameras.pixels_per_mm(view))] = -1
    at = np.clip((points - corner) * SIZE / reach, 0, SIZE - 1).astype(int)
    faces, barycentric = np.zeros(FACE, int), np.zeros((FACE, 3))
    for chosen, allowed in groups:
        off = ((face < 0) | ~allowed[np.maximum(face, 0)]).astype(np.uint8)
        label = cv2.distanceTransformWithLabels(
            off, cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL
        )[1]
        rows, columns = np.nonzero(off == 0)
        table = np.zeros((label.max() + 1, 2), int)
        table[label[rows, columns]] = np.stack([rows, columns], 1)
        row, column = table[label[at[chosen, 1], at[chosen, 0]]].T
        faces[chosen] = face[row, column]
        barycentric[chosen] = seen.barycentric[row, column]
    return faces, barycentric


def beneath(depth, per_mm):
    """Where a surface lies far behind another just above it [H, W] bool: the throat under a jaw.

    The outline of a jaw that is longer in a photo than on the mean head would land there.
    """
    seen = np.where(np.isfinite(depth), depth, depth[np.isfinite(depth)].max())
    rows = int(OUTLINE[0] * per_mm) + 1
    above = cv2.erode(seen, np.ones((rows, 1)), anchor=(0, rows - 1))
    return seen - above > OUTLINE[1]


def closest(points, triangles):
    """Nearest point of each of N sets of triangles: points [N, 3], triangles [N, K, 3, 3].

    Returns:
        (which [N], barycentric [N, 3]).
    """
    a, b, c = triangles[..., 0, :], triangles[..., 1, :], triangles[..., 2, :]
    p = points[:, None]
    e0, e1 = b - a, c - a
    d00, d01, d11 = (e0 * e0).sum(-1), (e0 * e1).sum(-1), (e1 * e1).sum(-1)
    d20, d21 = ((p - a) * e0).sum(-1), ((p - a) * e1).sum(-1)
    det = np.maximum(d00 * d11 - d01**2, 1e-12)
    v, w = (d11 * d20 - d01 * d21) / det, (d00 * d21 - d01 * d20) / det
    inside = np.stack([1 - v - w, v, w], -1)

    def on(start, end):
        along = ((p - start) * (end - start)).sum(-1)
        return np.clip(along / np.maximum(((end - start) ** 2).sum(-1), 1e-12), 0, 1)

    t, s, r = on(a, b), on(b, c), on(c, a)
    zero = np.zeros_like(t)
    choices = [
        np.where((inside >= 0).all(-1, keepdims=True), inside, np.nan),
        np.stack([1 - t, t, zero], -1),
        np.stack([zero, 1 - s, s], -1),
        np.stack([r, zero, 1 - r], -1),
    ]
    weights = np.stack(choices, -2)  # [N, K, 4, 3]
    reached = np.einsum("nkqc,nkcx->nkqx", weights, triangles)
    far = np.linalg.norm(reached - points[:, None, None], axis=-1)
    best = np.nan_to_num(far, nan=np.inf).reshape(len(points), -1).argmin(1)
    rows = np.arange(len(points))
    return best // 4, weights[rows, best // 4, best % 4]


def snap(head, positions, groups, near=48):
    """The nearest allowed face and barycentric coordinates of positions [468, 3] on the mean."""
    faces, barycentric = np.zeros(FACE, int), np.zeros((FACE, 3))
    corners = head.mean[head.faces].astype(float)
    centers = corners.mean(1)
    for chosen, allowed in groups:
        pool = np.flatnonzero(allowed)
        far = np.linalg.norm(positions[chosen][:, None] - centers[pool][None], axis=-1)
        candidates = pool[np.argsort(far, axis=1)[:, :near]]
        which, weights = closest(positions[chosen], corners[candidates])
        faces[chosen] = candidates[np.arange(len(chosen)), which]
        barycentric[chosen] = weights
    return faces, barycentric


def iris_landmarks(head):
    """Faces [10] and barycentric coordinates of the iris points: centre, then four on its border."""
    faces, barycentric = [], []
    for side in ("right", "left"):
        pole, ring = iris_vertices(head, side)
        offsets = (head.mean[ring] - head.mean[ring].mean(0))[:, :2]
        for vertex in [pole, *ring[(offsets @ IRIS_DIRECTIONS.T).argmax(0)]]:
            face = int(np.flatnonzero((head.faces == vertex).any(1))[0])
            faces.append(face)
            barycentric.append((head.faces[face] == vertex).astype(float))
    return np.array(faces), np.array(barycentric)


def with_landmarks(head, positions):
    """The head with its points at the nearest allowed surface to positions [468, 3] on its mean."""
    faces, barycentric = snap(head, positions, sides(head))
    return on_faces(head, faces, barycentric)


def embed(head, points, sizes, rounds=3, start=False):
    """Place the 478 points on a head, mirror-symmetric.

    Args:
        head: HeadModel.
        points: [N, 478, 2] pixels of N photos.
        sizes: [N, 2] (width, height) of the photos.
        rounds: of fit, cast and average.
        start: take the head's present landmarks as the start, instead of a few found by shape.

    Yields:
        (head with landmarks, mean error in outer-eye-corner distances or None at first) each round.
    """
    points = np.asarray(points, float)[..., :2]
    mirror = mirror_points(points)
    groups = sides(head)
    numbers = np.array([int(n) for n in START.split()])
    vertices = start_points(head)
    for turn in range(rounds + 1):
        gathered, errors = [], []
        for face, size in zip(points, sizes):
            if turn == 0 and not start:
                view, identity, _, _ = place(
                    head.mean[vertices].astype(float),
                    head.identity_basis[:, vertices].astype(float),
                    None,
                    face[numbers],
                    tuple(int(n) for n in size),
                    modes=12,
                    sigma=0.02,
                )
                shape = head.neutral(identity)
            else:
                placed = place_head(head, face, tuple(int(n) for n in size))
                errors.append(placed.error.mean())
                view = placed.camera
                shape = head.vertices(head.neutral(placed.identity), placed.expression)
            if turn == rounds:
                continue
            hit, weights = cast(head, shape, view, face[:FACE], groups)
            gathered.append(np.einsum("lkc,lk->lc", head.mean[head.faces[hit]], weights))
        if turn:
            yield head, float(np.mean(errors))
        if turn == rounds:
            return
        middle = np.median(np.array(gathered), axis=0)
        head = with_landmarks(head, on_rims(head, points, middle, mirror, groups))


def on_rims(head, points, positions, mirror, groups):
    """Positions [468, 3] with those of lids and lips on the rims seen, mirror-symmetric.

    Args:
        points: [N, 478, 2] pixels of photos; mirror: from `mirror_points`; groups: from `sides`.
    """
    openings = {
        name: (groups[k][1], groups[k + 1][1])
        for name, k in (("lips", 1), ("left", 3), ("right", 5))
    }
    out = positions.copy()
    for point, at in boundaries.pinned(head, points, positions, skin_rims(head), openings).items():
        out[point] = at
    return (out + out[mirror] * [-1, 1, 1]) / 2


def save_landmarks(path, head, positions=True):
    """Write where a head's 468 points lie: `faces`, `barycentric` and, if asked, `positions`."""
    arrays = {
        "faces": head.landmark_faces[:FACE].astype(np.int32),
        "barycentric": head.landmark_barycentric[:FACE].astype(np.float32),
    }
    if positions:
        arrays["positions"] = head.landmarks(head.mean)[:FACE].astype(np.float32)
    save_arrays(path, arrays)


def known_landmarks(name):
    """What `save_landmarks` wrote for a built-in or importable head, as a mapping; {} if nothing."""
    path = EMBEDDINGS / f"{name}.npz"
    if not path.is_file():
        return {}
    with np.load(path, allow_pickle=False) as file:
        return {key: file[key] for key in file.files}


def on_faces(head, faces, barycentric):
    """The head with its 468 points at given places, and the iris points on the irises."""
    iris_faces, iris_barycentric = iris_landmarks(head)
    return replace(
        head,
        landmark_faces=np.concatenate([faces, iris_faces]).astype(np.int32),
        landmark_barycentric=np.concatenate([barycentric, iris_barycentric]).astype(np.float32),
    )
