"""What the reference renderer shows of a head."""

import cv2
import numpy as np
import pytest

from bakery.geometry import camera as cameras
from bakery.geometry import rotation
from bakery.geometry.raster import rasterize
from bakery.heads.file import load_head
from bakery.runtime.render import SHOWN
from bakery.types import Camera


def holes(yaw, parts):
    """Pixels of background that the head, turned by `yaw` degrees, encloses about its eyes."""
    head = load_head()
    turn = rotation.vector(rotation.matrix(np.array([0, np.radians(yaw), 0])))
    camera = Camera(6000.0, np.array([500.0, 400.0]), turn, np.array([0, 0, -1100.0]), 1000, 800)
    points = cameras.to_camera(head.mean, camera)
    found = rasterize(
        cameras.project_camera(points, camera), -points[:, 2],
        head.faces[head.part_faces(*parts)], (800, 1000), cull=True,
    )  # fmt: skip
    _, number = cv2.connectedComponents((found.face < 0).astype(np.uint8), connectivity=4)
    outside = np.unique(np.concatenate([number[[0, -1]].ravel(), number[:, [0, -1]].ravel()]))
    return int((~np.isin(number, outside)).sum())


@pytest.mark.parametrize("yaw", [-60, -40, -25, 25, 40, 60])
def test_no_hole_shows_between_a_lid_and_its_eye(yaw):
    assert holes(yaw, SHOWN) == 0


def test_the_eye_socket_is_what_closes_it():
    assert holes(40, [part for part in SHOWN if part != "eye_socket"]) > 50
