"""Label maps as indexed PNG: every pixel holds its label, the palette shows it in colours."""

import io

import numpy as np
from PIL import Image


def encode_labels(labels: np.ndarray, colors: np.ndarray) -> bytes:
    """The bytes of an indexed PNG.

    Args:
        labels: [H, W] uint8 below n.
        colors: [n, 3] uint8, the palette.
    """
    picture = Image.fromarray(np.ascontiguousarray(labels, np.uint8), "P")
    picture.putpalette(np.asarray(colors, np.uint8).tobytes())
    buffer = io.BytesIO()
    picture.save(buffer, "PNG", optimize=True)
    return buffer.getvalue()
