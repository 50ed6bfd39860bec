"""Synthesis of hidden skin: gradients against finite differences, and energies that are known."""

import cv2
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from bakery.geometry.color import LUMA
from bakery.stages.atlas import make_atlas
from bakery.stages.texture import complete
from bakery.stages.texture.correlations import (
    FEATURES,
    KINDS,
    OCTAVES,
    WINDOWS,
    Correlations,
    Filters,
    correlations,
    windows_of,
)
from bakery.stages.texture.synthesize import Objective, halfway, synthesized, wanted_of

SIZE = 256  # texels on a side of atlases here
SIDE = 64  # of pictures without a head


def wanted_everywhere(energy):
    """Correlations with bands of one mean square, lighter as much as darker."""
    gram = np.tile(np.eye(FEATURES, dtype=np.float32) * energy / 2, (WINDOWS**2, 1, 1))
    return Correlations(gram, np.ones(WINDOWS**2, np.float32))


@pytest.fixture()
def rng():
    return np.random.default_rng(0)


@pytest.fixture()
def picture(rng):
    """A log-luma whose middle is hidden, on skin with a hole, and where its texels lie in windows."""
    luma = rng.normal(size=(SIDE, SIDE)).astype(np.float32) * 0.1
    hidden = np.zeros((SIDE, SIDE), np.float32)
    hidden[24:44, 20:40] = 1
    hidden[24:44, 20] = 0.5
    on_skin = np.ones((SIDE, SIDE), np.float32)
    on_skin[30:34, 30:34] = 0
    number = np.flatnonzero(on_skin)
    y, x = np.divmod(number, SIDE)
    inner = (np.minimum(x, y) > 16) & (np.maximum(x, y) < 48)
    place = np.stack([x, y], 1)[inner] * 5 / SIDE  # five windows a side
    return luma, hidden, on_skin, 256, number[inner], place


def test_adjoint(rng):
    """<A x, y> = <x, A'y> for what keeps away from the border."""
    weight = (rng.random((SIDE, SIDE)) > 0.1).astype(np.float32)
    filters = Filters(weight, 512)
    margin = int(np.ceil(Filters.REACH / 2))
    x = rng.normal(size=(SIDE, SIDE)).astype(np.float32)
    y = np.zeros((OCTAVES + 1, SIDE, SIDE), np.float32)
    inner = slice(margin, -margin)
    y[:, inner, inner] = rng.normal(size=y[:, inner, inner].shape)
    there = float((np.stack(filters.levels(x)) * y).sum())
    back = float((x * filters.levels_adjoint(list(y))).sum())
    assert_allclose(there, back, rtol=1e-4)  # of float32 sums


def test_gradient(picture, rng):
    objective = Objective(*picture, wanted_everywhere(0.02))
    assert len(objective.grids) == 2
    change = rng.normal(size=len(objective.free)).astype(np.float32) * 0.02
    _, slope = objective(change)
    for _ in range(5):
        way = rng.normal(size=len(change)).astype(np.float32)
        step = 2e-3
        ahead, behind = objective(change + step * way)[0], objective(change - step * way)[0]
        # Of float32 pictures; a mistake in any term is far above.
        assert_allclose((ahead - behind) / (2 * step), slope @ way, rtol=0.01, atol=1e-3)


def test_what_is_right_stays(picture):
    """A picture that has the wanted energies has no slope but rounding."""
    objective = Objective(*picture, wanted_everywhere(0.02))
    value, slope = objective(np.zeros(len(objective.free), np.float32))
    for grid in objective.grids:  # what it has is what is wanted
        levels = objective.filters.levels(objective.luma)
        bands = np.stack([a - b for a, b in zip(levels, levels[1:])]).reshape(OCTAVES, -1)
        grid.wanted[:] = 0
        features = np.stack([part for b in bands for part in (np.maximum(b, 0), np.maximum(-b, 0))])
        parts = np.split(features[:, grid.number], grid.starts[1:], axis=1)
        grid.wanted[:] = np.stack([(p**2).mean(1) for p in parts], 1) / grid.usual
    value_after, slope_after = objective(np.zeros(len(objective.free), np.float32))
    assert value_after < 1e-6 * value
    assert np.abs(slope_after).max() < 1e-3 * np.abs(slope).max()


def test_windows_half_a_window_off():
    """Of one window that is known, all four that overlap it know as much; others nothing."""
    energies = np.zeros((2 * OCTAVES, WINDOWS**2), np.float32)
    energies[:, 3 * WINDOWS + 5] = 2
    known = energies[0] > 0
    wide, found = halfway(energies, known)
    square = (WINDOWS + 1, WINDOWS + 1)
    assert_array_equal(np.argwhere(found.reshape(square)), [[3, 5], [3, 6], [4, 5], [4, 6]])
    assert_allclose(wide[:, found], 2)


def test_rows_of_bands():
    gram = np.diag(np.arange(FEATURES, dtype=np.float32))[None].repeat(WINDOWS**2, 0)
    rows = wanted_of(Correlations(gram, np.ones(WINDOWS**2)))[:, 0]
    assert_array_equal(rows, [k * KINDS + sign for k in range(OCTAVES) for sign in (0, 1)])


def test_hidden_skin_gets_the_energy_of_the_seen(head, rng):
    """Grain of a skin is weakened in a hidden half: it comes back; what is seen stays to the bit."""
    atlas = make_atlas(head, SIZE).take("skin")
    windows = windows_of(head, atlas)
    on_skin = atlas.paint(np.ones(len(atlas.index), np.float32))
    grain = rng.normal(size=(SIZE, SIZE, 1)).astype(np.float32) * 0.1
    truth = 0.3 * np.exp(grain) * np.ones(3, np.float32)
    hidden = np.zeros((SIZE, SIZE), np.float32)
    hidden[:, SIZE // 2 :] = 1
    hidden *= on_skin
    start = np.where(hidden[..., None] > 0, 0.3 * np.exp(0.75 * grain), truth).astype(np.float32)
    wanted = correlations(truth, on_skin, windows)
    wanted = Correlations(wanted.gram, (wanted.known > 0).astype(np.float32))
    found = synthesized(start, hidden, on_skin, wanted, windows)
    assert_array_equal(found[hidden == 0], start[hidden == 0])
    assert_allclose(found[..., 0] / start[..., 0], found[..., 2] / start[..., 2], rtol=1e-5)

    def strength(albedo):
        inside = windows.atlas.index[(windows.number >= 0)]
        inside = inside[hidden.reshape(-1)[inside] > 0]
        return float(np.log(albedo @ LUMA).reshape(-1)[inside].std())

    # NEAR holds some of it back.
    assert 0.9 * strength(truth) < strength(found) < 1.05 * strength(truth)


def test_a_denser_atlas_is_changed_alike(head, rng, monkeypatch):
    """Beyond the database's density the change is found there and enlarged; the rest stays."""
    monkeypatch.setattr(complete, "DENSITY", SIZE)
    dense = 2 * SIZE
    atlas = make_atlas(head, dense).take("skin")
    on_skin = atlas.paint(np.ones(len(atlas.index), np.float32))
    coarse = rng.normal(size=(SIZE, SIZE)).astype(np.float32) * 0.1
    grain = cv2.resize(coarse, (dense, dense), interpolation=cv2.INTER_CUBIC)[..., None]
    hidden = on_skin.copy()
    hidden[:, :SIZE] = 0
    start = 0.3 * np.exp(grain) * np.ones(3, np.float32)
    windows = windows_of(head, atlas)
    found = complete._at_density(start, hidden, on_skin, wanted_everywhere(0.01), head, windows)
    assert_array_equal(found[hidden == 0], start[hidden == 0])
    change = np.log(found / start)[..., 0]
    chart = np.zeros(dense * dense, np.float32)
    chart[atlas.index[windows.number >= 0]] = 1
    inner = cv2.erode(chart.reshape(dense, dense) * hidden, np.ones((9, 9))) > 0
    assert np.abs(change[inner]).mean() > 0.01
    small = cv2.resize(change, (SIZE, SIZE), interpolation=cv2.INTER_AREA)
    again = cv2.resize(small, (dense, dense), interpolation=cv2.INTER_CUBIC)
    # There and back loses what is finer than the smaller atlas: nothing of it was put in.
    assert np.abs(again - change)[inner].mean() < 0.4 * np.abs(change)[inner].mean()


def test_nothing_hidden(head):
    windows = windows_of(head, make_atlas(head, SIZE).take("skin"))
    albedo, blank = np.full((SIZE, SIZE, 3), 0.3, np.float32), np.zeros((SIZE, SIZE), np.float32)
    found = synthesized(albedo, blank, 1 - blank, wanted_everywhere(0.01), windows)
    assert_array_equal(found, albedo)


def test_no_window_lies_across_the_back_of_the_head(head):
    """There the chart begins and ends: a face between had all windows in a few texels, a scratch."""
    atlas = make_atlas(head, SIZE).take("skin")
    windows = windows_of(head, atlas)
    behind = atlas.at(head.mean)[:, 2] < head.mean[:, 2].min() + 40
    assert behind.sum() > 100 and (windows.number[behind] == -1).all()
