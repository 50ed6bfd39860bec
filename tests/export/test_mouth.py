"""The mouth of head.glb: dark behind the lips, teeth darker towards the back, the skin as it is."""

import numpy as np
import pytest

from bakery.export.mouth import mouth_light
from bakery.stages.atlas import make_atlas

SIZE = 512


@pytest.fixture(scope="module")
def lit(head):
    """A function (part) -> points [n, 3] mm and light [n] of its texels."""
    picture, atlas = mouth_light(head, head.mean, SIZE), make_atlas(head, SIZE)

    def part(*names):
        rows = atlas.rows(*names)
        points = atlas.at(head.mean)[rows]
        return points, picture.reshape(-1, 3)[atlas.index[rows]].mean(1)

    return part


def test_nothing_but_the_mouth_changes(lit):
    for name in ("skin", "eye_left", "eye_right", "eye_socket", "lashes"):
        assert (lit(name)[1] == 1).all(), name


@pytest.mark.parametrize("arch", ["upper", "lower"])
def test_teeth_darken_towards_the_back_and_the_corners(lit, arch):
    points, light = lit(f"teeth_{arch}")
    front = (np.abs(points[:, 0]) < 5) & (points[:, 2] > np.quantile(points[:, 2], 0.8))
    back = points[:, 2] < np.quantile(points[:, 2], 0.2)
    assert np.median(light[front]) > 0.5 and light[back].max() < 0.3


def test_the_cavity_goes_on_from_the_lips_into_the_dark(lit):
    points, light = lit("mouth_cavity")
    assert light[points[:, 2] > np.quantile(points[:, 2], 0.98)].mean() > 0.8
    assert light[points[:, 2] < np.quantile(points[:, 2], 0.5)].max() < 0.2


def test_gums_and_tongue_have_their_colours(head):
    picture, atlas = mouth_light(head, head.mean, SIZE).reshape(-1, 3), make_atlas(head, SIZE)
    for part in ("gums_upper", "gums_lower", "tongue"):
        red, green, blue = picture[atlas.index[atlas.rows(part)]].mean(0)
        assert red > 1.2 * green and red > 1.2 * blue, part
