"""The skin that shows when an eye shuts."""

from dataclasses import dataclass

import numpy as np

from bakery.generators.shade import is_part
from bakery.geometry.fill import smoothstep
from bakery.geometry.sample import bilinear, interpolate
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


def with_lids(subject, conditions, color, alpha):
    """Shut lids laid into the colour [H, W, 3] and alpha [H, W] of a generated picture."""
    head = subject.head
    uv = interpolate(conditions.fragments, head.uv[head.uv_faces])
    cover = lid_cover(subject.lids, conditions.expression, uv)
    if cover is None:
        return color, alpha
    skin = is_part(conditions.part, "skin")
    lid = np.where(skin, cover[1], 0)
    both = lid + alpha * (1 - lid)
    mixed = cover[0] * lid[..., None] + color * (alpha * (1 - lid))[..., None]
    return np.where(both[..., None] > 0, mixed / np.maximum(both, 1e-6)[..., None], color), both
