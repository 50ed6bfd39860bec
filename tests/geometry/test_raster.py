"""The rasteriser: known pictures, and the fast version against the clear one."""

import numpy as np
import pytest

from bakery.geometry.raster import rasterize, rasterize_reference
from bakery.geometry.sample import bilinear, interpolate, interpolate_reference


def random_scene(seed):
    rng = np.random.default_rng(seed)
    pixels = rng.uniform(-10, 74, (300, 2))
    depth = rng.uniform(-20, 200, 300)
    return pixels, depth, rng.integers(0, 300, (200, 3)).astype(np.int32)


@pytest.mark.parametrize("cull", [False, True])
@pytest.mark.parametrize("seed", range(4))
def test_fast_equals_reference(seed, cull):
    scene = random_scene(seed)
    fast = rasterize(*scene, (64, 60), cull)
    clear = rasterize_reference(*scene, (64, 60), cull)
    np.testing.assert_array_equal(fast.face, clear.face)
    np.testing.assert_allclose(fast.barycentric, clear.barycentric, atol=1e-6)
    np.testing.assert_allclose(fast.depth, clear.depth, rtol=1e-6)


def test_two_triangles_share_a_diagonal_without_gap():
    pixels = np.array([[0.0, 0], [8, 0], [8, 8], [0, 8]])
    found = rasterize(pixels, None, np.array([[0, 1, 2], [0, 2, 3]]), (8, 8))
    assert (found.face >= 0).all()
    assert found.face[0, 7] == 0 and found.face[7, 0] == 1


def test_interpolation_is_perspective_correct():
    """Halfway along the picture of a receding edge lies nearer than half of the edge.

    Depths 1 and 3: at the pixel midway 1/depth is the mean of 1 and 1/3, so depth is 1.5 and the
    share of the far end is a quarter.
    """
    pixels = np.array([[0.0, -50.0], [0.0, 150.0], [100.0, 50.0]])
    depth = np.array([1.0, 1.0, 3.0])
    found = rasterize(pixels, depth, np.array([[0, 1, 2]]), (100, 100))
    # The pixel centre at 50.5, not 50: its share is (0.505/3) / (0.505/3 + 0.495) = 0.2538.
    assert found.barycentric[50, 50, 2] == pytest.approx(0.2538, abs=1e-4)


def test_backs_are_culled():
    pixels = np.array([[0.0, 0], [8, 0], [0, 8]])  # clockwise on a screen whose y runs up
    assert (rasterize(pixels, None, np.array([[0, 1, 2]]), (8, 8), cull=True).face < 0).all()
    assert (rasterize(pixels, None, np.array([[0, 2, 1]]), (8, 8), cull=True).face == 0).any()


def test_interpolate_repeats_a_linear_function():
    pixels = np.array([[-1.0, -1], [40, -1], [-1, 40]])
    found = rasterize(pixels, None, np.array([[0, 1, 2]]), (16, 16))
    picture = interpolate(found, pixels[np.array([[0, 1, 2]])])
    y, x = np.mgrid[:16, :16] + 0.5
    np.testing.assert_allclose(picture, np.stack([x, y], -1), atol=1e-4)


def test_fast_interpolation_equals_reference():
    found = rasterize(*random_scene(7), (64, 60))
    corners = np.random.default_rng(0).random((200, 3, 4)).astype(np.float32)
    fast, clear = interpolate(found, corners), interpolate_reference(found, corners)
    np.testing.assert_allclose(fast, clear, atol=1e-6)  # order of sums in float32


def test_bilinear_reads_pixel_centres_and_long_lists():
    image = np.arange(12, dtype=np.float32).reshape(3, 4)
    assert bilinear(image, np.array([2.5, 1.5])) == 6
    assert bilinear(image, np.array([3.0, 1.5])) == 6.5
    many = np.tile(np.array([[2.5, 1.5]]), (100_000, 1))  # cv2.remap alone fails above 32,767
    np.testing.assert_array_equal(bilinear(image, many), 6)
