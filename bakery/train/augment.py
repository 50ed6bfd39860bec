"""What a bank changes about a person: tone, glasses, clutter before the face, an opened mouth.

Light, lens, sensor and codec come later, at each step of the training: `train.degrade`.

All functions take and return [H, W, 3] uint8 BGR and a numpy random generator.
"""

import cv2
import numpy as np

from bakery import landmarks as marks
from bakery.train.backgrounds import draw_shape, fractal_noise

INNER_LIPS = (
    [78, 191, 80, 81, 82, 13, 312, 311, 310, 415]
    + [308, 324, 318, 402, 317, 14, 87, 178, 88, 95]
)  # fmt: skip


def tone(rng, image, strength=1.0):
    """Exposure, contrast, gamma and white balance in one table a channel."""
    levels = np.arange(256, dtype=np.float32) / 255
    gamma = np.exp(rng.normal(0, 0.3 * strength))
    gain = np.exp(rng.normal(0, 0.18 * strength)) * np.exp(rng.normal(0, 0.07 * strength, 3))
    contrast = np.exp(rng.normal(0, 0.2 * strength))
    offset = rng.normal(0, 0.05 * strength)
    curve = (levels**gamma)[:, None] * gain
    curve = (curve - 0.5) * contrast + 0.5 + offset
    table = np.clip(255 * curve, 0, 255).astype(np.uint8)
    return cv2.LUT(image, table.reshape(1, 256, 3))


def occlude(rng, image, points, size):
    """Cover parts of a face: blobs, strands, hands and masks as plain or noisy patches.

    Args:
        points: [478, 2] pixels.
        size: of the face, pixels.
    """
    center = points[rng.integers(len(points))]
    kind = rng.integers(3)
    if kind == 0:  # a patch
        covered = np.zeros(image.shape[:2], np.float32)
        corners = center + rng.uniform(-0.45, 0.45, (rng.integers(3, 8), 2)) * size
        cv2.fillConvexPoly(
            covered, cv2.convexHull(corners.astype(np.float32)).astype(np.int32), 1.0
        )
        covered = cv2.GaussianBlur(covered, (0, 0), rng.uniform(0.4, 3))
        texture = np.broadcast_to(rng.uniform(0, 255, 3).astype(np.float32), image.shape)
        if rng.random() < 0.6:
            field = cv2.resize(fractal_noise(rng, 64, 0.7), image.shape[1::-1])
            texture = texture * (0.5 + field[..., None])
        layer = image + (texture - image) * covered[..., None]
        return np.clip(layer, 0, 255).astype(np.uint8)
    image = np.ascontiguousarray(image)
    if kind == 1:  # strands of hair
        start = points[:468].min(0) + rng.uniform(0, 1, 2) * np.ptp(points[:468], axis=0) * (1, 0.3)
        fall = rng.normal(0, 0.2, 2) * size + (0, rng.uniform(0.2, 0.9) * size)
        colour = rng.uniform(0, 160) * rng.uniform(0.5, 1, 3)
        for _ in range(rng.integers(3, 40)):
            ends = np.stack([start, start + fall / 2, start + fall])
            ends = ends + rng.normal(0, 0.05 * size, (3, 2))
            shade = (colour * rng.uniform(0.6, 1.3)).tolist()
            t = np.linspace(0, 1, 8)[:, None]
            line = (1 - t) ** 2 * ends[0] + 2 * t * (1 - t) * ends[1] + t**2 * ends[2]
            thickness = int(rng.integers(1, 4))
            cv2.polylines(image, [line.astype(np.int32)], False, shade, thickness, cv2.LINE_AA)
    else:
        for _ in range(rng.integers(1, 5)):
            draw_shape(rng, image, size * rng.uniform(0.05, 0.3))
    return image


def glasses(rng, image, points, size):
    """Frames around both eyes, with clear, tinted or dark glass."""
    layer = np.ascontiguousarray(image, np.float32)
    glass = layer.copy()
    colour = (rng.uniform(0, 200) * rng.uniform(0.3, 1, 3)).tolist()
    tint = (rng.uniform(0, 120, 3)).tolist()
    share = 0.0 if rng.random() < 0.6 else rng.uniform(0.2, 0.95)
    thickness = max(1, int(size * rng.uniform(0.006, 0.03)))
    across = points[marks.LEFT_EYE_OUTER] - points[marks.RIGHT_EYE_OUTER]
    angle = float(np.degrees(np.arctan2(across[1], across[0])))
    roundness = rng.uniform(0.6, 1.1)
    reach = rng.uniform(0.11, 0.17) * size
    centers = []
    for outer, inner in ((33, 133), (263, 362)):
        center = (points[outer] + points[inner]) / 2 + (0, rng.uniform(-0.01, 0.04) * size)
        centers.append(center)
        oval = cv2.ellipse2Poly((0, 0), (1000, int(1000 * roundness)), 0, 0, 360, 12) / 1000.0
        power = rng.uniform(0.5, 1)
        oval = np.sign(oval) * np.abs(oval) ** power * reach
        turn = np.radians(angle)
        oval = oval @ np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
        outline = [(center + oval).astype(np.int32)]
        cv2.fillPoly(glass, outline, tint, cv2.LINE_AA)
        cv2.polylines(layer, outline, True, colour, thickness, cv2.LINE_AA)
        cv2.polylines(glass, outline, True, colour, thickness, cv2.LINE_AA)
    layer += (glass - layer) * share
    between = centers[1] - centers[0]
    between = between / max(np.linalg.norm(between), 1e-3) * reach
    for start, end in (
        (centers[0] + between, centers[1] - between),
        (points[127], centers[0] - between),
        (points[356], centers[1] + between),
    ):
        ends = start.astype(int).tolist(), end.astype(int).tolist()
        cv2.line(layer, *ends, colour, thickness, cv2.LINE_AA)
    return np.clip(layer, 0, 255).astype(np.uint8)


def open_mouth(rng, image, points):
    """Paint the inside of opened lips: dark red, often with a row of teeth."""
    hole = points[marks.LIPS_INNER]
    covered = np.zeros(image.shape[:2], np.float32)
    cv2.fillPoly(covered, [np.round(hole * 8).astype(np.int32)], 1.0, cv2.LINE_AA, 3)
    inside = np.empty(image.shape, np.float32)
    inside[:] = rng.uniform((5, 5, 20), (50, 45, 110))
    if rng.random() < 0.6:
        upper = points[marks.LIPS_INNER_UPPER]
        depth = (points[14] - points[13]) * rng.uniform(0.2, 0.5)
        teeth = np.concatenate([upper, upper[::-1] + depth])
        cv2.fillPoly(inside, [teeth.astype(np.int32)], rng.uniform(120, 230, 1).repeat(3).tolist())
        inside = cv2.GaussianBlur(inside, (0, 0), 0.8)
    blend = image + (inside - image) * covered[..., None]
    return np.clip(blend, 0, 255).astype(np.uint8)
