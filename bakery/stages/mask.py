"""Activation masks and the blend that they drive (paGAN section 5)."""

import cv2
import numpy as np

from bakery.heads.base import HeadModel
from bakery.stages.atlas import Atlas

BLUR = 1 / 256  # Gaussian sigma over the atlas's side, as the paper's "small Gaussian blur"


def activation_masks(head: HeadModel, atlas: Atlas) -> np.ndarray:
    """A_e on the atlas: how far expression e moves each point, over the farthest it moves any.

    Args:
        head: HeadModel.
        atlas: Atlas; its size is the masks'.

    Returns:
        [E, T, T] float32 0..1; shapes that the head lacks are 0 everywhere.

    References:
        paGAN section 5: A_e(v) = |e(v) - M(v)|. Dividing by the maximum makes weights of different
        shapes comparable; the paper leaves the scale open.
    """
    moved = np.linalg.norm(head.expression_basis, axis=2)  # [E, V]
    used = head.part_vertices("skin")
    peak = moved[:, used].max(1)
    values = atlas.at((moved / np.maximum(peak, 1e-6)[:, None]).T)  # [N, E]
    skin = atlas.rows("skin")
    out = np.empty((len(moved), atlas.size, atlas.size), np.float32)
    for expression in range(len(moved)):
        if peak[expression] < 0.05:  # mm: no shape
            out[expression] = 0
            continue
        mask = atlas.fill_gutter(atlas.paint(np.where(skin, values[:, expression], 0)))
        out[expression] = np.clip(cv2.GaussianBlur(mask, (0, 0), atlas.size * BLUR), 0, 1)
    return out


def key_activation(
    masks: np.ndarray, key_weights: np.ndarray, expression: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """w_k and w_0 of eq. 4, normalised to sum 1.

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
