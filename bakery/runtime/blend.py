"""The face texture of a frame: equation 4 of paGAN."""

import cv2
import numpy as np
from numpy.typing import ArrayLike

from bakery.heads.eyes import CAP_ANGLE
from bakery.types import Textures


def face_texture(textures: Textures, masks: np.ndarray, expression: np.ndarray) -> np.ndarray:
    """Blend T_0 and the key textures for one frame.

    Args:
        textures: Textures.
        masks: [E, m, m] A_e; weights are formed at this resolution and then enlarged.
        expression: [E] weights a_e^t.

    Returns:
        [T, T, 3] float32 linear.
    """
    size = textures.neutral.shape[0]
    neutral_weight, key_weights = key_activation(masks, textures.key_weights, expression)
    out: np.ndarray = np.asarray(textures.neutral, np.float32) * _enlarge(neutral_weight, size)
    for weight, texture in zip(key_weights, textures.keys):
        if weight.max() > 1e-4:
            out += np.asarray(texture, np.float32) * _enlarge(weight, size)
    return out


def key_activation(
    masks: np.ndarray, key_weights: np.ndarray, expression: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """w_k and w_0 of paGAN eq. 4, normalised to sum 1.

    Args:
        masks: [E, ...] A_e.
        key_weights: [K, E] a_e^k.
        expression: [E] a_e^t.

    Returns:
        neutral weight [...] and key weights [K, ...].
    """
    product = (key_weights * expression[None]).astype(np.float32)  # [K, E]
    used = np.flatnonzero(product.any(0))
    keys = np.tensordot(product[:, used], masks[used], 1)  # [K, ...]
    total = keys.sum(0)
    neutral = np.maximum(0, 1 - total)
    scale = 1 / np.maximum(neutral + total, 1e-6)
    return neutral * scale, keys * scale


def lay_hair(texture: np.ndarray, hair: ArrayLike) -> np.ndarray:
    """A face texture [T, T, 3] with the hair layer [T, T, 4] over it; both linear, float32."""
    hair = np.asarray(hair, np.float32)
    laid: np.ndarray = texture * (1 - hair[..., 3:]) + hair[..., :3]
    return laid


def _enlarge(weight: np.ndarray, size: int) -> np.ndarray:
    if weight.shape[0] != size:
        weight = cv2.resize(weight, (size, size), interpolation=cv2.INTER_LINEAR)
    return weight[..., None]


def nearest_gaze(directions: ArrayLike, gaze: np.ndarray) -> int:
    """Index of the gaze texture whose direction [n, 2] degrees is nearest to gaze [2]."""
    return int(((np.asarray(directions) - gaze) ** 2).sum(1).argmin())


def gaze_slide(rest: np.ndarray) -> np.ndarray:
    """How far an eye proxy's picture slides to look `rest` [2] degrees beyond its own direction.

    The nearest of 20 pictures is up to several degrees off; its cap's chart is azimuthal, so that
    sliding it turns the eye by the rest.

    Returns:
        [2] shares of the cap's rectangle, columns and rows.
    """
    return np.array([rest[0], -rest[1]]) / (2 * CAP_ANGLE)
