"""Face frames and crops, against hand-made shapes."""

import numpy as np
from numpy.testing import assert_allclose

from bakery.detectors import frames


def square_face(center=(50.0, 40.0), size=20.0, roll=0.0):
    """478 points filling a square, eye corners level when upright."""
    rng = np.random.default_rng(0)
    points = rng.uniform(-0.5, 0.5, (478, 2))
    points[:4] = [[-0.5, -0.5], [0.5, 0.5], [-0.5, 0.5], [0.5, -0.5]]
    points[33], points[263] = (-0.3, -0.1), (0.3, -0.1)
    return points * size @ frames.rotation(roll).T + center


def test_frame_finds_center_size_and_roll():
    frame = frames.frame_of_points(square_face((50, 40), 20, 0.4))
    assert_allclose(frame.center, (50, 40), atol=1e-9)
    assert_allclose(frame.size, 20)
    assert_allclose(frame.roll, 0.4)


def test_crop_is_upright_and_centered():
    points = square_face((50, 40), 20, 0.4)
    matrix = frames.crop_matrix(frames.frame_of_points(points), 100, margin=2.0)
    crop = frames.apply_affine(matrix, points)
    assert_allclose(crop[:4].mean(0), (50, 50), atol=1e-9)
    assert_allclose(crop[263] - crop[33], (0.6 * 50, 0), atol=1e-9)  # 20 px face -> 50 px


def test_inverse_undoes_the_matrix():
    matrix = frames.crop_matrix(frames.FaceFrame(np.array([3.0, 4.0]), 7.0, -0.2), 128)
    points = np.array([[1.0, 2.0], [30.0, -5.0]])
    back = frames.apply_affine(frames.invert_affine(matrix), frames.apply_affine(matrix, points))
    assert_allclose(back, points, atol=1e-9)


def test_identity_crop_is_the_picture_itself():
    image = np.random.default_rng(0).integers(0, 255, (16, 16, 3), np.uint8)
    matrix = np.array([[1.0, 0, 0], [0, 1, 0]])
    assert_allclose(frames.take_crop(image, matrix, 16), image)


def test_crop_doubles_about_pixel_corners():
    """Twice the size, pixel centres at +0.5: a 2x2 block lies on each old pixel."""
    image = np.zeros((8, 8, 3), np.uint8)
    image[2:4, 2:4] = 200
    crop = frames.take_crop(image, np.array([[2.0, 0, 0], [0, 2, 0]]), 16)
    assert crop[5:7, 5:7].min() == 200
    y, x = np.nonzero(crop[1:-1, 1:-1, 0])  # the rim blends with the grey outside
    assert y.mean() + 1 == x.mean() + 1 == 5.5


def test_outside_is_grey():
    image = np.zeros((8, 8, 3), np.uint8)
    crop = frames.take_crop(image, np.array([[1.0, 0, 100], [0, 1, 0]]), 8)
    assert (crop == frames.PADDING).all()
