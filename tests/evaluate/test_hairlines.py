"""Ears, foreheads and hair by points that people placed: known labels give known shares."""

import json

import cv2
import numpy as np
import pytest

from bakery import landmarks as marks
from bakery.detectors import portrait
from bakery.errors import InputError
from bakery.evaluate import hairlines

SIDE = 200


@pytest.fixture()
def portraits(tmp_path):
    """A folder of one grey "photo" whose template makes two square ears, a forehead and a scalp."""
    (tmp_path / "london/val").mkdir(parents=True)
    grey = np.full((SIDE, SIDE, 3), 128, np.uint8)
    cv2.imwrite(str(tmp_path / "london/val/001_neutral.png"), grey)
    drawn = np.zeros((189, 2))
    around = np.linspace(0, 2 * np.pi, 10, endpoint=False)
    for ear, x in zip(hairlines.EARS, (30, 170)):
        drawn[list(ear)] = np.stack([x + 15 * np.cos(around), 110 + 15 * np.sin(around)], 1)
    across = np.linspace(60, 140, 7)
    drawn[list(hairlines.TEMPLES)] = np.stack([across, np.full(7, 60)], 1)
    drawn[list(hairlines.CROWN)] = np.stack([across, np.full(7, 20)], 1)
    images = {"london/val/001_neutral.png": ["frl189", drawn.ravel().tolist()]}
    (tmp_path / "landmarks.json").write_text(json.dumps({"images": images}))
    points = np.full((1, 478, 2), 100.0)
    points[0, 33], points[0, 263] = (70, 95), (130, 95)  # outer corners of the eyes
    brows = [*marks.BROW_RIGHT, *marks.BROW_LEFT]
    points[0, brows] = np.stack([np.linspace(60, 140, len(brows)), np.full(len(brows), 85)], 1)
    np.savez(tmp_path / "dense478.npz", names=["london/val/001_neutral.png"], points=points)
    return tmp_path


def test_shares_of_what_was_drawn_around(portraits):
    def classes(image, points):
        out = np.full(image.shape[:2], portrait.BACKGROUND)
        out[:60] = portrait.HAIR
        out[60:, 60:] = portrait.SKIN  # one ear is bare, the other is not
        return out

    (row,) = hairlines.placed(portraits, classes)
    assert row.pop("ears") == pytest.approx(0.5, abs=0.01)  # pixels of two rings
    assert row == {"photo": "001_neutral", "forehead": 1.0, "hair": 1.0}
    row["ears"] = 0.5
    found = hairlines.summary([row, row | {"hair": 0.0}])
    assert found["people"] == 2 and found["hair"] == 0.5 and found["hair_worst"] == 0


def test_a_folder_without_placed_points(tmp_path):
    with pytest.raises(InputError, match="landmarks.json: not found"):
        next(hairlines.placed(tmp_path, None))
