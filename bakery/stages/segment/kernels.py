"""What is decided for each pixel of a photo, in one pass over it; the tests hold the plain numpy beside it."""

import numba
import numpy as np

from bakery.stages.segment.classes import BACKGROUND, CLOTHES, HAIR, SKIN

# No fast arithmetic: the bits are those of numpy.
_jit = numba.njit(cache=True, nogil=True)


@_jit
def settle(
    model: np.ndarray, part: np.ndarray, planes: np.ndarray, regions: np.ndarray, skin: np.ndarray
) -> None:
    """Regions of skin, hair, clothes and background, and the soft skin mask.

    Args:
        model: [h, w, 4] float32: slopes of the share of skin by the photo's channels, and offset.
        part: [h, w, 3] float32 sRGB-encoded, the photo.
        planes: [h, w, 4] uint8: rim, face, hair and clothes, 255 for 1.
        regions: [h, w] uint8, skin: [h, w] float32; both are filled.
    """
    byte = np.float32(1 / 255)
    for i in range(regions.shape[0]):
        for j in range(regions.shape[1]):
            slopes = (
                model[i, j, 0] * part[i, j, 0]
                + model[i, j, 1] * part[i, j, 1]
                + model[i, j, 2] * part[i, j, 2]
            )
            refined = model[i, j, 3] + slopes
            rim, face = planes[i, j, 0], planes[i, j, 1]
            hair, clothes = planes[i, j, 2], planes[i, j, 3]
            soft = (refined - np.float32(0.55)) / np.float32(0.3)
            soft = min(max(soft, np.float32(0)), np.float32(1))
            skin[i, j] = max(soft, np.float32(face) * byte) * np.float32(rim) * byte
            if refined > np.float32(0.5) or face > 127:
                regions[i, j] = SKIN
            elif max(hair, clothes) < 85:
                regions[i, j] = BACKGROUND
            else:
                regions[i, j] = HAIR if hair > clothes else CLOTHES


@_jit
def name(
    planes: np.ndarray, told: np.ndarray, fits: np.ndarray, regions: np.ndarray, labels: np.ndarray
) -> None:
    """Write labels where their masks lie in a region that they fit; of two the later stays.

    Args:
        planes: [h, w, 4] uint8, a mask each, 255 for 1.
        told: [4] uint8, the label of each.
        fits: [4, regions] bool.
        regions: [h, w] uint8; labels: [h, w] uint8, written into.
    """
    for i in range(labels.shape[0]):
        for j in range(labels.shape[1]):
            a, b, c, d = planes[i, j, 0], planes[i, j, 1], planes[i, j, 2], planes[i, j, 3]
            if a | b | c | d > 127:  # most pixels lie in no mask
                for k in range(4):
                    if planes[i, j, k] > 127 and fits[k, regions[i, j]]:
                        labels[i, j] = told[k]
