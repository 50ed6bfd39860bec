"""The plug-in point for detectors; entry point group `bakery.detectors`."""

from typing import Protocol

import numpy as np

from bakery.types import Landmarks


class Detector(Protocol):
    """Finds faces and their 478 points. One instance serves any number of photos."""

    name: str
    sha256: str  # over the weights that its answers depend on; "" without any

    def detect(self, image: np.ndarray) -> list[Landmarks]:
        """All faces of a photo [H, W, 3] uint8, sRGB, upright; positions in its pixels."""
