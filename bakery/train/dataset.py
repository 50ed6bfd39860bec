"""Training samples of the detector, painted anew from a few photos with known points.

A sample depends on its number and the seed alone, so a run that was stopped goes on with the
samples it would have seen.
"""

import json
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from bakery.detectors import frames
from bakery.detectors.blocks import FINDER_STRIDE
from bakery.errors import InputError
from bakery.train import augment
from bakery.train.backgrounds import IMAGE_SUFFIXES, Backgrounds
from bakery.train.relief import make_relief, pose, render, reshape

STORED = 480  # longer side of a stored photo, pixels
CANVAS = 192  # side of a finder sample, pixels
CROP = 128  # side of a points sample, pixels


@dataclass(frozen=True)
class Photo:
    """A training photo before it becomes a relief."""

    name: str
    image: np.ndarray  # [H, W, 3] uint8 BGR
    mask: np.ndarray  # [H, W] uint8, 255 where the person is
    points: np.ndarray  # [478, 3] pixels of the image


def read_photos(folder, dense, limit=None):
    """Photos of a folder whose points stand in a dense478 file.

    Args:
        folder: of pictures.
        dense: npz with `names` (relative paths) and `points` [n, 478, 3] pixels.
        limit: how many to read at most.

    Returns:
        list of Photo, by name

    Raises:
        InputError: no picture of the folder has points.
    """
    table = np.load(dense)
    known = dict(zip(table["names"].tolist(), table["points"]))
    photos = []
    for path in sorted(Path(folder).iterdir())[:limit]:
        parts = path.parts
        ends = ("/".join(parts[-n:]) for n in range(1, min(len(parts), 5) + 1))
        name = next((end for end in ends if end in known), None)
        if name is None or path.suffix.lower() not in IMAGE_SUFFIXES:
            continue
        photos.append(_shrunk(path, known[name]))
    if not photos:
        raise InputError(f"{folder}: no picture with points in {dense}; give the folder it names")
    return photos


def read_rendered(folder):
    """Pictures with their points in a JSON beside them: NAME.png and NAME.json.

    The JSON holds {"points": [[x, y, depth] x 478]}, pixels; depth may be left out. An alpha
    channel says where the person is.

    Raises:
        InputError: a JSON lacks its picture or has other than 478 points.
    """
    photos = []
    for path in sorted(Path(folder).glob("*.json")):
        points = np.asarray(json.loads(path.read_text()).get("points", []), np.float32)
        pictures = [path.with_suffix(suffix) for suffix in sorted(IMAGE_SUFFIXES)]
        picture = next((p for p in pictures if p.exists()), None)
        if picture is None or points.shape[:1] != (frames.POINTS,):
            raise InputError(f"{path}: needs 478 points and a picture of the same name beside it")
        if points.shape[1] == 2:
            points = np.concatenate([points, np.zeros((frames.POINTS, 1), np.float32)], 1)
        photos.append(_shrunk(picture, points))
    return photos


def _shrunk(path, points):
    image = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    if image is None:
        raise InputError(f"{path}: cannot be read as a picture; remove it from the folder")
    if image.ndim == 2:
        image = cv2.cvtColor(image, cv2.COLOR_GRAY2BGR)
    scale = STORED / max(image.shape[:2])
    size = (round(image.shape[1] * scale), round(image.shape[0] * scale))
    image = cv2.resize(image, size, interpolation=cv2.INTER_AREA)
    points = np.asarray(points, np.float32) * scale
    mask = image[..., 3] if image.shape[2] == 4 else person_mask(image, points)
    return Photo(path.stem, np.ascontiguousarray(image[..., :3]), mask, points)


def person_mask(image, points):
    """Tell a person from a plain backdrop by graph cut, started from the face.

    Args:
        image: [H, W, 3] uint8 BGR.
        points: [478, 2+] pixels.

    Returns:
        [H, W] uint8, 255 where the person is, soft at the rim.
    """
    height, width = image.shape[:2]
    half = cv2.resize(image, (width // 2, height // 2), interpolation=cv2.INTER_AREA)
    points = points[:, :2] / 2
    labels = np.full(half.shape[:2], cv2.GC_PR_BGD, np.uint8)
    frame = frames.frame_of_points(points)
    x, y = frame.center
    s = frame.size
    axes = (int(0.6 * s), int(0.85 * s))
    cv2.ellipse(labels, (int(x), int(y - 0.1 * s)), axes, 0, 0, 360, cv2.GC_PR_FGD, -1)
    chin = points[152]
    body = [[x - 0.3 * s, chin[1]], [x + 0.3 * s, chin[1]], [x + s, 9e3], [x - s, 9e3]]
    cv2.fillPoly(labels, [np.array(body, np.int32)], cv2.GC_PR_FGD)
    rows = int(max(y - 1.2 * s, 2))
    labels[:rows] = cv2.GC_BGD
    labels[: int(y), : int(max(x - 1.0 * s, 2))] = cv2.GC_BGD
    labels[: int(y), int(min(x + 1.0 * s, width / 2 - 2)) :] = cv2.GC_BGD
    hull = cv2.convexHull(points.astype(np.int32))
    cv2.fillConvexPoly(labels, hull, cv2.GC_FGD)
    cv2.setRNGSeed(0)
    models = np.zeros((1, 65)), np.zeros((1, 65))
    cv2.grabCut(half, labels, None, *models, 4, cv2.GC_INIT_WITH_MASK)
    mask = np.isin(labels, (cv2.GC_FGD, cv2.GC_PR_FGD)).astype(np.uint8) * 255
    mask = cv2.resize(mask, (width, height), interpolation=cv2.INTER_LINEAR)
    return cv2.GaussianBlur(mask, (0, 0), 1.2)


def mirror_order(points):
    """Which point takes whose place when a face is mirrored.

    Args:
        points: [n, 478, 3] of several faces.

    Returns:
        [478] int; mirrored[i] = original[order[i]] with x negated.
    """
    upright = []
    for face in points:
        frame = frames.frame_of_points(face)
        turned = (face[:, :2] - frame.center) @ frames.rotation(-frame.roll).T / frame.size
        upright.append(np.concatenate([turned, face[:, 2:] / frame.size], 1))
    mean = np.mean(upright, axis=0)
    mean[:, 0] -= mean[:468, 0].mean()
    flipped = mean * (-1, 1, 1)
    cost = np.linalg.norm(flipped[:, None] - mean[None], axis=-1) ** 2
    cost[:468, 468:] = cost[468:, :468] = 1e3
    return _pair_up(cost + cost.T)


def _pair_up(cost):
    """Pair indices i <-> j (or i with itself) greedily, the cheapest pair of all first."""
    order = np.full(len(cost), -1)
    for flat in np.argsort(cost, axis=None, kind="stable"):
        i, j = divmod(int(flat), len(cost))
        if order[i] < 0 and order[j] < 0:
            order[i], order[j] = j, i
    return order


class Faces:
    """Faces painted from reliefs: morphed, turned, mirrored, from nearer by or farther off."""

    def __init__(self, photos, backgrounds):
        self.backgrounds = backgrounds
        self.reliefs = [make_relief(p.image, p.mask, p.points) for p in photos]
        self.order = mirror_order(np.stack([p.points for p in photos]))
        shapes = [(r.points - (*r.center, 0)) / r.size for r in self.reliefs]
        self.shapes = np.stack(shapes).astype(np.float32)  # [n, 478, 3]
        mean = self.shapes.mean(0)
        flat = (self.shapes - mean).reshape(len(shapes), -1)
        _, spread, modes = np.linalg.svd(flat, full_matrices=False)
        count = min(20, len(shapes) - 1)
        scale = spread[:count, None] / np.sqrt(len(shapes))
        self.modes = (modes[:count] * scale).reshape(-1, frames.POINTS, 3)
        upright = []
        for shape in self.shapes[..., :2]:
            frame = frames.frame_of_points(shape)
            turn = frames.rotation(-frame.roll)
            upright.append((shape - frame.center) @ turn.T / (frame.size * frames.CROP_MARGIN))
        upright = np.mean(upright, axis=0)
        self.mean_shape = (upright + upright[self.order] * (-1, 1)) / 2  # [478, 2]

    def posed(self, rng):
        """A random photo's mesh in a random shape and pose.

        Returns:
            relief, vertices [N, 3] in face sizes (no roll applied), opened: the mouth was opened.
        """
        index = rng.integers(len(self.reliefs))
        relief = self.reliefs[index]
        shape = self.shapes[index].copy()
        if rng.random() < 0.7:
            other = self.shapes[rng.integers(len(self.shapes))]
            shape += rng.uniform(0, 0.8) * (other - shape)
        shape += np.tensordot(rng.normal(0, 0.45, len(self.modes)), self.modes, 1)
        opened = rng.random() < 0.15
        if opened:
            _open_jaw(shape, rng.uniform(0.02, 0.2))
        if rng.random() < 0.12:
            _close_eyes(shape, rng.uniform(0.3, 1.0))
        points = (shape * relief.size + (*relief.center, 0)).astype(np.float32)
        vertices = reshape(relief, points)
        yaw = np.radians(np.clip(rng.normal(0, 14), -40, 40))
        pitch = np.radians(np.clip(rng.normal(0, 9), -25, 25))
        nearness = max(rng.normal(0.05, 0.12), -0.1)
        posed = pose(vertices, relief.center, relief.size, yaw, pitch, nearness)
        stretch = np.exp(rng.normal(0, 0.04, 2)).astype(np.float32)
        posed[:, :2] *= stretch
        return relief, posed, opened

    def paint(self, rng, relief, posed, opened, linear, offset, canvas):
        """Paint a posed relief into a picture.

        Args:
            linear: [2, 2], offset: [2]: posed vertices -> pixels of the canvas.
            canvas: [H, W, 3] uint8, what lies behind.

        Returns:
            picture [H, W, 3] uint8, points [478, 2] pixels, covered [H, W] 0..1: not canvas
        """
        height, width = canvas.shape[:2]
        scale = float(np.sqrt(abs(np.linalg.det(linear))))
        vertices = posed.copy()
        vertices[:, :2] = posed[:, :2] @ linear.T + offset
        vertices[:, 2] *= scale
        image, mask, inside = render(relief, vertices, height, width, scale / relief.size)
        points = vertices[: frames.POINTS, :2].astype(np.float64)
        if rng.random() < 0.3:  # the person's colours apart from the surroundings'
            image = augment.tone(rng, image)
        if opened:
            image = augment.open_mouth(rng, image, points)
        keep = mask[..., None] if rng.random() < 0.6 else inside[..., None].astype(np.float32)
        picture = canvas + (image.astype(np.float32) - canvas) * keep
        picture = np.clip(picture, 0, 255).astype(np.uint8)
        if rng.random() < 0.12:
            picture = augment.glasses(rng, picture, points, scale)
        while rng.random() < 0.25:
            picture = augment.occlude(rng, picture, points, scale)
        return picture, points, keep[..., 0]


def _open_jaw(shape, amount):
    """Lower everything under the line between the lips, the middle most."""
    upper, lower = augment.INNER_LIPS[:11], augment.INNER_LIPS[11:]
    line = shape[[78, 308], 1].mean()
    width = np.ptp(shape[:468, 0])
    from_middle = np.abs(shape[:, 0] - shape[13, 0]) / width
    below = (shape[:, 1] > line + 0.01) & (from_middle < 0.4)
    below[upper] = False
    below[lower] = True
    mouth = np.abs(shape[308, 0] - shape[78, 0]) / width / 2
    fade = np.clip(1 - (from_middle / 0.45) ** 2, 0, 1)
    fade[lower] = np.sqrt(np.clip(1 - (from_middle[lower] / (mouth * 1.02)) ** 2, 0, 1))
    shape[below, 1] += (amount * fade)[below]


def _close_eyes(shape, share):
    """Bring the upper lids down to the lower ones; the irises stay behind them."""
    for upper, lower in zip(augment.UPPER_LIDS, augment.LOWER_LIDS):
        shape[upper] += share * 0.9 * (shape[lower] - shape[upper])


class PointsSamples:
    """Crops for the points network."""

    def __init__(self, faces, seed, count):
        self.faces, self.seed, self.count = faces, seed, count

    def __len__(self):
        return self.count

    def __getitem__(self, index):
        """image [3, S, S] uint8 RGB, target [478, 2] crop sides from the middle, presence."""
        rng = np.random.default_rng((self.seed, 1, index))
        faces = self.faces
        canvas = faces.backgrounds.cut(rng, CROP, CROP)
        present = rng.random() > 0.15
        target = np.zeros((frames.POINTS, 2), np.float32)
        if present:
            near = 1.0 if rng.random() < 0.5 else 0.3  # first and second look
            roll = rng.normal(0, np.radians(9) * near)
            if rng.random() < 0.15:
                roll += rng.uniform(-0.6, 0.6)
            picture, points = self.framed(rng, canvas, near, roll)
            target = (points / CROP - 0.5).astype(np.float32)
        else:
            picture = self.without_face(rng, canvas)
        picture = augment.photograph(rng, picture)
        picture = cut_borders(rng, picture, 0.12)
        return _planes(picture), target, np.float32(present)

    def framed(self, rng, canvas, near, roll):
        """A face in its crop, off by about `near` times the finder's errors.

        Returns:
            picture [S, S, 3] uint8 BGR, points [478, 2] pixels
        """
        faces = self.faces
        relief, posed, opened = faces.posed(rng)
        order = slice(None)
        if rng.random() < 0.5:
            posed[:, 0] *= -1
            order = faces.order
        frame = frames.frame_of_points(posed[: frames.POINTS, :2][order])
        scale = CROP / (frame.size * frames.CROP_MARGIN) * np.exp(rng.normal(0, 0.12 * near))
        linear = frames.rotation(roll - frame.roll) * scale
        offset = CROP / 2 - linear @ frame.center + rng.normal(0, 0.06 * near, 2) * CROP
        picture, points, _ = faces.paint(rng, relief, posed, opened, linear, offset, canvas)
        return picture, points[order]

    def without_face(self, rng, canvas):
        """Background; a person at a wrong place or size; a face painted over or far from upright."""
        kind = rng.random()
        if kind < 0.4:
            return canvas
        if kind < 0.55:
            return self.framed(rng, canvas, 1.0, np.pi + rng.uniform(-1.7, 1.7))[0]
        if kind < 0.75:
            picture, points = self.framed(rng, canvas, 0.5, rng.normal(0, 0.15))
            return cover_face(rng, picture, points, self.faces.backgrounds)
        relief, posed, opened = self.faces.posed(rng)
        scale = CROP * rng.choice([rng.uniform(0.12, 0.3), rng.uniform(2, 4)])
        linear = frames.rotation(rng.uniform(-1, 1)) * scale
        angle = rng.uniform(0, 2 * np.pi)
        shift = (0.55 * CROP + 0.35 * scale) * np.array([np.cos(angle), np.sin(angle)])
        offset = CROP / 2 + shift
        return self.faces.paint(rng, relief, posed, opened, linear, offset, canvas)[0]


def cover_face(rng, picture, points, backgrounds):
    """Paint over a whole face with a plain or textured patch: hair and shoulders alone stay."""
    frame = frames.frame_of_points(points)
    height, width = picture.shape[:2]
    if rng.random() < 0.5:
        patch = backgrounds.cut(rng, height, width)
    else:
        cheek = np.clip(points[rng.integers(468)].astype(int), 0, (width - 1, height - 1))
        patch = np.broadcast_to(picture[cheek[1], cheek[0]], picture.shape)
    covered = np.zeros((height, width), np.float32)
    axes = int(0.5 * frame.size) + 1, int(0.58 * frame.size) + 1
    middle = tuple(frame.center.astype(int).tolist())
    cv2.ellipse(covered, middle, axes, np.degrees(frame.roll), 0, 360, 1.0, -1)
    covered = cv2.GaussianBlur(covered, (0, 0), 1.5)[..., None]
    return (picture + (patch.astype(np.float32) - picture) * covered).astype(np.uint8)


class FinderSamples:
    """Small pictures with any number of faces for the finder."""

    def __init__(self, faces, seed, count):
        self.faces, self.seed, self.count = faces, seed, count

    def __len__(self):
        return self.count

    def __getitem__(self, index):
        """image [3, S, S] uint8 RGB, target [8, S/8, S/8]: see `finder_target`."""
        rng = np.random.default_rng((self.seed, 2, index))
        faces = self.faces
        picture = faces.backgrounds.cut(rng, CANVAS, CANVAS)
        placed = []
        for _ in range(rng.choice(5, p=[0.18, 0.47, 0.2, 0.1, 0.05])):
            size = float(np.exp(rng.uniform(np.log(18), np.log(130))))
            limit = max(CANVAS / 2 - 0.42 * size, 0) + 0.06 * size
            center = CANVAS / 2 + rng.uniform(-limit, limit, 2)
            if any(np.linalg.norm(center - c) < 0.75 * (size + s) for c, s, _ in placed):
                continue
            relief, posed, opened = faces.posed(rng)
            if rng.random() < 0.5:
                posed[:, 0] *= -1
                order = faces.order
            else:
                order = slice(None)
            frame = frames.frame_of_points(posed[: frames.POINTS, :2][order])
            roll = rng.normal(0, 14) if rng.random() < 0.6 else rng.uniform(-42, 42)
            roll = np.radians(np.clip(roll, -42, 42))
            linear = frames.rotation(roll - frame.roll) * (size / frame.size)
            offset = center - linear @ frame.center
            behind = picture
            picture, points, covered = faces.paint(
                rng, relief, posed, opened, linear, offset, picture
            )
            if any(_share_covered(covered, c, s) > 0.05 for c, s, _ in placed):
                picture = behind
                continue
            if rng.random() < 0.12:
                picture = cover_face(rng, picture, points[order], faces.backgrounds)
            else:
                placed.append((center, size, roll))
        picture = augment.photograph(rng, picture, 0.8)
        picture = cut_borders(rng, picture, 0.1, [(c, s) for c, s, _ in placed])
        return _planes(picture), finder_target(placed, CANVAS // FINDER_STRIDE)


def _share_covered(covered, center, size):
    """Share of a face that something painted later lies on."""
    y, x = np.mgrid[: covered.shape[0], : covered.shape[1]]
    inside = np.hypot(x - center[0], y - center[1]) < 0.5 * size
    return float(covered[inside].mean()) if inside.any() else 0.0


def finder_target(placed, cells):
    """What the finder should say.

    Args:
        placed: list of (center [2] pixels, size pixels, roll radians).
        cells: G, cells on a side.

    Returns:
        [8, G, G] float32: score 0..1, x and y offset (cells), log(size / 48), cosine, sine,
        weight of these five, weight of the score.
    """
    target = np.zeros((8, cells, cells), np.float32)
    target[7] = 1
    y, x = np.mgrid[:cells, :cells] + 0.5
    for center, size, roll in placed:
        dx, dy = center[0] / FINDER_STRIDE - x, center[1] / FINDER_STRIDE - y
        distance = np.hypot(dx, dy)
        radius = max(0.12 * size / FINDER_STRIDE, 0.4)
        score = np.exp(-0.5 * (distance / radius) ** 2)
        nearest = np.unravel_index(distance.argmin(), distance.shape)
        score[nearest] = 1
        core = score > 0.5
        if size < 20 or size > 110:  # the neighbouring pyramid level is in charge
            target[7][distance < 0.5 * size / FINDER_STRIDE + 1] = 0.2
        target[0] = np.maximum(target[0], score)
        values = dx, dy, np.log(size / 48), np.cos(roll), np.sin(roll), 1.0
        for channel, value in enumerate(values, 1):
            target[channel][core] = value[core] if np.ndim(value) else value
    return target


def cut_borders(rng, picture, chance, keep=()):
    """Grey bands as outside the picture, never over more than a little of the faces in `keep`."""
    for side in range(4):
        if rng.random() >= chance:
            continue
        height, width = picture.shape[:2]
        depth = rng.uniform(0, 0.3)
        for center, size in keep:
            along = center[side % 2] / width
            room = along if side < 2 else 1 - along
            depth = min(depth, max(room - 0.42 * size / width, 0))
        n = int(depth * width)
        if n == 0:
            continue
        window = [np.s_[:, :n], np.s_[:n], np.s_[:, -n:], np.s_[-n:]][side]
        picture[window] = frames.PADDING
    return picture


def _planes(picture):
    return np.ascontiguousarray(picture[..., ::-1].transpose(2, 0, 1))
