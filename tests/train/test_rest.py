"""The resting basis: a known change between two photos is learned, mirrored, and left out fairly."""

from dataclasses import replace

import numpy as np
from numpy.testing import assert_allclose

from bakery.heads.base import weights
from bakery.stages.texture.rest import load_rest, log_change
from bakery.train import rest
from bakery.types import EXPRESSIONS

SIZE = 16
OPTIONS = replace(rest.DEFAULTS, size=SIZE, modes=2, ridge=1e-3)


def person(rng, share):
    """A resting and an expressive photo whose left half darkens with a smile on that side."""
    skin = np.log(rng.uniform(0.2, 0.6, (SIZE, SIZE, 3))).astype(np.float32)
    smile = weights({"mouthSmileLeft": share})
    darker = np.zeros((SIZE, SIZE, 3), np.float32)
    darker[4:10, 2:6] = -0.4 * share
    trust = np.ones((SIZE, SIZE), np.float32)
    at_rest = rest.Unwrapped(skin + rng.normal() * 0.1, trust, np.zeros(len(EXPRESSIONS)))
    return at_rest, rest.Unwrapped(skin + darker, trust, smile)


def test_a_known_change_is_learned():
    rng = np.random.default_rng(0)
    known = rest.ratios([person(rng, share) for share in (0.3, 0.5, 0.7, 0.9)], OPTIONS)
    basis = rest.learn(known, OPTIONS)
    for side, columns in (("Left", slice(2, 6)), ("Right", slice(10, 14))):
        change = log_change(basis, weights({"mouthSmile" + side: 0.6}))
        assert_allclose(change[4:10, columns], 0.24, atol=0.02)
        change[4:10, columns] = 0
        assert_allclose(change, 0, atol=0.02)
    found = rest.left_out_error(known, OPTIONS)
    assert found["people"] == 4
    assert found["log_ratio_undone"] < 0.1 * found["log_ratio"]


def test_unseen_texels_say_nothing():
    rng = np.random.default_rng(1)
    at_rest, moved = person(rng, 0.5)
    trust = moved.trust.copy()
    trust[:, :8] = 0
    hidden = rest.Unwrapped(moved.color, trust, moved.expression)
    known = rest.ratios([(at_rest, hidden)], OPTIONS)
    assert (known.change[0, :, :8] == 0).all() and (known.change[1, :, 8:] == 0).all()


def test_twins_are_the_other_side():
    twins = rest.mirrored_weights()
    names = np.array(EXPRESSIONS)
    assert names[twins[EXPRESSIONS.index("mouthSmileLeft")]] == "mouthSmileRight"
    assert names[twins[EXPRESSIONS.index("jawLeft")]] == "jawRight"
    assert names[twins[EXPRESSIONS.index("jawOpen")]] == "jawOpen"
    assert (twins[twins] == np.arange(len(twins))).all()


def test_a_texture_on_the_chart(head):
    """A texture of one colour has it wherever the head's skin lies on the chart."""
    texture = np.full((128, 128, 3), 0.25, np.float32)
    found = rest.on_chart(texture, np.ones((128, 128)), np.zeros(len(EXPRESSIONS)), head, OPTIONS)
    assert_allclose(found.color[found.trust > 0.99], np.log(0.25), rtol=1e-4)
    assert (found.trust > 0.99).mean() > 0.9


def test_files_come_back(tmp_path):
    basis = rest.learn(rest.ratios([person(np.random.default_rng(2), 0.5)], OPTIONS), OPTIONS)
    rest.save(basis, tmp_path / "rest.safetensors")
    again = load_rest(tmp_path / "rest.safetensors")
    assert_allclose(again.modes, basis.modes, atol=2e-3)
    assert_allclose(again.response, basis.response)
