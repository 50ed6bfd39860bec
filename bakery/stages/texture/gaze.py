"""Gaze textures: both eye proxies for each of the gaze directions (paGAN section 6)."""

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import ArrayLike

from bakery.generators.base import Subject
from bakery.generators.eyes import look_up
from bakery.generators.shade import EYES, is_part
from bakery.geometry import camera as cameras
from bakery.geometry.fill import diffuse
from bakery.geometry.sample import bilinear
from bakery.heads.base import look
from bakery.stages.texture.proxies import Proxy
from bakery.types import EXPRESSIONS, Camera, Conditions, Generated

SCALE = 2.0  # pixels of the eye strip per pixel of the generator's 512 picture
RIM = np.ones((5, 5), np.uint8)  # pixels of the strip on both sides of the rim
MARGIN = 48  # pixels of context around the eyes at that scale


def strip_camera(subject: Subject, camera: Camera) -> Camera:
    """Cut the two eyes out of the face camera, sides a multiple of 32."""
    centers = subject.head.eye_centers(subject.neutral)
    pixels = cameras.project(centers, camera)
    half_width = np.abs(pixels[0, 0] - pixels[1, 0]) * 0.85
    half_height = half_width * 0.36
    middle = pixels.mean(0)
    width = int(np.ceil((2 * half_width * SCALE + MARGIN) / 32) * 32)
    height = int(np.ceil((2 * half_height * SCALE + MARGIN) / 32) * 32)
    corner = middle - np.array([width, height]) / 2 / SCALE
    return cameras.crop(camera, corner[0], corner[1], width, height, SCALE)


def with_own_gaze(directions: ArrayLike, gaze: np.ndarray) -> np.ndarray:
    """The directions [n, 2] with the nearest one moved to the photo's own gaze [2].

    So one texture shows the eyes just as they were photographed.
    """
    out = np.array(directions, float)
    out[((out - gaze) ** 2).sum(1).argmin()] = gaze
    return out


def gaze_expression(gaze: Sequence[float] | np.ndarray) -> np.ndarray:
    """The expression [E] that a gaze [2] degrees is painted with: lids follow the eyes."""
    return look(np.zeros(len(EXPRESSIONS), np.float32), gaze)


def gaze_texture(
    picture: tuple[Conditions, Generated], subject: Subject, caps: Sequence[Proxy]
) -> np.ndarray:
    """Both caps for one gaze: [h, 2 w, 3] float16 linear.

    The generator's picture is used where resting lids leave the eye open, so that it holds their
    shade (lids opened wider: 1.5 dB less in the eyes); behind the lids the turned eyeball continues
    it, in the light that the open part shows.

    Args:
        picture: (Conditions, Generated) of the eye strip.
        caps: see `texture.proxies.eye_proxies`.
    """
    seen, made = picture
    camera, gaze = seen.camera, seen.gaze
    sides = []
    for which, (cap, name) in enumerate(zip(caps, EYES)):
        points = cap.at(subject.neutral)
        direction = points - subject.head.eye_centers(subject.neutral)[which]
        direction /= np.linalg.norm(direction, axis=1, keepdims=True)
        ball, glint = look_up(subject.eyes, which, direction, gaze)
        behind = cap.paint(ball)
        pixels = cameras.project(points, camera)
        # Pixels on the rim show the lid in part; on the cap they would be a thin dark line.
        shown = cv2.erode(is_part(seen.part, name).astype(np.float32), RIM)
        weight = cap.paint(np.clip(bilinear(shown, pixels) * 2 - 1, 0, 1))
        sampled = cap.paint(bilinear(made.image, pixels) - glint)
        light = np.log(np.maximum(sampled, 1e-3) / np.maximum(behind, 1e-3)).mean(-1, keepdims=True)
        light = diffuse(np.clip(light, -1.5, 0.7), weight)
        hidden = behind * np.exp(np.clip(light, -1.0, 0.2))
        mixed = sampled * weight[..., None] + hidden * (1 - weight[..., None]) + cap.paint(glint)
        sides.append(np.where(cap.inside[..., None] > 0, mixed, mixed[cap.inside > 0].mean(0)))
    return np.concatenate(sides, axis=1).astype(np.float16)
