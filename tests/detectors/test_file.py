"""Landmarks read back from a file."""

import json

import numpy as np
import pytest

from bakery.detectors.file import FileDetector
from bakery.errors import InputError


def write(path, width=40, height=30):
    face = {"box": [1, 2, 30, 20], "score": 0.9, "points": [[3, 4]] * 478, "confidence": [1] * 478}
    path.write_text(json.dumps({"image": {"width": width, "height": height}, "faces": [face]}))
    return path


def test_gives_what_the_file_holds(tmp_path):
    detector = FileDetector(write(tmp_path / "a.json"))
    (face,) = detector.detect(np.zeros((30, 40, 3), np.uint8))
    assert face.points.tolist() == [[3, 4]] * 478


def test_refuses_a_photo_of_another_size(tmp_path):
    detector = FileDetector(write(tmp_path / "a.json"))
    with pytest.raises(InputError, match="40x30"):
        detector.detect(np.zeros((40, 30, 3), np.uint8))


def test_refuses_a_missing_file(tmp_path):
    with pytest.raises(InputError, match="no such file"):
        FileDetector(tmp_path / "none.json")


@pytest.mark.parametrize("x, refused", [(-39.0, False), (-41.0, True), (81.0, True), (1e300, True)])
def test_refuses_points_far_outside_the_photo(tmp_path, x, refused):
    """Faces may be cut off by the photo's edge, but not by more than the photo is long."""
    path = write(tmp_path / "a.json")
    table = json.loads(path.read_text())
    table["faces"][0]["points"][7] = [x, 4]
    path.write_text(json.dumps(table))
    detector, image = FileDetector(path), np.zeros((30, 40, 3), np.uint8)
    if not refused:
        return detector.detect(image)
    with pytest.raises(
        InputError, match="point 7 of face 1 lies at .*, far outside the photo of 40x30"
    ):
        detector.detect(image)
