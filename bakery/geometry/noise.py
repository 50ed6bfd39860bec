"""Seamless value noise in space: a function of position, so texture seams do not show in it."""

import numba
import numpy as np


@numba.njit(cache=True, nogil=True)
def _hash(x, y, z, seed):
    """Integers to -1..1; 64-bit words are cut to 32 bits, since numba widens every product."""
    mask = np.uint64(0xFFFFFFFF)
    h = np.uint64(seed)
    h ^= (np.uint64(x) * np.uint64(0x8DA6B343)) & mask
    h ^= (np.uint64(y) * np.uint64(0xD8163841)) & mask
    h ^= (np.uint64(z) * np.uint64(0xCB1AB31F)) & mask
    h = ((h ^ (h >> np.uint64(16))) * np.uint64(0x7FEB352D)) & mask
    h = ((h ^ (h >> np.uint64(15))) * np.uint64(0x846CA68B)) & mask
    h ^= h >> np.uint64(16)
    return np.float64(h) / 2147483648.0 - 1.0


@numba.njit(cache=True, nogil=True)
def _value_noise(points, wavelength, seed, out):
    for n in range(points.shape[0]):
        x, y, z = points[n, 0] / wavelength, points[n, 1] / wavelength, points[n, 2] / wavelength
        ix, iy, iz = np.floor(x), np.floor(y), np.floor(z)
        fx, fy, fz = x - ix, y - iy, z - iz
        fx, fy, fz = fx * fx * (3 - 2 * fx), fy * fy * (3 - 2 * fy), fz * fz * (3 - 2 * fz)
        jx, jy, jz = np.int64(ix), np.int64(iy), np.int64(iz)
        total = 0.0
        for cx in range(2):
            wx = fx if cx else 1 - fx
            for cy in range(2):
                wy = fy if cy else 1 - fy
                for cz in range(2):
                    wz = fz if cz else 1 - fz
                    total += wx * wy * wz * _hash(jx + cx, jy + cy, jz + cz, seed)
        out[n] = total


def value_noise(points, wavelength, seed=0):
    """Smooth noise of unit variance at points.

    Args:
        points: [N, 3] mm.
        wavelength: mm between the lattice points.
        seed: another seed, another noise.

    Returns:
        [N] float32, mean 0, variance about 1.
    """
    out = np.empty(len(points), np.float32)
    _value_noise(np.ascontiguousarray(points, np.float64), float(wavelength), int(seed), out)
    # A lattice value is uniform in -1..1 (variance 1/3); smoothstep weights leave (26/35)^3 of it.
    return out * np.float32(np.sqrt(3 / (26 / 35) ** 3))
