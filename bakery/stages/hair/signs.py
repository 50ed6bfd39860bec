"""What of a photo's hair is made up, measured in its labels."""

import numpy as np

from bakery.landmarks import face_size
from bakery.stages.segment import HAIR, HAT, Segmentation


def hair_signs(segmentation: Segmentation, points: np.ndarray) -> dict[str, float]:
    """Numbers that tell of hair that is partly made up.

    Args:
        points: [L, 2] pixels.

    Returns:
        "hat": area of a hat, over the square of the eye distance; "hair_cut": length of the picture's
        edge that hair touches, over the eye distance.
    """
    size = face_size(points)
    hair = segmentation.regions == HAIR
    edge = hair[0].sum() + hair[-1].sum() + hair[:, 0].sum() + hair[:, -1].sum()
    hat = (segmentation.labels == HAT).sum()
    return {"hat": float(hat / size**2), "hair_cut": float(edge / size)}
