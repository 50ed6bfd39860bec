"""T_k: the textures of the key expressions, unwrapped from generated pictures (paGAN section 5)."""

from collections.abc import Iterable, Sequence

import cv2
import numpy as np

from bakery.generators.base import Subject
from bakery.generators.shade import is_part
from bakery.geometry.fill import diffuse
from bakery.geometry.sample import bilinear
from bakery.heads.base import HeadModel
from bakery.stages.atlas import Atlas, make_atlas, make_view, visibility_of
from bakery.stages.condition import face_camera
from bakery.types import Camera, Conditions, Fit, Generated

RATIO_TEXELS = 512  # the change T_k / T_0 is no finer than the generator's picture


def key_cameras(subject: Subject, fit: Fit, views: Sequence[float]) -> list[Camera]:
    """The cameras [n] that a key expression is painted from, `views` in degrees of yaw."""
    return [face_camera(fit, subject.head, subject.neutral, yaw) for yaw in views]


def ratio_atlas(head: HeadModel, resolution: int) -> Atlas:
    """The atlas of the skin on which ratios are merged, for textures of so many texels a side."""
    return make_atlas(head, min(resolution, RATIO_TEXELS)).take("skin")


def key_ratio(
    pictures: Iterable[tuple[Conditions, Generated]], head: HeadModel, skin: Atlas
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The change T_k / T_0 of one key expression on the skin, merged from several views.

    Args:
        pictures: iterable of (Conditions, Generated), one a view.
        head: HeadModel of the subject.
        skin: Atlas of the skin at the resolution of the ratio.

    Returns:
        log-ratio [T, T, 3], colour [T, T, 3] and alpha [T, T] float32.
    """
    total = np.zeros((len(skin.index), 7), np.float32)
    mass = np.zeros(len(skin.index), np.float32)
    for seen, made in pictures:
        view = make_view(seen.vertices, head, seen.camera)
        visibility = visibility_of(skin, view)
        drawn = cv2.erode(is_part(seen.part, "skin").astype(np.float32), np.ones((3, 3)))
        weight = visibility.weight() * bilinear(drawn, visibility.pixels)
        packed = np.concatenate(
            [np.log(np.maximum(made.ratio, 1e-3)), made.color, made.alpha[..., None]], -1
        )
        total += weight[:, None] * sample_many(packed, visibility.pixels)
        mass += weight
    known = np.minimum(mass, 1)
    merged = total / np.maximum(mass, 1e-6)[:, None]
    weight = skin.paint(known)
    # What no view sees did not change: a faint opinion held everywhere that diffusion respects.
    ratio = diffuse(skin.paint(merged[:, :3] * known[:, None]), np.maximum(weight, 0.01))
    return ratio, skin.paint(merged[:, 3:6]), skin.paint(merged[:, 6] * known)


def sample_many(image: np.ndarray, points: np.ndarray) -> np.ndarray:
    """`bilinear` for more than four channels, which OpenCV's remap does not take."""
    return np.concatenate(
        [
            bilinear(np.ascontiguousarray(image[..., k : k + 4]), points).reshape(len(points), -1)
            for k in range(0, image.shape[2], 4)
        ],
        1,
    )


def key_texture(
    pictures: Iterable[tuple[Conditions, Generated]], subject: Subject, skin: Atlas
) -> np.ndarray:
    """T_k = T_0 x ratio of one key expression.

    Args:
        pictures: iterable of (Conditions, Generated), one a view.
        skin: see `ratio_atlas`.

    Returns:
        [T, T, 3] float16 linear, of the size of the subject's neutral texture.
    """
    layers: Sequence[np.ndarray] = key_ratio(pictures, subject.head, skin)
    resolution = subject.texture.shape[0]
    if resolution != skin.size:
        size = (resolution, resolution)
        layers = [cv2.resize(layer, size, interpolation=cv2.INTER_LINEAR) for layer in layers]
    ratio, color, alpha = layers
    alpha = alpha[..., None]
    return (subject.texture * np.exp(ratio) * (1 - alpha) + color * alpha).astype(np.float16)
