"""photo -> Landmarks: every face of a picture, the largest first."""

from functools import cache

import numpy as np

from bakery import landmarks as marks
from bakery.detectors import network
from bakery.detectors.base import Detector
from bakery.detectors.network import NetworkDetector
from bakery.geometry.color import to_bytes
from bakery.types import Landmarks

SMALLEST_FACE = 96  # pixels, longer side of the box; smaller ones have too little to bake
# Share of a face's landmarks beyond the picture's edge: of a portrait that is cut through an eye it
# is 0.32, through the far cheek or the chin 0.2.
MOST_OUTSIDE = 0.25


def detect_faces(encoded_image: np.ndarray, detector: Detector | None = None) -> list[Landmarks]:
    """Find all faces of a photo.

    Args:
        encoded_image: [H, W, 3] sRGB-encoded, float32 0..1 or uint8, upright.
        detector: see `bakery.detectors.base.Detector`; None takes the project's own network.

    Returns:
        list of Landmarks, the largest face first

    Raises:
        ValueError: the picture is not [H, W, 3] of one of these types.
    """
    image = np.asarray(encoded_image)
    if image.ndim != 3 or image.shape[2] != 3 or image.dtype not in (np.float32, np.uint8):
        raise ValueError(
            f"encoded_image: {image.dtype} {list(image.shape)}, needs float32 or uint8 [H, W, 3]"
        )
    if image.dtype == np.float32:
        image = to_bytes(image)
    faces = (detector or _own_network()).detect(image)
    return sorted(faces, key=lambda face: -float(face.box[2] * face.box[3]))


def face_size(landmarks: Landmarks) -> float:
    """Longer side of a face's box, pixels; see `SMALLEST_FACE`."""
    return float(landmarks.box[2:].max())


def share_outside(landmarks: Landmarks, shape: tuple[int, ...]) -> float:
    """Share of a face's landmarks that lie outside of a picture of shape [H, W, ...]."""
    points = landmarks.points[: marks.FACE]
    return float(((points < 0) | (points > shape[1::-1])).any(1).mean())


@cache
def _own_network() -> NetworkDetector:
    return network.load()
