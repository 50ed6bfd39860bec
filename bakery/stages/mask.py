"""Activation masks (paGAN section 5); `runtime.blend` says what they drive."""

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
