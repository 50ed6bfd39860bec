"""What happens to a picture between the face and the file: light, lens, sensor, codec, clutter.

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


def light(rng, image):
    """Uneven light: a smooth field brightens and darkens parts of the picture."""
    height, width = image.shape[:2]
    cells = int(rng.integers(2, 5))
    field = rng.standard_normal((cells, cells, 1)).astype(np.float32)
    if rng.random() < 0.3:  # coloured lamps
        field = field + 0.4 * rng.standard_normal((cells, cells, 3)).astype(np.float32)
    field = np.exp(rng.uniform(0.05, 0.45) * field)
    field = cv2.resize(field, (width, height), interpolation=cv2.INTER_CUBIC)
    if field.ndim == 2:
        field = field[..., None]
    return np.clip(image * field, 0, 255).astype(np.uint8)


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


def saturation(rng, image):
    """Grey, pale or gaudy colours, and a turn of the hue."""
    share = 0.0 if rng.random() < 0.25 else rng.uniform(0.2, 1.8)
    mixing = share * np.eye(3) + (1 - share) * np.array([[0.11, 0.59, 0.30]] * 3)
    mixing = mixing + rng.normal(0, 0.05, (3, 3))
    mixing /= mixing.sum(1, keepdims=True)
    return cv2.transform(image, mixing.astype(np.float32))


def blur(rng, image):
    """Out of focus, shaken, or from a smaller picture."""
    height, width = image.shape[:2]
    kind = rng.integers(3)
    if kind == 0:
        return cv2.GaussianBlur(image, (0, 0), rng.uniform(0.4, 3) * width / 192)
    if kind == 1:
        length = int(rng.integers(3, 10))
        kernel = np.zeros((length, length), np.float32)
        angle, c = rng.uniform(0, np.pi), (length - 1) / 2
        for t in np.linspace(-c, c, 2 * length):
            kernel[round(c + t * np.sin(angle)), round(c + t * np.cos(angle))] = 1
        return cv2.filter2D(image, -1, kernel / kernel.sum())
    scale = rng.uniform(0.2, 0.8)
    small = cv2.resize(image, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    return cv2.resize(
        small, (width, height), interpolation=int(rng.choice([1, 2, 0], p=[0.5, 0.4, 0.1]))
    )


def noise(rng, image):
    """Sensor noise, alike or different in the three channels."""
    height, width = image.shape[:2]
    sigma = rng.uniform(1, 18)
    grain = np.empty((height, width, 3 if rng.random() < 0.6 else 1), np.int16)
    cv2.setRNGSeed(int(rng.integers(1 << 30)))
    cv2.randn(grain, (0,) * 4, (sigma,) * 4)
    return np.clip(image + grain.reshape(height, width, -1), 0, 255).astype(np.uint8)


def compress(rng, image):
    """JPEG at a random quality."""
    quality = [cv2.IMWRITE_JPEG_QUALITY, int(rng.integers(15, 90))]
    return cv2.imdecode(cv2.imencode(".jpg", image, quality)[1], cv2.IMREAD_COLOR)


def photograph(rng, image, amount=1.0):
    """A random chain of the above; `amount` scales how often each one happens."""
    steps = (
        (light, 0.5),
        (tone, 0.85),
        (saturation, 0.4),
        (blur, 0.3),
        (noise, 0.35),
        (compress, 0.3),
    )
    for step, chance in steps:
        if rng.random() < chance * amount:
            image = step(rng, image)
    return image


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
