"""Equation 4 and the mouth's weighted median, against closed forms."""

from dataclasses import replace

import numpy as np
import pytest

from bakery.errors import InputError
from bakery.runtime.blend import key_activation, nearest_gaze
from bakery.runtime.mouth import neighbours, weighted_median
from bakery.show.frame import recover
from bakery.types import EXPRESSION_INDEX, EXPRESSIONS

E, K = 52, 3


def setup(seed=0):
    rng = np.random.default_rng(seed)
    return rng.random((E, 4, 5)).astype(np.float32), rng.random((K, E)).astype(np.float32), rng


def test_equation_four_term_by_term():
    masks, keys, rng = setup()
    frame = (rng.random(E) * 0.02).astype(np.float32)
    neutral_weight, key_weights = key_activation(masks, keys, frame)
    raw = np.zeros((K, 4, 5))
    for k in range(K):
        for e in range(E):
            raw[k] += keys[k, e] * frame[e] * masks[e]
    neutral = np.maximum(0, 1 - raw.sum(0))
    total = neutral + raw.sum(0)
    np.testing.assert_allclose(neutral_weight, neutral / total, atol=1e-6)
    np.testing.assert_allclose(key_weights, raw / total, atol=1e-6)


def test_weights_sum_to_one_even_when_keys_exceed_it():
    masks, keys, _ = setup()
    neutral_weight, key_weights = key_activation(masks, keys, np.ones(E, np.float32))
    np.testing.assert_allclose(neutral_weight + key_weights.sum(0), 1, atol=1e-5)


def test_no_expression_is_the_neutral_texture():
    masks, keys, _ = setup()
    neutral_weight, key_weights = key_activation(masks, keys, np.zeros(E, np.float32))
    assert (neutral_weight == 1).all() and (key_weights == 0).all()


def test_recovered_texture_of_one_shape(noise_avatar):
    """T_e of `bakery recover`: e alone at weight 1. Key 1 has all of e, key 4 a quarter of it.

    Under a full mask the texture is theirs, 4 to 1; half a mask leaves 3/8 of the neutral one.
    """
    at = EXPRESSION_INDEX["jawOpen"]
    keys = np.zeros((6, E), np.float32)
    keys[1, at], keys[4, at] = 1, 0.25
    masks = np.zeros((E, 8, 8), np.float32)
    masks[at, :, :4], masks[at, :, 4:] = 1, 0.5
    textures = replace(noise_avatar.textures, key_weights=keys)
    avatar = replace(noise_avatar, textures=textures, masks=masks)
    made = recover(avatar, ["jawOpen", "browInnerUp"])
    neutral = textures.neutral.astype(np.float32)
    one, four = (textures.keys[k].astype(np.float32) for k in (1, 4))
    # Weights lie between texels of the masks; far from the border of the halves they are constant.
    left, right = np.s_[:, :48], np.s_[:, 80:]
    close = {"atol": 6e-4}  # half floats near 1
    np.testing.assert_allclose(made["jawOpen"][left], (0.8 * one + 0.2 * four)[left], **close)
    half = 0.375 * neutral + 0.5 * one + 0.125 * four
    np.testing.assert_allclose(made["jawOpen"][right], half[right], **close)
    np.testing.assert_array_equal(made["browInnerUp"], textures.neutral)  # no key has it
    assert list(recover(avatar)) == list(EXPRESSIONS)
    with pytest.raises(InputError, match="smile"):
        recover(avatar, ["smile"])


def test_weighted_median_by_hand():
    pictures = np.array([1.0, 5.0, 3.0]).reshape(3, 1, 1, 1) * np.ones((1, 1, 1, 3))
    assert weighted_median(pictures, np.array([0.2, 0.2, 0.6]))[0, 0, 0] == 3
    assert weighted_median(pictures, np.array([0.1, 0.8, 0.1]))[0, 0, 0] == 5
    assert weighted_median(pictures, np.array([0.6, 0.2, 0.2]))[0, 0, 0] == 1


def test_weighted_median_against_repetition():
    """Integer weights are repetitions; then it is the lower median of the longer list."""
    rng = np.random.default_rng(3)
    pictures, counts = rng.random((6, 2, 3, 3)), np.array([1, 4, 2, 1, 5, 2])
    repeated = np.sort(np.repeat(pictures, counts, axis=0), axis=0)
    want = repeated[(counts.sum() + 1) // 2 - 1]
    got = weighted_median(pictures, counts / counts.sum())
    np.testing.assert_allclose(got, want, atol=1e-6)


def test_nearest_mouths_come_first():
    rng = np.random.default_rng(1)
    database = rng.normal(size=(80, 40, 2)).astype(np.float32)
    index, weight = neighbours(database, database[17])
    assert index[0] == 17 and len(index) == 50
    assert (np.diff(weight) <= 0).all() and np.isclose(weight.sum(), 1)


def test_nearest_gaze():
    assert nearest_gaze(np.array([[0, 0], [20, 0], [0, 20]]), np.array([3, 14])) == 2
