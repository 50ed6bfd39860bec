"""Photos with known landmarks."""

import numpy as np
import pytest

from bakery.errors import InputError
from bakery.formats.portraits import reference_points

NAMES = np.array(["a/1_neutral.jpg", "a/1_smiling.jpg", "b/2_neutral.jpg", "c/3.jpg"])


@pytest.fixture
def portraits(tmp_path):
    points = np.arange(4 * 478 * 3, dtype=np.float32).reshape(4, 478, 3)
    np.savez(tmp_path / "dense478.npz", names=NAMES, points=points)
    return tmp_path


def test_points_by_path(portraits):
    found = reference_points(portraits, ("a/", "c/"))
    assert [path.relative_to(portraits).as_posix() for path in found] == list(NAMES[[0, 1, 3]])
    last = found[portraits / "c" / "3.jpg"]
    assert last.shape == (478, 2)
    np.testing.assert_array_equal(last[0], [3 * 478 * 3, 3 * 478 * 3 + 1])
    assert list(reference_points(portraits, "a", part="neutral")) == [portraits / NAMES[0]]


def test_a_folder_without_points(tmp_path):
    with pytest.raises(InputError, match="no dense478.npz"):
        reference_points(tmp_path, "a")
    (tmp_path / "dense478.npz").write_bytes(b"PK no archive")
    with pytest.raises(InputError, match="needs arrays"):
        reference_points(tmp_path, "a")
    np.savez(tmp_path / "dense478.npz", names=NAMES, points=np.zeros((3, 478, 2)))
    with pytest.raises(InputError, match=r"\[3, 478, 2\], needs \[4, 478"):
        reference_points(tmp_path, "a")


def test_a_folder_without_such_photos(portraits):
    with pytest.raises(InputError, match="names no neutral photo of c"):
        reference_points(portraits, "c", part="neutral")
