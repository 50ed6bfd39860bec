"""The nostrils of a head model have the tone of the skin around where its photo shows none."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from bakery.geometry.color import LUMA
from bakery.landmarks import NOSE_BASE
from bakery.stages.atlas import make_atlas
from bakery.stages.texture.nostrils import hollows, one_pair

SIZE = 512
SKIN = np.array([0.45, 0.28, 0.22], np.float32)


@pytest.fixture(scope="module")
def nose(head):
    """Atlas of the skin, and where its hollows are, [N]."""
    on_skin = make_atlas(head, SIZE).take("skin")
    return on_skin, hollows(head, SIZE)[0].reshape(-1)[on_skin.index]


def test_there_are_two_alike_beside_the_middle(head, nose):
    on_skin, where = nose
    places = on_skin.at(head.mean)
    inside = where > 0.5
    base = head.landmarks(head.mean)[NOSE_BASE[0]]
    assert np.linalg.norm(places[inside] - base, axis=1).max() < 25
    left, right = inside & (places[:, 0] > 1), inside & (places[:, 0] < -1)
    assert 20 < left.sum() < 1000
    assert left.sum() == pytest.approx(right.sum(), rel=0.15)
    middle = [places[side].mean(0) * [side_of, 1, 1] for side, side_of in ((left, 1), (right, -1))]
    assert_allclose(*middle, atol=1)


def test_made_up_ones_go_and_seen_ones_and_grain_stay(head, nose):
    on_skin, where = nose
    pores = np.exp(0.05 * np.random.default_rng(0).normal(size=(len(where), 1)))
    dark = (SKIN * pores * (1 - 0.5 * where[:, None])).astype(np.float32)
    unseen = np.zeros(len(where), np.float32)
    made = one_pair(dark, unseen, head, on_skin)
    core = where > 0.95
    assert core.sum() > 20
    assert_allclose(np.median(made[core], 0), SKIN, rtol=0.05)
    assert np.log(made[core] @ LUMA).std() > 0.02  # grain; not a flat patch
    away = where < 1e-3
    assert_allclose(made[away], dark[away], rtol=1e-3)  # of that share it may change
    assert_allclose(one_pair(dark, unseen + 1, head, on_skin), dark, rtol=1e-5)


def test_the_photos_own_nostril_beside_does_not_leak_into_them(head, nose):
    on_skin, where = nose
    places = on_skin.at(head.mean)
    base = head.landmarks(head.mean)[NOSE_BASE[0]]
    seen = (where < 0.01) & (np.abs(places[:, 1] - base[1] - 5) < 1.5) & (np.abs(places[:, 0]) < 12)
    assert seen.any()
    colors = np.where(seen[:, None], 0.1 * SKIN, SKIN * (1 - 0.5 * where[:, None]))
    made = one_pair(colors.astype(np.float32), seen.astype(np.float32), head, on_skin)
    assert_allclose(np.median(made[where > 0.95], 0), SKIN, rtol=0.1)
    assert_allclose(made[seen], colors[seen], rtol=1e-4)
