"""The page of failures: its table and its sheet."""

import numpy as np
import pytest

from bakery.errors import InputError
from bakery.evaluate import failures
from bakery.evaluate.failures import SIDE, Outcome, sheet, table
from bakery.stages.assess import Finding


def test_table_and_sheet():
    picture = np.full((SIDE, 3 * SIDE, 3), 0.5, np.float32)
    blur = Finding("blur", "the face is blurred", 0.01, 0.03)
    found = [Outcome("soft", "out of focus", [blur], picture), Outcome("fine", "fine", [], picture)]
    assert table(found).splitlines()[2:] == [
        "| soft | out of focus | **blur**: the face is blurred |",
        "| fine | fine | nothing |",
    ]
    assert sheet(found[:1] * 3).shape == (2 * SIDE, 6 * SIDE, 3)


def test_a_case_that_is_none_is_refused_before_anything_is_painted(tmp_path):
    with pytest.raises(InputError, match="moustache: no such case"):
        next(failures.outcomes(None, tmp_path / "runs", None, ["smile", "moustache"]))
    assert not (tmp_path / "runs").exists()
