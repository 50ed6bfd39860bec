"""Frames of glasses as a layer over the skin, for who wants to keep them; lenses stay clear."""

import numpy as np

from bakery.geometry.sample import bilinear
from bakery.stages.atlas import Atlas, Visibility

SLANT = (88.0, 80.0)  # degrees: temples run along the sides of the head


def frame_layer(
    linear: np.ndarray, frame: np.ndarray, atlas: Atlas, visibility: Visibility
) -> np.ndarray:
    """The frames that a photo shows, on the skin behind them.

    Args:
        linear: [H, W, 3] float32 photo; frame: [H, W] 0..1, where it shows them.
        atlas: of the head's skin; visibility: of that atlas through the photo's camera.

    Returns:
        [T, T, 4] float32, linear, colour multiplied by alpha.
    """
    pixels = visibility.pixels
    alpha = (bilinear(frame, pixels) * visibility.weight(*SLANT))[:, None]
    layer: np.ndarray = atlas.paint(np.concatenate([bilinear(linear, pixels) * alpha, alpha], 1))
    return layer.astype(np.float32)


def laid_over(under: np.ndarray, over: np.ndarray) -> np.ndarray:
    """One layer [T, T, 4] over another, colours multiplied by alpha."""
    out: np.ndarray = over + under * (1 - over[..., 3:])
    return out
