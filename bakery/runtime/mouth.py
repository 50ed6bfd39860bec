"""The mouth of a frame: per-pixel weighted median of the nearest baked mouths (paGAN section 6)."""

import numpy as np

from bakery.types import Textures

NEAREST = 50
# Share of the nearest mouth's distance by which another one may be farther and still have 1/e of its
# weight. Wider company blurs teeth: on three smiles of london/train the lips scored 17.95 dB with a
# bandwidth that followed the third nearest, 18.08 with this one.
COMPANY = 0.25


def neighbours(
    database: np.ndarray, landmarks: np.ndarray, count: int = NEAREST
) -> tuple[np.ndarray, np.ndarray]:
    """Nearest mouths by correlation of their landmarks, and their weights.

    Args:
        database: [M, n, 2] landmarks of the baked mouths (stages.texture_mouth.mouth_landmarks).
        landmarks: [n, 2] of the frame.

    Returns:
        indices [count], nearest first, and weights [count] with sum 1.
    """
    known = database.reshape(len(database), -1).astype(np.float64)
    wanted = np.asarray(landmarks, np.float64).ravel()
    correlation = known @ wanted / (np.linalg.norm(known, axis=1) * np.linalg.norm(wanted))
    order = np.argsort(-correlation, kind="stable")[:count]
    distance = 1 - correlation[order]
    bandwidth = max(COMPANY * distance[0], 1e-4)
    weight = np.exp((distance[0] - distance) / bandwidth)
    return order, weight / weight.sum()


def weighted_median(pictures: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Per-pixel, per-channel weighted median.

    The median is the smallest value at which the weights of all values up to it reach half.

    Args:
        pictures: [n, h, w, 3].
        weights: [n], sum 1.

    Returns:
        [h, w, 3] float32.
    """
    pictures = np.asarray(pictures, np.float32)
    order = np.argsort(pictures, axis=0, kind="stable")
    running = np.cumsum(np.asarray(weights, np.float32)[order], axis=0)
    # Rounding may leave the last sum a hair under one; half is reached long before.
    first = (running >= 0.5 * running[-1]).argmax(0)
    rank = np.take_along_axis(order, first[None], 0)
    middle: np.ndarray = np.take_along_axis(pictures, rank, 0)[0]
    return middle


def mouth_picture(textures: Textures, landmarks: np.ndarray) -> np.ndarray:
    """The mouth proxy [h, w, 3] float32 linear of a frame with lip landmarks [n, 2]."""
    index, weight = neighbours(textures.mouth_landmarks, landmarks)
    return weighted_median(textures.mouths[index], weight)
