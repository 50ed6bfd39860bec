"""An avatar in memory, ready to be played."""

from dataclasses import dataclass

import numpy as np

from bakery.heads.base import HeadModel
from bakery.types import Fit, Textures


@dataclass(frozen=True, eq=False)
class Avatar:
    """One baked person."""

    head: HeadModel
    neutral: np.ndarray  # [V, 3] mm
    fit: Fit  # of the portrait: camera and expression as photographed
    textures: Textures
    masks: np.ndarray  # [E, m, m] float32 0..1, A_e; any resolution
    photo: np.ndarray | None = None  # [H, W, 3] float32 sRGB-encoded, only if the bundle keeps it
