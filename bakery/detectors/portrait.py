"""What the segmentation network sees of a portrait, and the classes it tells apart.

The *portrait crop* is an upright square around the whole head and the shoulders, `SIDE` pixels wide.
"""

import numpy as np

from bakery.detectors import frames
from bakery.paths import ASSETS

CLASSES = (
    "background", "skin", "brows", "eyes", "lips", "mouth", "beard", "hair", "ears", "neck", "cloth",
    "frame", "lens", "hat", "thing",
)  # fmt: skip
(
    BACKGROUND, SKIN, BROWS, EYES, LIPS, MOUTH, BEARD, HAIR, EARS, NECK, CLOTH, FRAME, LENS, HAT, THING,
) = range(len(CLASSES))  # fmt: skip
BODY = (SKIN, BROWS, EYES, LIPS, MOUTH, BEARD, EARS, NECK)
WEIGHTS = ASSETS / "detectors" / "segmenter.safetensors"
UNSURE = 255  # label of a pixel that nobody knows the class of
SIDE = 256  # pixels of the crop
MARGIN = 2.1  # side of the crop over the face's size, see `frames.FaceFrame`
UP = 0.1  # face sizes by which the crop lies higher than the face: tall hair was cut off without


def crop_matrix(points: np.ndarray) -> np.ndarray:
    """The [2, 3] affine map from photo pixels to pixels of the portrait crop.

    Args:
        points: [478, 2+] pixels.
    """
    matrix = frames.crop_matrix(frames.frame_of_points(points), SIDE, MARGIN)
    matrix[1, 2] += UP * SIDE / MARGIN
    return matrix
