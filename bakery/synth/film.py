"""From scene light to a photograph: background, tone, lens, grain and JPEG."""

import cv2
import numpy as np

from bakery.formats.image import compressed
from bakery.geometry.color import to_encoded


def background(rng, kind, height, width, base):
    """An out-of-focus background [H, W, 3] linear.

    Args:
        kind: "studio", "room" or "garden".
        base: [3] linear colour it is made around.
    """
    h, w = max(8, height // 8), max(8, width // 8)
    y, x = np.mgrid[:h, :w]
    x, y = (x + 0.5) / w - 0.5, (y + 0.5) / h - 0.5
    base = np.asarray(base, float)
    if kind == "studio":
        middle = rng.uniform(-0.25, 0.25, 2) + [0, 0.1]
        glow = np.exp(
            -((x - middle[0]) ** 2 + (y - middle[1]) ** 2) / (2 * rng.uniform(0.3, 0.55) ** 2)
        )
        picture = base * (0.42 + 0.75 * glow[..., None])
    else:
        picture = np.ones((h, w, 3)) * base * (1.05 - 0.5 * y[..., None])
        for _ in range(26 if kind == "room" else 60):
            color = base * np.exp(rng.normal(size=3) * 0.16 + rng.normal() * 0.65)
            if kind == "garden":
                color = color * np.array([0.85, 1.06, 0.66]) ** rng.uniform(0, 1.5)
            cx, cy = rng.integers(0, w), rng.integers(0, h)
            size = (rng.uniform(0.03, 0.35, 2) * [w, h]).astype(int) + 1
            layer = picture.copy()
            if kind == "room":
                cv2.rectangle(
                    layer,
                    (int(cx), int(cy)),
                    (int(cx + size[0]), int(cy + 2 * size[1])),
                    color.tolist(),
                    -1,
                )
            else:
                cv2.circle(layer, (int(cx), int(cy)), int(size.min() * 0.5) + 1, color.tolist(), -1)
            picture = picture * 0.35 + layer * 0.65
        picture = cv2.GaussianBlur(picture, (0, 0), w * (0.055 if kind == "room" else 0.035))
    picture = cv2.resize(picture.astype(np.float32), (width, height), interpolation=cv2.INTER_CUBIC)
    return np.maximum(picture, 0.001)


def tone(linear):
    """A gentle film curve on linear light: keeps middle greys, rolls highlights off below 1."""
    x = np.maximum(linear, 0)
    knee = 0.55
    high = knee + (1 - knee) * (1 - np.exp(-(x - knee) / (1 - knee)))
    return np.where(x < knee, x, high)


def develop(linear, rng, grain=1.0, blur=0.5, quality=94, vignette=0.12, contrast=0.0):
    """Scene light [H, W, 3] to an sRGB-encoded photo [H, W, 3] float32.

    Args:
        grain: 1 is a clean camera at low sensitivity.
        blur: Gaussian sigma in pixels.
        quality: of the JPEG it passes through; None for none.
        vignette: share of light lost in the corners.
        contrast: 0..1 of an S-shaped curve, as a camera's own rendering has.
    """
    height, width = linear.shape[:2]
    y, x = np.mgrid[:height, :width].astype(np.float32)
    r2 = ((x / width - 0.5) ** 2 + (y / height - 0.5) ** 2) * 2
    out = tone(linear * (1 - vignette * r2 * r2 * 2 - 0.3 * vignette * r2)[..., None])
    if blur > 0:
        out = cv2.GaussianBlur(out.astype(np.float32), (0, 0), blur)
    noise = rng.normal(size=out.shape).astype(np.float32)
    noise = cv2.GaussianBlur(noise, (0, 0), 0.6) * 2.0
    shot = np.sqrt(np.maximum(out, 0) * 1.2e-4 + 2e-6)
    encoded = to_encoded(out + grain * shot * noise)
    if contrast:
        encoded += contrast * encoded * (1 - encoded) * (2 * encoded - 0.92)
    if quality is None:
        return encoded
    pixels = np.round(encoded[..., ::-1] * 255).astype(np.uint8)
    data = compressed(".jpg", pixels, [cv2.IMWRITE_JPEG_QUALITY, int(quality)])
    return cv2.imdecode(data, cv2.IMREAD_COLOR)[..., ::-1].astype(np.float32) / 255
