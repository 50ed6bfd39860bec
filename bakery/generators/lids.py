"""The skin that shows when an eye shuts."""

from dataclasses import dataclass

import numpy as np

from bakery.geometry.fill import smoothstep
from bakery.geometry.sample import bilinear
from bakery.types import EXPRESSION_INDEX

SHUTS = (0.2, 0.75)  # eyeBlink at which lid skin begins to show, and shows wholly


@dataclass(frozen=True)
class LidSkin:
    """Both upper lids of one person without their lashes, on the atlas."""

    color: np.ndarray  # [t, t, 3] float32 linear
    mask: np.ndarray  # [t, t, 2] float32 0..1, left and right lid


def lid_cover(lids, expression, uv):
    """Colour [H, W, 3] and alpha [H, W] of shut lids at uv [H, W, 2] for an expression [E]."""
    size = lids.color.shape[0]
    shut = [
        smoothstep(*SHUTS, float(expression[EXPRESSION_INDEX["eyeBlink" + side]]))
        for side in ("Left", "Right")
    ]
    if not any(shut):
        return None
    alpha = bilinear(np.ascontiguousarray(lids.mask), uv * size) @ np.float32(shut)
    return bilinear(lids.color, uv * size), np.clip(alpha, 0, 1)
