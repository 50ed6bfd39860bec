"""Sheets of a head with painted skin."""

import numpy as np

from bakery.heads.base import weights
from bakery.synth import sheets


def test_shapes_differ_where_they_move(head, monkeypatch):
    shown = {"rest": weights({}), "jawOpen": weights({"jawOpen": 1.0})}
    monkeypatch.setattr(sheets, "singles", lambda: shown)
    monkeypatch.setattr(sheets, "SIZE", 96)
    monkeypatch.setattr(sheets, "DETAIL", 1.5)
    monkeypatch.setattr(sheets, "QUALITY", 0.1)
    sheet = sheets.shapes(head, columns=2)
    assert sheet.shape == (96, 192, 3)
    change = np.abs(sheet[:, :96] - sheet[:, 96:]).mean(-1)
    forehead, mouth = change[20:35, 30:66].mean(), change[60:90, 36:60].mean()
    assert mouth > 0.05 > 0.02 > forehead
