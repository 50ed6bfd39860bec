"""Linear light to bytes of sRGB and back, where 300 pictures a bake need it."""

from functools import cache

import numba
import numpy as np

from bakery.geometry.color import to_encoded, to_linear

CELLS = 4096  # of 0..1; no byte is narrower than one: the curve rises by at most 12.92


def encode(linear: np.ndarray) -> np.ndarray:
    """Linear colours [...] to sRGB uint8: `encode_reference` in a tenth of its time."""
    linear = np.ascontiguousarray(linear, np.float32)
    out = np.empty(linear.shape, np.uint8)
    _encode(linear.ravel(), *_steps(), out.ravel())
    return out


def encode_reference(linear: np.ndarray) -> np.ndarray:
    """Linear colours [...] to sRGB uint8, the nearest byte."""
    return np.round(to_encoded(linear) * 255).astype(np.uint8)


def decode(encoded: np.ndarray) -> np.ndarray:
    """Bytes of sRGB [...] to linear float32, as `to_linear` of their 255th parts."""
    return _decoded()[encoded]


@cache
def _decoded():
    return to_linear(np.arange(256, dtype=np.uint8) / np.float32(255))


@cache
def _steps():
    """The least float32 of each byte, infinity last [257], and the byte of each cell's start."""
    low, high = np.zeros(256, np.int32), np.full(256, np.float32(1).view(np.int32))
    while (low < high).any():  # positive floats are in the order of their bits
        middle = (low + high) // 2
        there = encode_reference(middle.view(np.float32)) >= np.arange(256)
        low, high = np.where(there, low, middle + 1), np.where(there, middle, high)
    starts = np.arange(CELLS + 1, dtype=np.float32) / CELLS
    return np.append(low.view(np.float32), np.float32(np.inf)), encode_reference(starts)


@numba.njit(cache=True, nogil=True)
def _encode(linear, least, starts, out):
    for i in range(len(linear)):
        value = linear[i]
        if not value > 0:  # not a number, too
            out[i] = 0
        elif value >= 1:
            out[i] = 255
        else:
            byte = int(starts[int(value * np.float32(CELLS))])
            while value >= least[byte + 1]:
                byte += 1
            out[i] = byte
