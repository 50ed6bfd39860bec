"""Mask: where each of the 52 expressions acts."""

import numpy as np

from bakery.bake.options import BuildOptions
from bakery.heads.base import HeadModel
from bakery.stages.atlas import make_atlas
from bakery.stages.mask import activation_masks


def draw_masks(head: HeadModel, options: BuildOptions) -> np.ndarray:
    """Activation masks [E, m, m] float32 of a head model."""
    size = min(options.mask.resolution, options.texture.resolution)
    return activation_masks(head, make_atlas(head, size))
