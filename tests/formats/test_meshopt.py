"""Packing by EXT_meshopt_compression, against a decoder that is written anew from its specification.

`tests/web/test_three.py` holds the same streams against the reference decoder of the authors.
"""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as some
from hypothesis.extra import numpy as arrays

from bakery.formats.meshopt import encode_indices, encode_vertices

WIDTHS = (0, 2, 4, 8)


def unzigzag(value):
    return (value >> 1) ^ -(value & 1)


def decode_vertices(data, count, stride):
    """Appendix A, mode 0, version 0."""
    assert data[0] == 0xA0
    before = list(data[-stride:])
    out = np.zeros((count, stride), np.uint8)
    block, at = min(8192 // stride & ~15, 256), 1
    for first in range(0, count, block):
        size = min(block, count - first)
        groups = (size + 15) // 16
        for byte in range(stride):
            header, at = data[at : at + (groups + 3) // 4], at + (groups + 3) // 4
            deltas = []
            for group in range(groups):
                bits = WIDTHS[header[group // 4] >> (group % 4 * 2) & 3]
                if bits in (0, 8):
                    deltas += list(data[at : at + 16]) if bits else [0] * 16
                    at += 2 * bits
                    continue
                packed, at = data[at : at + 2 * bits], at + 2 * bits
                text = "".join(f"{value:08b}" for value in packed)
                for k in range(16):
                    value = int(text[k * bits : (k + 1) * bits], 2)
                    if value == (1 << bits) - 1:
                        value, at = data[at], at + 1
                    deltas.append(value)
            for row, delta in enumerate(deltas[:size]):
                before[byte] = (before[byte] + unzigzag(delta)) & 255
                out[first + row, byte] = before[byte]
    assert len(data) - at == max(stride, 32), "a tail of 32 bytes, or one entry"
    return out


def decode_indices(data, count):
    """Appendix A, mode 2."""
    assert data[0] == 0xD1 and data[-4:] == bytes(4)
    out, last, at = [], [0, 0], 1
    for _ in range(count):
        value = shift = 0
        while True:
            byte, at = data[at], at + 1
            value |= (byte & 127) << shift
            shift += 7
            if byte < 128:
                break
        last[value & 1] += unzigzag(value >> 1)
        out.append(last[value & 1])
    assert at == len(data) - 4
    return out


@pytest.mark.parametrize("count", [1, 15, 16, 17, 255, 256, 257, 1000])
@pytest.mark.parametrize("stride", [4, 8, 12, 64, 256])
def test_vertices_come_back(count, stride):
    rng = np.random.default_rng(count + stride)
    steps = rng.choice([0, 1, 3, 12, 90], (count, stride), p=[0.6, 0.15, 0.1, 0.1, 0.05])
    data = np.cumsum(steps * rng.choice([-1, 1], steps.shape), 0).astype(np.uint8)
    np.testing.assert_array_equal(decode_vertices(encode_vertices(data), count, stride), data)


def test_what_rests_takes_next_to_no_room():
    """A shape that moves nothing: two bits for sixteen bytes."""
    packed = encode_vertices(np.zeros((4096, 4), np.int16))
    assert len(packed) == 1 + 4096 * 8 // 64 + 32


def test_noise_grows_by_its_headers_only():
    data = np.random.default_rng(0).integers(0, 256, (4096, 8), dtype=np.uint8)
    assert len(encode_vertices(data)) == 1 + data.size * (1 + 1 / 64) + 32


def test_indices_come_back():
    rng = np.random.default_rng(1)
    indices = np.concatenate([rng.integers(0, 70_000, 500), np.arange(100), [0, 2**31 - 1, 0]])
    assert decode_indices(encode_indices(indices), len(indices)) == indices.tolist()


SHAPES = some.tuples(some.integers(1, 300), some.sampled_from([4, 8, 12, 16, 64, 256]))


@given(arrays.arrays(np.uint8, SHAPES, fill=some.integers(0, 255)))
def test_any_bytes_come_back(data):
    np.testing.assert_array_equal(decode_vertices(encode_vertices(data), *data.shape), data)


@given(some.lists(some.integers(0, 2**31 - 1), min_size=1, max_size=200))
def test_any_indices_come_back(values):
    assert decode_indices(encode_indices(np.array(values)), len(values)) == values


@pytest.mark.parametrize("array", [np.zeros((0, 4), np.uint8), np.zeros((3, 3), np.uint8)])
def test_other_sizes_are_refused(array):
    with pytest.raises(ValueError, match="needs some of 4 to 256"):
        encode_vertices(array)
