"""Takes changed for another face: closed forms, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest

from bakery.errors import InputError
from bakery.formats.livelink import Take
from bakery.motion.retarget import parse_gain, retarget
from bakery.types import EXPRESSION_INDEX


def take():
    weights = np.zeros((3, 52), np.float32)
    weights[:, EXPRESSION_INDEX["jawOpen"]] = [0.2, 0.6, 1.0]
    weights[:, EXPRESSION_INDEX["eyeLookUpLeft"]] = [0.0, 0.4, 0.8]
    head = np.array([[1.0, 2, 3], [2, 4, 6], [3, 6, 9]])
    return Take(np.arange(3) / 30, weights, head, np.ones((3, 2, 2)) * [[[1]], [[2]], [[3]]])


def of(take, name):
    return take.weights[:, EXPRESSION_INDEX[name]]


def test_nothing_asked_nothing_changed():
    np.testing.assert_array_equal(retarget(take()).weights, take().weights)
    np.testing.assert_array_equal(retarget(take()).head, take().head)


def test_rest_is_taken_off_and_full_stays_full():
    out = retarget(take(), neutral=0)
    np.testing.assert_allclose(of(out, "jawOpen"), [0, 0.5, 1.0], atol=1e-6)
    np.testing.assert_allclose(out.head, [[0, 0, 0], [1, 2, 3], [2, 4, 6]])
    np.testing.assert_allclose(out.eyes[:, 0, 0], [0, 1, 2])
    np.testing.assert_allclose(of(retarget(take(), neutral=1), "jawOpen"), [0, 0, 1.0], atol=1e-6)


def test_gains():
    out = retarget(take(), parse_gain(["2", "jawOpen=0.5,head=0.1", "gaze=0.5"]))
    np.testing.assert_allclose(of(out, "jawOpen"), [0.1, 0.3, 0.5], atol=1e-6)
    np.testing.assert_allclose(of(out, "eyeLookUpLeft"), [0, 0.4, 0.5], atol=1e-6)  # 2, cut, 0.5
    np.testing.assert_allclose(out.head, take().head * 0.1)
    np.testing.assert_allclose(out.eyes, take().eyes * 0.5)
    assert retarget(replace(take(), eyes=None), {"gaze": 0.5}).eyes is None


def test_what_is_refused():
    for text, message in (("much", "NAME=NUMBER"), ("-1", "0 to 10"), ("nan", "0 to 10"),
                          ("smile=1", "no 'smile'"), ("jawOpen=", "NAME=NUMBER")):  # fmt: skip
        with pytest.raises(InputError, match=message):
            parse_gain([text])
    with pytest.raises(InputError, match="has 3 rows"):
        retarget(take(), neutral=3)
