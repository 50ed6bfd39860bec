"""Training samples of the detector's two networks, with what they should answer.

A sample depends on its number and the seed alone, so a run that was stopped goes on with the
samples it would have seen.
"""

import cv2
import numpy as np

from bakery.detectors import frames
from bakery.detectors.blocks import FINDER_STRIDE

CANVAS = 192  # side of a finder sample, pixels


class BaseSamples:
    """Photographed faces seen anew, upright in the middle of a picture that crops are cut from."""

    def __init__(self, faces, side, margin):
        """side: pixels; margin: side / size of the face."""
        self.faces, self.side, self.margin = faces, side, margin

    def face(self, rng, roll=0.0, scale=1.0, shift=(0.0, 0.0)):
        """A face in its picture.

        Args:
            roll: radians; scale: of the face; shift: of its middle, sides of the picture.

        Returns:
            picture [S, S, 3] uint8 BGR, points [478, 2] pixels
        """
        faces, side = self.faces, self.side
        canvas = faces.backgrounds.cut(rng, side, side)
        relief, posed, opened = faces.posed(rng)
        order = slice(None)
        if rng.random() < 0.5:
            posed[:, 0] *= -1
            order = faces.order
        frame = frames.frame_of_points(posed[: frames.POINTS, :2][order])
        linear = frames.rotation(roll - frame.roll) * (scale * side / (frame.size * self.margin))
        offset = side / 2 - linear @ frame.center + np.multiply(shift, side)
        picture, points, _ = faces.paint(rng, relief, posed, opened, linear, offset, canvas)
        return picture, points[order]

    def without_face(self, rng):
        """Background; a person at a wrong place or size; a face painted over or far from upright."""
        kind = rng.random()
        if kind < 0.4:
            return self.faces.backgrounds.cut(rng, self.side, self.side)
        if kind < 0.55:
            return self.face(rng, np.pi + rng.uniform(-1.7, 1.7))[0]
        if kind < 0.8:
            picture, points = self.face(rng, rng.normal(0, 0.15))
            return occlude_face(rng, picture, points, self.faces.backgrounds)
        angle = rng.uniform(0, 2 * np.pi)
        scale = rng.choice([rng.uniform(0.12, 0.3), rng.uniform(2, 3)])
        shift = (0.32 + 0.3 * scale) * np.array([np.cos(angle), np.sin(angle)])
        return self.face(rng, rng.uniform(-1, 1), scale, shift)[0]


def occlude_face(rng, picture, points, backgrounds):
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
            size = float(np.exp(rng.uniform(np.log(12), np.log(130))))
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
                picture = occlude_face(rng, picture, points[order], faces.backgrounds)
            else:
                placed.append((center, size, roll))
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
        if size < 14 or size > 110:  # the neighbouring pyramid level is in charge
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
