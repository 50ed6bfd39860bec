"""Drawing a scan, and finding its surface again under the pixels."""

import numpy as np
import pytest

from bakery.errors import InputError
from bakery.evaluate import scan as scans
from bakery.formats.image import write_image
from bakery.geometry import camera as cameras


def written(folder, text):
    (folder / "LeePerrySmith.obj").write_text(text)
    write_image(folder / "Map-COL.jpg", np.full((96, 96, 3), 0.5, np.float32))
    return folder


SQUARE = "v -1 -1 0\nv 1 -1 0\nv 1 1 0.5\nv -1 1 0.5\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"


def test_quads_are_cut_in_two(tmp_path):
    scan = scans.read_scan(written(tmp_path, SQUARE + "f 1/1 2/2 3/3 4/4\n"))
    np.testing.assert_array_equal(scan.faces, [[0, 1, 2], [0, 2, 3]])
    np.testing.assert_allclose(scan.uv[0], [0, 1])  # origin top left


@pytest.mark.parametrize("yaw", [-20.0, 0.0, 20.0])
def test_points_under_pixels_project_to_them(tmp_path, yaw):
    scan = scans.read_scan(written(tmp_path, SQUARE + "f 1/1 2/2 3/3 4/4\n"))
    photo, camera, seen = scans.draw(scan, yaw)
    assert photo.encoded.shape == (scans.HEIGHT, scans.WIDTH, 3)
    row, column = (part[::997] for part in np.nonzero(seen.face >= 0))
    points, there = scans.surface_points(scan, seen, np.stack([column, row], 1))
    assert there.all() and len(points) > 50
    # The middle of a pixel was cast, so half a pixel on each axis.
    expected = np.stack([column, row], 1) + 0.5
    np.testing.assert_allclose(cameras.project(points, camera), expected, atol=1e-3)


@pytest.mark.parametrize(
    ("text", "message"),
    [(SQUARE, "holds no face"), (SQUARE + "f 1 2 3\n", "not a textured OBJ"), ("v a b c\n", "not")],
)
def test_what_is_no_scan_says_so(tmp_path, text, message):
    with pytest.raises(InputError, match=message):
        scans.read_scan(written(tmp_path, text))


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(InputError, match="LeePerrySmith.obj: no such file"):
        scans.read_scan(tmp_path)


@pytest.mark.slow
def test_the_real_scan_is_met(shared, head):
    """The requirement of the quality table: 1.8 mm."""
    scan = scans.read_scan(shared / "scans" / "lee_perry_smith")
    found = list(scans.measure(scan, head))
    assert np.mean([row["median_mm"] for row in found]) < 1.8
