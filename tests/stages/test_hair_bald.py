"""Hair gets sparse beside bald scalp, and not beside a high hairline; short hair does at a nape."""

from types import SimpleNamespace

import numpy as np
import pytest

from bakery.stages.hair.chart import COLUMNS, DOME, ROWS, STEP
from bakery.stages.hair.mesh import BALD, NARROW, SPARSE, at_nape, beside_bald


def sparse(rows):
    """How sparse hair is in each row [ROWS], by the rows that are bare scalp."""
    there = np.ones((ROWS, COLUMNS))
    there[rows] = 0
    return beside_bald(SimpleNamespace(growth=np.ones_like(there), there=there)).mean(1)


def test_hair_is_sparse_over_so_many_mm_beside_a_bald_top():
    rows = 20
    found = sparse(slice(rows))
    away = (np.arange(ROWS) - rows) * STEP
    assert found[rows] > 0.9, "where it begins"
    assert (found[away > SPARSE + 3 * STEP] < 0.02).all()
    fading = found[(away > 0) & (away < SPARSE)]
    assert (np.diff(fading) < 0).all() and fading[len(fading) // 2] == pytest.approx(0.5, abs=0.2)
    assert 0 < BALD < SPARSE


def test_a_high_hairline_and_skin_around_ears_are_not_bald():
    high = 20 + int(1.8 * NARROW / STEP)
    assert sparse(slice(20, high)).max() == 0 and sparse(slice(20, high + 3)).max() > 0.9
    there = np.ones((ROWS, COLUMNS))
    there[DOME:, 20:80] = 0
    ears = SimpleNamespace(growth=np.ones_like(there), there=there)
    assert beside_bald(ears).max() == 0


def test_short_hair_gets_less_at_the_nape_and_hair_that_hangs_does_not():
    def nape(thick):
        skull = np.full((ROWS, COLUMNS), 80.0)
        return at_nape(
            SimpleNamespace(
                growth=np.ones_like(skull),
                base=skull,
                radius=skull + thick,
                chart=SimpleNamespace(skull=skull),
            )
        )

    short = nape(3.0)
    back, front, row = [0, COLUMNS - 1], COLUMNS // 2, DOME + 14
    assert short[row, back].min() > 0.95
    assert short[row, front - 25 : front + 25].max() < 0.01, "before the ears"
    assert short[: DOME - 4].max() < 0.01, "above them"
    assert nape(30.0).max() < 0.01
