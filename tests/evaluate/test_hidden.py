"""What is said of hidden points: known answers, and painted people with hands before their faces."""

import numpy as np
import pytest

from bakery.detectors import network
from bakery.evaluate.detection import hidden
from bakery.synth import portrait_shards
from bakery.synth.portraits import PortraitOptions


@pytest.mark.parametrize(
    "low, high, answer",
    [([0.1, 0.2], [0.3, 0.4], 1), ([0.3], [0.1], 0), ([0.5], [0.5], 0.5), ([1, 3], [2], 0.5)],
)
def test_area_under_the_curve(low, high, answer):
    assert hidden.auc(np.array(low), np.array(high)) == answer


def test_hidden_points_are_less_sure(tmp_path, monkeypatch):
    """Measured over 96 pictures: 0.91; this one: see the bound."""
    monkeypatch.setattr(portrait_shards, "PEOPLE", 1)
    options = PortraitOptions(
        1, 0.5, 0.03, 0.1, 0.1, hands=1.0, hats=0.0, glasses=0.0, things=0.0, hard=0.0
    )
    list(portrait_shards.write("makehuman", tmp_path, 1, seed=1000, options=options))
    found = hidden.measure(tmp_path, network.load())
    assert found["pictures"] == 1 and found["undetected"] == 0
    assert 0.005 < found["hidden"] < 0.5
    assert found["auc"] > 0.7 and found["confidence_hidden"] < found["confidence_seen"]
