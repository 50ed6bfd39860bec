"""Lights and darks of locks: noise with a known direction, and the contrast of a painted photo."""

from types import SimpleNamespace

import numpy as np
import pytest

from bakery.heads.file import load_head
from bakery.stages.hair import chart
from bakery.stages.hair.chart import COLUMNS, DOME, ROWS
from bakery.stages.hair.locks import BAND, FEWEST, FINER, RANGE, USUAL, lock_contrast, make_locks

SIDE, SCALE = 240, 1.5


@pytest.fixture(scope="module")
def ball():
    """A shell 100 mm from the axis all around."""
    head = load_head()
    place = chart.make_chart(head, head.mean)
    return SimpleNamespace(chart=place, surface=lambda cells, out: place.place(cells, 100.0))


def along(shell, x, y):
    """Unit vectors [ROWS, COLUMNS, 3] that run so far around, and so far down."""
    cells = chart.grid()
    flow = shell.surface(cells + [0.2 * x, 0.2 * y], 1) - shell.surface(
        cells - [0.2 * x, 0.2 * y], 1
    )
    return flow / np.linalg.norm(flow, axis=-1, keepdims=True)


@pytest.mark.parametrize("way", [(0, 1), (1, 0)], ids=["down", "around"])
def test_noise_hardly_changes_along_the_flow(ball, way):
    noise = make_locks(ball, along(ball, *way), 100.0)
    assert noise.shape == (FINER * ROWS, FINER * COLUMNS) and noise.dtype == np.float32
    assert noise.mean() == pytest.approx(0, abs=1e-4) and noise.std() == pytest.approx(1, abs=1e-4)
    tube = noise[FINER * (DOME + 15) : FINER * (DOME + 45)]  # its ends lack neighbours
    down, around = 2 * FINER, round(10 / (2 * np.pi * 100 / COLUMNS) * FINER)  # texels of 10 mm
    changes = np.diff(tube[::down], axis=0).std(), np.diff(tube[:, ::around], axis=1).std()
    ahead, across = changes if way == (0, 1) else changes[::-1]
    assert ahead < 0.4 * across


def test_locks_of_longer_hair_are_longer(ball):
    flow = along(ball, 0, 1)
    rough = [np.diff(make_locks(ball, flow, mm), axis=0).std() for mm in (20.0, 50.0, 130.0)]
    assert rough[0] > 1.2 * rough[1] > 1.44 * rough[2]


def test_noise_closes_behind_the_head_and_is_found_by_cell(ball):
    noise = make_locks(ball, along(ball, 0, 1), 100.0)
    step = np.abs(np.diff(noise, axis=1)).mean()
    assert np.abs(noise[:, 0] - noise[:, -1]).mean() < 2 * step
    row, column = 100, 57
    there = np.array([[(column + 0.5) / FINER, (row + 0.5) / FINER]])
    assert ball.chart.take(noise, FINER * there)[0] == pytest.approx(noise[row, column], abs=1e-5)
    seam = ball.chart.take(noise, FINER * np.array([[0.0, 20.0], [COLUMNS, 20.0]]))
    assert seam[0] == pytest.approx(seam[1], abs=1e-5)


def seen(gray, cosine=1.0, shown=1.0):
    """The contrast of locks in a photo of log brightness [SIDE, SIDE], all of it hair."""
    portrait = SimpleNamespace(
        color=np.exp(gray)[..., None].repeat(3, 2).astype(np.float32), scale=SCALE,
        hair=np.ones((SIDE, SIDE), np.float32), pixels=lambda p: (SCALE * p[..., :2], p[..., 2]),
        inside=lambda pixels: ((pixels > 20) & (pixels < SIDE - 20)).all(-1),
    )  # fmt: skip
    shell = SimpleNamespace(
        seen=np.full((ROWS, COLUMNS), shown), sides=lambda: np.full((2, ROWS, COLUMNS), 1.7),
        surface=lambda cells, out: np.concatenate([1.7 * cells, 0 * cells[..., :1]], -1),
    )  # fmt: skip
    return lock_contrast(portrait, shell, np.full((ROWS, COLUMNS), cosine))


def test_contrast_is_that_of_painted_locks():
    mm = np.arange(SIDE) / SCALE

    def waves(length, height=0.3):
        return -2 + height * np.sin(2 * np.pi * mm / length)[None].repeat(SIDE, 0)

    turn = 2 * np.pi / 13.0
    left = np.exp(-0.5 * (turn * BAND[0]) ** 2) - np.exp(-0.5 * (turn * BAND[1]) ** 2)
    assert seen(waves(13.0)) == pytest.approx(0.3 * 0.5**0.5 * left, rel=0.08)  # cells are coarse
    assert seen(waves(2.0)) == RANGE[0], "wisps"
    assert seen(waves(300.0)) == RANGE[0], "light and shadow"
    assert seen(waves(13.0, 3.0)) == RANGE[1], "no more than that"


@pytest.mark.parametrize("lack", [{"cosine": 0.3}, {"shown": 0.0}])
def test_what_the_photo_does_not_show_squarely_has_the_usual_contrast(lack):
    assert FEWEST > 0 and RANGE[0] < USUAL < RANGE[1]
    loud = -2 + np.random.default_rng(0).normal(size=(SIDE, SIDE))
    assert seen(loud, **lack) == USUAL
