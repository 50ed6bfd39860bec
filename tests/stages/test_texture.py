"""What the texture is made of lies where its camera says."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from bakery.geometry import camera as cameras
from bakery.geometry.color import to_encoded
from bakery.geometry.sample import bilinear
from bakery.stages.texture.hair import Mattes
from bakery.stages.texture.neutral import _cut_out
from bakery.types import Camera, Fit, Photo

REST = np.zeros(52, np.float32)


@pytest.mark.parametrize("resolution", [512, 701, 1024])
def test_the_head_cut_out_of_a_photo(head, resolution):
    """Each colour of a ramp says its own place in the photo."""
    down, across = (np.mgrid[:1201, :1203] + 0.5) / 1204
    photo = Photo(to_encoded(np.stack([across, down, across], -1)).astype(np.float32), "")
    away = np.array([0.0, 0.0, -700.0])
    camera = Camera(3100.0, np.array([611.0, 583.0]), np.zeros(3), away, 1203, 1201)
    marks = cameras.project(head.landmarks(head.mean), camera)
    fit = Fit(
        head.name, camera, np.zeros(1), REST, np.zeros(2), np.zeros((9, 3)), np.zeros(0),
        np.zeros((468, 3)), marks,
    )  # fmt: skip
    bare = np.ones((1201, 1203), np.float32)
    image, mattes, points, local = _cut_out(
        photo, Mattes(*[bare] * 7), marks, fit, head, head.mean, resolution
    )
    assert image.shape[:2] == mattes.skin.shape == (local.camera.height, local.camera.width)
    assert local.camera.focal <= camera.focal
    here = cameras.project(head.landmarks(head.mean), local.camera)
    assert_allclose(here, points, atol=1e-6)
    # OpenCV's averages are off by 0.1 pixels; sides of whole pixels were by 0.9 to 1.8.
    assert_allclose(bilinear(image, here)[:, :2] * 1204, marks, atol=0.2)
