"""Any detector as one that follows faces: it finds them anew in each frame, the nearest is taken."""

from collections.abc import Sequence

import numpy as np

from bakery.detectors.base import Detector, PlacingDetector
from bakery.detectors.frames import POINTS, FaceFrame, frame_of_points
from bakery.types import Landmarks

ACROSS = np.linspace(
    -0.5, 0.5, POINTS
)  # no face, but where one was looked for, as FaceFrame has it


def placing(detector: Detector) -> PlacingDetector:
    """The detector itself, if it can follow faces, or `NearestFace` of it."""
    return detector if isinstance(detector, PlacingDetector) else NearestFace(detector)


class NearestFace:
    """See `bakery.detectors.base.PlacingDetector`."""

    def __init__(self, detector: Detector) -> None:
        self.detector, self.name, self.sha256 = detector, detector.name, detector.sha256

    def detect(self, image: np.ndarray) -> list[Landmarks]:
        """All faces of a photo."""
        return self.detector.detect(image)

    def place(
        self, image: np.ndarray, found: Sequence[FaceFrame]
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The face nearest to each place, if its middle lies in the square; presence is its score.

        Where there is none, the points lie in a line across the square, with presence 0.
        """
        faces = [(frame_of_points(face.points), face) for face in self.detector.detect(image)]
        points = np.empty((len(found), POINTS, 2))
        presence = np.zeros(len(found))
        for row, wanted in enumerate(found):
            far = [float(np.abs(frame.center - wanted.center).max()) for frame, _ in faces]
            if far and min(far) <= wanted.size / 2:
                face = faces[int(np.argmin(far))][1]
                points[row], presence[row] = face.points, face.score
            else:
                across = np.array([np.cos(wanted.roll), np.sin(wanted.roll)])
                points[row] = wanted.center + wanted.size * ACROSS[:, None] * across
        return points, np.zeros((len(found), POINTS)), presence

    def closer(
        self, image: np.ndarray, points: np.ndarray, errors: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """What is given: `detect` has looked as closely as it can."""
        return points, errors
