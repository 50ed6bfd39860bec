"""The sheet of key expressions: what stands where."""

import cv2
import numpy as np
import pytest
from numpy.testing import assert_allclose

from bakery.evaluate.generator import sheet as generator_sheet
from bakery.show import synthesis
from bakery.types import Generated

CELL = generator_sheet.CELL


class Unchanged:
    """A generator that changes nothing."""

    def generate(self, subject, conditions, interior_only=False):
        image = conditions.deformed_neutral
        return Generated(
            image, np.ones_like(image), np.zeros_like(image), np.zeros(image.shape[:2])
        )


@pytest.mark.parametrize("yaw", [0.0, 30.0])
def test_photo_and_keys_stand_side_by_side(fitted, monkeypatch, yaw):
    monkeypatch.setattr(synthesis, "fit_subject", lambda *_: fitted)
    row = generator_sheet.rows_of("anyone.jpg", "makehuman", Unchanged(), yaw)
    assert row.shape == (2 * CELL, 7 * CELL, 3) and row.dtype == np.uint8
    photo = cv2.resize(fitted.neutral.picture, (CELL, CELL), interpolation=cv2.INTER_AREA) * 255
    assert_allclose(row[:CELL, :CELL], photo, atol=1)
    # The mouths of smile and surprise, which opens it, differ; so do the faces.
    smile, surprise = row[CELL:, CELL : 2 * CELL], row[CELL:, 2 * CELL : 3 * CELL]
    assert np.abs(smile.astype(int) - surprise)[CELL // 2 :].mean() > 5


def test_a_strip_is_centred_and_enlarged():
    picture = np.zeros((100, 100, 3), np.uint8)
    picture[38:42, 58:62] = 255  # around (60, 40)
    strip = generator_sheet._strip(picture, np.array([[50.0, 38.0], [70.0, 42.0]]))
    assert strip.shape == (CELL // 2, CELL, 3)
    y, x = np.nonzero(strip[..., 0] > 127)
    assert_allclose([x.mean() + 0.5, y.mean() + 0.5], [CELL / 2, CELL / 4], atol=0.6)
    assert_allclose(np.ptp(x) + 1, 4 * CELL / (1.25 * 20), atol=2)  # 4 pixels, enlarged


def test_several_people(monkeypatch):
    monkeypatch.setattr(
        generator_sheet, "rows_of", lambda photo, *_: np.full((4, 6, 3), photo, np.uint8)
    )
    assert generator_sheet.sheet([1], "makehuman", "rendered").shape == (4, 6, 3)
    found = generator_sheet.sheet([1, 2, 3], "makehuman", "rendered")
    assert found.shape == (8, 12, 3)
    assert found[0, 0, 0] == 1 and found[0, 11, 0] == 2 and found[7, 0, 0] == 3
