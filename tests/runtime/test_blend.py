"""Equation 4 and the mouth's weighted median, against closed forms."""

import numpy as np

from bakery.runtime.blend import nearest_gaze
from bakery.runtime.mouth import neighbours, weighted_median
from bakery.stages.mask import expression_texture, key_activation

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


def test_recovered_texture_of_one_shape():
    """T_e with one key that has all of e, under a full mask, is that key's texture."""
    masks = np.zeros((E, 2, 2), np.float32)
    masks[7] = 1
    keys = np.zeros((2, E), np.float32)
    keys[1, 7] = 1
    textures = np.stack([np.full((2, 2, 3), 0.2), np.full((2, 2, 3), 0.7)])
    out = expression_texture(7, np.zeros((2, 2, 3)), textures, masks, keys)
    np.testing.assert_allclose(out, 0.7, atol=1e-6)


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
