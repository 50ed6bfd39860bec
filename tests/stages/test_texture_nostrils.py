"""The nostrils of a head model have the tone of the skin around where its photo shows none."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from bakery.geometry.color import LUMA
from bakery.landmarks import NOSE_BASE
from bakery.stages.atlas import make_atlas
from bakery.stages.texture import nostrils
from bakery.stages.texture.nostrils import hollows, one_pair
from bakery.stages.texture.occlusion import Openness

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
    assert np.linalg.norm(places[inside] - base, axis=1).max() < 26  # mm, the wings' far ends
    left, right = inside & (places[:, 0] > 1), inside & (places[:, 0] < -1)
    assert 20 < left.sum() < 1000
    assert left.sum() == pytest.approx(right.sum(), rel=0.15)
    middle = [places[side].mean(0) * [side_of, 1, 1] for side, side_of in ((left, 1), (right, -1))]
    assert_allclose(*middle, atol=1)


def test_a_head_without_nostrils_is_left_alone(head, nose, monkeypatch):
    flat = replace(head, name="flat")  # one of its own, of which nothing is kept
    monkeypatch.setattr(
        nostrils, "openness", lambda head, shape: Openness(*np.ones((2, len(shape))))
    )
    assert hollows(flat, SIZE)[0].max() == 0
    colors = np.tile(SKIN, (len(nose[1]), 1))
    seen = np.ones(len(nose[1]), np.float32)
    assert one_pair(colors, seen, flat, make_atlas(flat, SIZE).take("skin")) is colors


def photo(head, nose, above):
    """Skin with made-up dark hollows, and black nostrils that were seen so many mm above: colours, seen."""
    on_skin, where = nose
    places = on_skin.at(head.mean)
    pores = np.exp(0.05 * np.random.default_rng(0).normal(size=(len(where), 1)))
    dark = SKIN * pores * (1 - 0.5 * (where[:, None] > 0.5))
    _, texel = hollows(head, SIZE)
    row, column = np.divmod(on_skin.index, SIZE)
    seen = (where < 0.5).astype(np.float32)
    for side in (-1, 1):
        hollow = (where > 0.5) & (places[:, 0] * side > 1)
        y, x = row[hollow].mean() - above / texel, column[hollow].mean()
        spot = np.exp(-(((row - y) / 3) ** 2) - ((column - x) / 6) ** 2)[:, None]
        dark = dark * (1 - 0.9 * spot)
    return dark.astype(np.float32), seen


def test_made_up_ones_go_where_the_photo_shows_its_own_above(head, nose):
    on_skin, where = nose
    colors, seen = photo(head, nose, 7.0)
    made = one_pair(colors, seen, head, on_skin)
    core = where > 0.95
    assert core.sum() > 20
    assert_allclose(np.median(made[core], 0), SKIN, rtol=0.1)
    assert np.log(made[core] @ LUMA).std() > 0.005  # what of grain is finer than 0.25 mm
    assert_allclose(made[seen > 0], colors[seen > 0], rtol=1e-3)


@pytest.mark.parametrize("above", [0.0, 3.0])
def test_they_stay_where_the_photo_has_them_too(head, nose, above):
    colors, seen = photo(head, nose, above)
    assert_allclose(one_pair(colors, seen, head, nose[0]), colors, rtol=1e-5)


def test_they_stay_where_no_nostril_is_seen(head, nose):
    on_skin, where = nose
    colors = (SKIN * (1 - 0.5 * (where[:, None] > 0.5))).astype(np.float32)
    for seen in (np.zeros(len(where)), (where < 0.5) * 1.0):
        made = one_pair(colors, seen.astype(np.float32), head, on_skin)
        assert_allclose(made, colors, rtol=1e-5)
