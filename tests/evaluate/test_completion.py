"""Hidden skin, completed and measured: known answers, and the ways of the option."""

import numpy as np
import pytest

from bakery.evaluate import completion
from bakery.landmarks import OVAL
from bakery.stages.atlas import make_atlas, uv_polygon
from bakery.stages.texture import METHODS
from bakery.stages.texture.unwrap import PartialAlbedo
from bakery.train.regions import REGIONS, hidden_region

SIZE = 256


@pytest.fixture(scope="module")
def atlas(head):
    return make_atlas(head, SIZE).take("skin")


def noisy(amount):
    noise = np.random.default_rng(0).normal(0, amount, (SIZE, SIZE, 1))
    return (np.array([0.35, 0.22, 0.16]) * np.exp(noise)).astype(np.float32)


def test_the_same_is_perfect_and_half_the_grain_is_one_octave_less():
    everywhere = np.ones((SIZE, SIZE), bool)
    same = completion.score(noisy(0.05), noisy(0.05), everywhere)
    assert same.psnr > 100 and same.octaves == pytest.approx(0, abs=1e-6)
    half = completion.score(noisy(0.025), noisy(0.05), everywhere)
    assert half.energy == pytest.approx([0.5] * completion.OCTAVES, abs=0.02)
    assert half.octaves == pytest.approx(1, abs=0.05)


def test_regions_are_where_their_names_say(head, atlas):
    marks = head.landmark_uv() * SIZE
    shown = {name: hidden_region(name, head, atlas) for name in REGIONS}
    at = {
        name: {key: picture[tuple(marks[number][::-1].astype(int))] for key, number in points}
        for name, picture in shown.items()
        for points in [(("chin", 199), ("brow", 9), ("top", 10), ("left", 280), ("right", 50))]
    }
    assert at["mouth"] == {"chin": 1, "brow": 0, "top": 0, "left": 0, "right": 0}
    assert at["forehead"]["top"] == 1 and at["forehead"]["chin"] == 0
    assert at["half"]["left"] == 1 and at["half"]["right"] == 0
    assert all(0 <= picture.min() and picture.max() <= 1 for picture in shown.values())


def test_hidden_skin_is_hidden_from_every_way(head, atlas):
    """A way that cheats would have to see the truth: it is handed none of it."""
    on_skin = atlas.paint(np.ones(len(atlas.index), np.float32))
    face = uv_polygon(head, OVAL, 1.0, SIZE) * on_skin
    albedo = noisy(0.05)
    partial = PartialAlbedo(albedo, face, face, face, np.ones_like(albedo), on_skin, on_skin)
    given = {}

    def way(left, *_):
        given[len(given)] = left
        return albedo

    scores, rows = completion.measure(partial, head, head.mean, atlas, {"truth": way})
    assert list(scores) == list(REGIONS) and len(rows) == len(REGIONS)
    assert rows[0].shape == (SIZE, 3 * SIZE, 3)
    for name, left in zip(REGIONS, given.values()):
        hidden = hidden_region(name, head, atlas) == 1
        assert left.albedo[hidden].max() == 0 and left.seen[hidden].max() == 0
        assert scores[name]["truth"].psnr > 100
    table = completion.summary([scores, scores])
    assert table["mouth"]["people"] == 2
    assert table["mouth"]["truth"]["octaves"] == 0


def test_the_ways_are_those_of_the_option():
    assert tuple(completion.ways()) == METHODS
