"""Faces painted anew from a few photos: other shapes, other poses, the mirror image."""

import numpy as np

from bakery import landmarks as marks
from bakery.detectors import frames
from bakery.train import augment
from bakery.train.relief import make_relief, pose, render, reshape

SHUT = 0.6, 0.15, 0.25  # chances that lips stay as photographed, touch, part less
LIP_REACH = 0.15  # face sizes from the line between the lips over which skin follows them


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
        if rng.random() < 0.15:
            shape = self.shapes[index].copy()
        part_lips(shape, self.shapes[index], rng.choice([1.0, 0.0, rng.random()], p=SHUT))
        opened = rng.random() < 0.25
        if opened:
            _open_jaw(shape, np.exp(rng.uniform(np.log(0.004), np.log(0.2))))
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


def part_lips(shape, photo, share):
    """Part the lips of a morphed shape as far as its photo shows them parted, times `share`.

    A photo of shut lips that is morphed towards a laugh shows no opening, whatever its points say:
    a network that learns from it sees shut lips as open and wide ones as narrow. Squeezed teeth
    vanish, so lips that touch can be made of parted ones.

    Args:
        shape: [478, 3] face sizes, changed in place.
        photo: [478, 3] the same face as photographed.
        share: 0 makes the lips touch.
    """
    upper, lower = marks.LIPS_INNER_UPPER, marks.LIPS_INNER_LOWER
    width = np.ptp(shape[marks.LIPS, 0]) / max(np.ptp(photo[marks.LIPS, 0]), 1e-6)
    gap = (photo[lower] - photo[upper]) * share * width
    middle = (shape[upper] + shape[lower]) / 2
    order = np.argsort(middle[:, 0])
    across = middle[order, 0]
    line = np.interp(shape[: marks.FACE, 0], across, middle[order, 1])
    below = shape[: marks.FACE, 1] > line
    below[upper], below[lower] = False, True
    for rows, target, own in ((upper, middle - gap / 2, ~below), (lower, middle + gap / 2, below)):
        move = (target - shape[rows])[order]
        x, y = shape[: marks.FACE, 0], shape[: marks.FACE, 1]
        depth = np.abs(y - np.interp(x, across, shape[rows, 1][order]))
        fade = np.clip(1 - depth / LIP_REACH, 0, 1) * own
        fade *= (x >= across[0]) & (x <= across[-1])
        shift = np.stack([np.interp(x, across, column) for column in move.T], 1)
        exact = target.copy()
        shape[: marks.FACE] += fade[:, None] * shift
        shape[rows] = exact


def _open_jaw(shape, amount):
    """Lower everything under the line between the lips, the middle most."""
    upper, lower = marks.LIPS_INNER_UPPER, marks.LIPS_INNER_LOWER[1:-1]
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
    for upper, lower in zip(marks.LIDS_UPPER, marks.LIDS_LOWER):
        shape[upper] += share * 0.9 * (shape[lower] - shape[upper])
