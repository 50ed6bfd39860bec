"""Figures of what is timed, and that all of it is."""

from pathlib import Path

import numpy as np
import pytest

from bakery.evaluate import warm
from bakery.heads.file import load_head
from bakery.plugins import plug_in

SAMPLE = Path(__file__).resolve().parents[2] / "samples" / "anna.jpg"


def test_figures_are_medians_of_what_lies_between():
    marks = [(1.0, 0.0), (1.010, 0.002), (1.040, 0.003), (1.060, 0.007)]
    assert warm.figures(marks) == {"wall_ms": 20.0, "least_ms": 10.0, "processor_ms": 2.0}


def test_the_first_run_is_not_counted(monkeypatch):
    now = [0.0]
    monkeypatch.setattr(warm, "clock", lambda: (now[0], now[0]))
    seconds = iter([9.0, 0.25, 0.75, 0.5])

    def work():
        now[0] += next(seconds)

    assert warm.repeated(work, 3) == {"wall_ms": 500.0, "least_ms": 250.0, "processor_ms": 500.0}


def test_a_clip_sways_and_no_frame_is_like_another():
    picture = np.full((40, 30, 3), 128, np.uint8)
    picture[18:22, 13:17] = 255
    frames = list(warm.moving(picture, 8))
    assert len({frame.tobytes() for frame in frames}) == 8
    assert all(frame.shape == picture.shape for frame in frames)


@pytest.mark.parametrize("side", [64, 640])
def test_sizes_are_what_is_asked_for(side):
    picture = np.zeros((320, 200, 3), np.float32)
    assert warm.sized(picture, side).shape == (side, side * 200 // 320, 3)


def test_everything_is_measured():
    found = warm.measure(SAMPLE, load_head("makehuman"), plug_in("detectors", "network"), 1, 4)
    assert list(found) == ["detect", "segment", "track points", "track fit", "person", "track"]
    assert all(0 < row["least_ms"] <= row["wall_ms"] for row in found.values())
    parts = found["track points"]["wall_ms"] + found["track fit"]["wall_ms"]
    assert found["track"]["wall_ms"] == pytest.approx(parts, abs=0.01)
