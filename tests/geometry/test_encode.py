"""Bytes of sRGB by steps and by the curve."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from bakery.geometry.color import to_linear
from bakery.geometry.encode import decode, encode, encode_reference


def test_bytes_are_those_of_the_curve():
    values = np.concatenate([np.linspace(-0.2, 1.2, 200_001), np.geomspace(1e-9, 1, 99_999)])
    values = values.astype(np.float32).reshape(-1, 3)[::-1]
    made = encode(values)
    assert made.shape == values.shape and made.dtype == np.uint8
    np.testing.assert_array_equal(made, encode_reference(values))


@given(st.floats(width=32, allow_nan=False))
def test_any_number_has_its_byte(value):
    assert encode(np.float32([value])) == encode_reference(np.float32([value]))


def test_what_is_no_number_is_black():
    assert encode(np.float32([np.nan, -np.inf, np.inf])).tolist() == [0, 0, 255]


def test_bytes_come_back():
    every = np.arange(256, dtype=np.uint8)
    np.testing.assert_array_equal(encode(decode(every)), every)
    np.testing.assert_array_equal(decode(every), to_linear(every / np.float32(255)))
