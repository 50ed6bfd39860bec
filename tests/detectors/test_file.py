"""Landmarks read back from a file."""

import json

import numpy as np
import pytest

from bakery.detectors.file import FileDetector
from bakery.errors import InputError

POINTS = [[3 + k % 20, 4 + k % 17] for k in range(478)]


def write(path, width=40, height=30):
    face = {"box": [1, 2, 30, 20], "score": 0.9, "points": POINTS, "confidence": [1] * 478}
    path.write_text(json.dumps({"image": {"width": width, "height": height}, "faces": [face]}))
    return path


def test_gives_what_the_file_holds(tmp_path):
    detector = FileDetector(write(tmp_path / "a.json"))
    (face,) = detector.detect(np.zeros((30, 40, 3), np.uint8))
    assert face.points.tolist() == POINTS


def test_refuses_a_photo_of_another_size(tmp_path):
    detector = FileDetector(write(tmp_path / "a.json"))
    with pytest.raises(InputError, match="40x30"):
        detector.detect(np.zeros((40, 30, 3), np.uint8))


def test_refuses_a_missing_file(tmp_path):
    with pytest.raises(InputError, match="no such file"):
        FileDetector(tmp_path / "none.json")
