"""Pictures without faces: what training pastes faces on, and what must not be taken for one."""

from pathlib import Path

import cv2
import numpy as np

IMAGE_SUFFIXES = {".jpg", ".jpeg", ".png", ".webp"}


def procedural_background(rng, size=256):
    """One random face-free picture [size, size, 3] uint8: noise, gradients, shapes, stripes."""
    kind = rng.integers(7)
    a, b = rng.uniform(0, 255, (2, 3))
    if kind == 0:  # flat or gradient
        angle, spread = rng.uniform(0, 2 * np.pi), rng.uniform(0, 1)
        y, x = np.mgrid[:size, :size] / size - 0.5
        t = np.clip(0.5 + spread * (np.cos(angle) * x + np.sin(angle) * y), 0, 1)
        image = a + (b - a) * t[..., None]
    elif kind == 1:  # cloud
        image = a + (b - a) * fractal_noise(rng, size, rng.uniform(0.4, 0.9))[..., None]
    elif kind == 2:  # coloured noise
        image = np.stack([fractal_noise(rng, size, rng.uniform(0.5, 1)) for _ in range(3)], -1)
        image = 255 * image
    elif kind == 3:  # stripes or tiles
        y, x = np.mgrid[:size, :size]
        angle, period = rng.uniform(0, np.pi), rng.uniform(6, 80)
        u = np.cos(angle) * x + np.sin(angle) * y
        v = -np.sin(angle) * x + np.cos(angle) * y
        t = np.sin(2 * np.pi * u / period)
        if rng.random() < 0.5:
            t = t * np.sin(2 * np.pi * v / (period * rng.uniform(0.3, 3)))
        t = np.clip(t * rng.uniform(0.7, 8), -1, 1) * 0.5 + 0.5
        image = a + (b - a) * t[..., None]
    else:  # clutter
        image = np.full((size, size, 3), a)
        if rng.random() < 0.7:
            image = a + (b - a) * fractal_noise(rng, size, 0.6)[..., None]
        image = np.ascontiguousarray(image).clip(0, 255).astype(np.uint8)
        for _ in range(rng.integers(3, 40)):
            draw_shape(rng, image, size * rng.uniform(0.02, 0.4))
    if rng.random() < 0.5:
        image = image * (0.7 + 0.6 * fractal_noise(rng, size, rng.uniform(0.3, 0.9))[..., None])
    image = np.clip(image, 0, 255).astype(np.uint8)
    if rng.random() < 0.3:
        image = cv2.GaussianBlur(image, (0, 0), rng.uniform(0.7, 5))
    return image


def fractal_noise(rng, size, roughness):
    """[size, size] 0..1: octaves of noise, each finer one `roughness` times as strong."""
    total, strength = np.zeros((size, size), np.float32), 1.0
    cells = int(rng.integers(2, 5))
    while cells <= size:
        octave = rng.standard_normal((cells, cells)).astype(np.float32)
        total += strength * cv2.resize(octave, (size, size), interpolation=cv2.INTER_CUBIC)
        strength *= roughness
        cells *= 2
    total -= total.min()
    return total / max(float(total.max()), 1e-6)


def draw_shape(rng, image, extent):
    """Draw one ellipse, polygon, line or word of about `extent` pixels into [H, W, 3] uint8."""
    height, width = image.shape[:2]
    colour = rng.uniform(0, 255, 3).tolist()
    center = rng.uniform(0, 1, 2) * (width, height)
    kind = rng.integers(4)
    if kind == 0:
        axes = tuple(int(v) for v in np.maximum(extent * rng.uniform(0.2, 1, 2), 1))
        angle = rng.uniform(0, 360)
        thickness = -1 if rng.random() < 0.7 else int(rng.integers(1, 5))
        middle = tuple(int(v) for v in center)
        cv2.ellipse(image, middle, axes, angle, 0, 360, colour, thickness, cv2.LINE_AA)
    elif kind == 1:
        corners = center + rng.uniform(-extent, extent, (rng.integers(3, 7), 2))
        cv2.fillPoly(image, [corners.astype(np.int32)], colour, cv2.LINE_AA)
    elif kind == 2:
        ends = np.stack([center, center + rng.uniform(-3 * extent, 3 * extent, 2)]).astype(int)
        thickness = int(rng.integers(1, 8))
        cv2.line(image, ends[0].tolist(), ends[1].tolist(), colour, thickness, cv2.LINE_AA)
    else:
        word = "".join(chr(rng.integers(33, 126)) for _ in range(rng.integers(1, 12)))
        at = tuple(int(v) for v in center)
        thickness = int(rng.integers(1, 4))
        cv2.putText(image, word, at, int(rng.integers(0, 8)), extent / 30 + 0.2, colour, thickness)


def read_pictures(folders):
    """All face-free pictures of some folders, [H, W, 3] uint8 BGR, at most 640 pixels long."""
    pictures = []
    for folder in folders:
        for path in sorted(Path(folder).iterdir()):
            if path.suffix.lower() not in IMAGE_SUFFIXES:
                continue
            image = cv2.imread(str(path))
            if image is not None:
                scale = min(1.0, 640 / max(image.shape[:2]))
                pictures.append(
                    cv2.resize(image, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
                )
    return pictures


class Backgrounds:
    """A bank of face-free pictures to cut random windows from."""

    def __init__(self, folders=(), count=400, seed=0):
        rng = np.random.default_rng(seed)
        self.procedural = [procedural_background(rng) for _ in range(count)]
        self.pictures = read_pictures(folders)

    def cut(self, rng, height, width):
        """A random window [height, width, 3] uint8 of a random picture, mirrored half the time."""
        if self.pictures and rng.random() < 0.5:
            image = self.pictures[rng.integers(len(self.pictures))]
        else:
            image = self.procedural[rng.integers(len(self.procedural))]
        rows, columns = image.shape[:2]
        share = rng.uniform(0.15, 1)
        h = max(int(min(rows, columns * height / width) * share), 2)
        w = max(int(h * width / height), 2)
        w = min(w, columns)
        y, x = rng.integers(rows - h + 1), rng.integers(columns - w + 1)
        window = cv2.resize(image[y : y + h, x : x + w], (width, height))
        return np.ascontiguousarray(window[:, ::-1]) if rng.random() < 0.5 else window
