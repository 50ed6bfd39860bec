"""Landmarks from a file that `bakery detect` wrote, in place of a network."""

from pathlib import Path

import numpy as np

from bakery.errors import InputError
from bakery.formats.record import read_faces
from bakery.types import Landmarks


class FileDetector:
    """Gives the faces that stand in one file; see `bakery.detectors.base.Detector`."""

    name = "file"
    sha256 = ""

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        self.size, self.faces = read_faces(self.path)

    def detect(self, image: np.ndarray) -> list[Landmarks]:
        """The file's faces, if it belongs to a photo of this size.

        Args:
            image: [H, W, 3] uint8

        Raises:
            InputError: the file was made from a photo of another size.
        """
        have, want = (image.shape[1], image.shape[0]), tuple(self.size)
        if have != want:
            raise InputError(
                f"{self.path}: landmarks of a photo of {want[0]}x{want[1]}, this one has "
                f"{have[0]}x{have[1]}; detect again"
            )
        return list(self.faces)
