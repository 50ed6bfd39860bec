"""The plug-in point for detectors; entry point group `bakery.detectors`."""

from collections.abc import Sequence
from typing import Protocol, runtime_checkable

import numpy as np

from bakery.detectors.frames import FaceFrame
from bakery.types import Landmarks


class Detector(Protocol):
    """Finds faces and their 478 points. One instance serves any number of photos."""

    name: str
    sha256: str  # over the weights that its answers depend on; "" without any

    def detect(self, image: np.ndarray) -> list[Landmarks]:
        """All faces of a photo [H, W, 3] uint8, sRGB, upright; positions in its pixels."""


@runtime_checkable
class PlacingDetector(Detector, Protocol):
    """A detector that can follow a face from frame to frame without finding it anew.

    Only `bakery track` asks for it; `placing.placing` makes one of any Detector.
    """

    def place(
        self, image: np.ndarray, found: Sequence[FaceFrame]
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The points of the faces that are about where they are said to be.

        Args:
            image: [H, W, 3] uint8, sRGB, upright.
            found: n >= 1 upright squares around faces, pixels.

        Returns:
            points [n, 478, 2] pixels, their expected errors [n, 478] pixels (0: not known), and how
            surely there is a face at all [n] 0..1.
        """

    def closer(
        self, image: np.ndarray, points: np.ndarray, errors: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """A second look at a face whose place is settled; what is given, where there is none.

        Args:
            image: as above.
            points: [478, 2] pixels.
            errors: [478] pixels.

        Returns:
            points [478, 2] and errors [478] pixels
        """
