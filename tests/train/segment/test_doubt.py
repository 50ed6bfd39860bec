"""Labels that nobody believes: what readers found, and what is wrong in many photos."""

import numpy as np
import pytest

from bakery.detectors import portrait
from bakery.landmarks import BROWS, EYE_CORNERS, OVAL
from bakery.train.segment import doubt

UNIT = 40.0  # pixels, the eye distance


@pytest.fixture
def points():
    """Eyes at row 80, brows at 70, nose at 100, chin at 130, ears at the sides."""
    out = np.full((478, 2), (100.0, 90.0))
    angle = np.linspace(0, 2 * np.pi, len(OVAL), endpoint=False)
    out[OVAL] = np.stack([100 + 35 * np.sin(angle), 90 - 45 * np.cos(angle)], 1)
    out[EYE_CORNERS, 1], out[BROWS, 1] = 80.0, 70.0
    out[33], out[263] = (80.0, 80.0), (120.0, 80.0)
    out[2], out[152] = (100.0, 100.0), (100.0, 130.0)
    out[234], out[454] = (65.0, 90.0), (135.0, 90.0)
    return out


@pytest.mark.parametrize(
    "fault, label, inside, outside",
    [
        ("collar", portrait.HAIR, (140, 60), (60, 60)),
        ("locks", portrait.CLOTH, (140, 60), (140, 100)),
        ("bald", portrait.HAIR, (40, 100), (140, 60)),
        ("top", portrait.SKIN, (60, 100), (90, 100)),
        ("ears", portrait.EARS, (90, 62), (140, 62)),
        ("eyewear", portrait.LENS, (80, 85), (120, 85)),
        ("brow", portrait.BROWS, (70, 85), (110, 85)),
        ("beard", portrait.SKIN, (120, 100), (80, 100)),
        ("neck", portrait.CLOTH, (150, 100), (120, 60)),
        ("outline", portrait.CLOTH, (150, 100), (90, 100)),
        ("lips", portrait.LIPS, (110, 100), None),
    ],
)
def test_a_fault_is_doubted_where_it_may_be(points, fault, label, inside, outside):
    labels = np.full((200, 200), label, np.uint8)
    where = doubt.where(fault, labels, points)
    assert where.shape == labels.shape and where.dtype == bool
    assert where[inside] and (outside is None or not where[outside])
    if fault not in ("brow", "outline"):
        assert not doubt.where(fault, np.full_like(labels, portrait.BACKGROUND), points).any()


def test_the_list_holds_known_faults(points):
    listed = {fault for faults in doubt.read().values() for fault in faults}
    assert listed <= doubt.FAULTS.keys()
    with pytest.raises(KeyError):
        doubt.where("nose", np.zeros((10, 10), np.uint8), points)


def test_little_hair_below_the_nose_is_a_collar_and_much_is_long(points):
    labels = np.full((200, 200), portrait.BACKGROUND, np.uint8)
    image = np.full((200, 200, 3), 100, np.uint8)
    labels[120:130, 60:70] = portrait.HAIR
    assert doubt.collars(image, labels, points)[125, 65]
    labels[100:160, 50:70] = portrait.HAIR
    assert not doubt.collars(image, labels, points).any()


def test_clothes_in_the_colour_of_the_face_beside_the_chin_may_be_neck(points):
    labels = np.full((200, 200), portrait.CLOTH, np.uint8)
    labels[80:120, 80:120] = portrait.SKIN
    image = np.full((200, 200, 3), 240, np.uint8)
    image[80:120, 80:120] = image[125:140, 90:110] = (200, 150, 130)
    found = doubt.collars(image, labels, points)
    assert found[130, 100] and not found[130, 60] and not found[180, 100]


def test_what_is_dark_beside_white_shirts_is_hair(points):
    labels = np.full((200, 200), portrait.CLOTH, np.uint8)
    image = np.full((200, 200, 3), 230, np.uint8)
    image[130:150, 60:70] = 40
    found = doubt.tails(image, labels, points)
    assert found[140, 65] and not found[140, 100]
