"""The detect stage: order, types, and real photos where they are at hand."""

import numpy as np
import pytest

from bakery.stages.detect import detect_faces, face_size
from bakery.types import Landmarks


class Stub:
    name = "stub"

    def __init__(self, sizes):
        self.sizes = sizes
        self.seen = None

    def detect(self, image):
        self.seen = image
        return [
            Landmarks(np.array([0, 0, s, s / 2]), 0.9, np.zeros((478, 2)), np.ones(478))
            for s in self.sizes
        ]


def test_largest_face_comes_first():
    faces = detect_faces(np.zeros((8, 8, 3), np.uint8), Stub([10, 30, 20]))
    assert [face_size(face) for face in faces] == [30, 20, 10]


def test_float_pictures_reach_the_detector_as_bytes():
    stub = Stub([])
    detect_faces(np.full((8, 8, 3), 0.5, np.float32), stub)
    assert stub.seen.dtype == np.uint8 and (stub.seen == 128).all()
    detect_faces(np.array([[[-1.0, 2.0, 0.0]]], np.float32), stub)
    assert stub.seen.ravel().tolist() == [0, 255, 0]


@pytest.mark.parametrize(
    "image", [np.zeros((8, 8)), np.zeros((8, 8, 4), np.uint8), np.zeros((8, 8, 3), np.int32)]
)
def test_refuses_other_pictures(image):
    with pytest.raises(ValueError, match=r"needs float32 or uint8 \[H, W, 3\]"):
        detect_faces(image, Stub([]))


@pytest.mark.parametrize("name", ["london/val/003_neutral.jpg", "extra/astronaut.png"])
def test_finds_the_one_face_of_a_photo(shared, name):
    cv2 = pytest.importorskip("cv2")
    portraits = shared / "portraits"
    table = np.load(portraits / "dense478.npz")
    reference = table["points"][table["names"].tolist().index(name)][:, :2]
    image = cv2.imread(str(portraits / name))[..., ::-1]
    (face,) = detect_faces(np.ascontiguousarray(image), None)
    eyes = np.linalg.norm(reference[33] - reference[263])
    error = np.linalg.norm(face.points - reference, axis=1).mean() / eyes
    assert error < 0.08  # no photo above 8%
