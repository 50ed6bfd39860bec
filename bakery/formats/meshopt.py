"""Packing of vertices and indices as glTF's EXT_meshopt_compression defines it.

Only what the bundle needs is written: vertex streams of version 0 and index sequences. Both are
lossless. Decoders are many (three.js, Babylon, Filament); the tests hold this against one.

References:
    https://github.com/KhronosGroup/glTF, extensions/2.0/Vendor/EXT_meshopt_compression, appendix A.
"""

import numba
import numpy as np

GROUP = 16  # deltas that share a width
TAIL = 32  # bytes, least size of the end of a vertex stream
SEQUENCE_TAIL = 4  # zero bytes after an index sequence
VERTEX_HEADER, SEQUENCE_HEADER = 0xA0, 0xD1


def encode_vertices(array):
    """Pack vertices.

    Args:
        array: [N, ...] contiguous; the bytes of one entry are a multiple of four, at most 256.

    Returns:
        bytes, for mode ATTRIBUTES.

    Raises:
        ValueError: the entries have another size.
    """
    array = np.ascontiguousarray(array)
    stride = array.nbytes // max(len(array), 1)
    if not len(array) or stride % 4 or not 4 <= stride <= 256:
        raise ValueError(
            f"{len(array)} vertices of {stride} bytes; needs some of 4 to 256, by fours"
        )
    data = array.view(np.uint8).reshape(len(array), stride)
    out = np.empty(64 + data.size * 2, np.uint8)
    out[0] = VERTEX_HEADER
    end = _encode_blocks(data, out, 1)
    tail = np.zeros(max(stride, TAIL), np.uint8)
    tail[-stride:] = data[0]
    return out[:end].tobytes() + tail.tobytes()


@numba.njit(cache=True, nogil=True)
def _encode_blocks(data, out, at):
    """Blocks of vertices, each byte of the entry by itself; returns where the output ends."""
    count, stride = data.shape
    block = min(8192 // stride // GROUP * GROUP, 256)
    deltas = np.zeros(256, np.uint8)
    for first in range(0, count, block):
        size = min(block, count - first)
        groups = (size + GROUP - 1) // GROUP
        for byte in range(stride):
            deltas[:] = 0
            for row in range(size):
                before = data[max(first + row - 1, 0), byte]
                step = np.int8(data[first + row, byte] - before)
                deltas[row] = (step << 1) ^ (step >> 7)
            header = at
            at += (groups + 3) // 4
            out[header:at] = 0
            for group in range(groups):
                piece = deltas[group * GROUP : (group + 1) * GROUP]
                mode, at = _encode_group(piece, out, at)
                out[header + group // 4] |= mode << (group % 4 * 2)
    return at


@numba.njit(cache=True, nogil=True)
def _encode_group(piece, out, at):
    """Sixteen deltas in the narrowest of four widths; returns the width's number and the end."""
    small, middle, used = 0, 0, False
    for value in piece:
        used = used or value > 0
        small += value >= 3
        middle += value >= 15
    if not used:
        return 0, at
    sizes = (4 + small, 8 + middle, GROUP)
    mode = 1
    for other in (2, 3):
        if sizes[other - 1] < sizes[mode - 1]:
            mode = other
    if mode == 3:
        out[at : at + GROUP] = piece
        return mode, at + GROUP
    bits = 2 * mode
    most = (1 << bits) - 1  # stands for a value that follows in full
    share = 8 // bits
    extra = at + GROUP // share
    out[at:extra] = 0
    for k in range(GROUP):
        value = min(piece[k], most)
        out[at + k // share] |= value << (8 - bits - k % share * bits)
        if value == most:
            out[extra] = piece[k]
            extra += 1
    return mode, extra


def encode_indices(indices):
    """Pack any sequence of indices [N] below 2**31 as bytes, for mode INDICES."""
    out = np.empty(len(indices) * 5 + 1, np.uint8)
    out[0] = SEQUENCE_HEADER
    end = _encode_sequence(np.ascontiguousarray(indices, np.int64).ravel(), out, 1)
    return out[:end].tobytes() + bytes(SEQUENCE_TAIL)


@numba.njit(cache=True, nogil=True)
def _encode_sequence(indices, out, at):
    """Each index as the step from the nearer of two running bases."""
    last = np.zeros(2, np.int64)
    for index in indices:
        base = 0 if abs(index - last[0]) <= abs(index - last[1]) else 1
        step = index - last[base]
        last[base] = index
        value = (((step << 1) ^ (step >> 63)) << 1) | base
        while value >= 128:
            out[at] = (value & 127) | 128
            at += 1
            value >>= 7
        out[at] = value
        at += 1
    return at
