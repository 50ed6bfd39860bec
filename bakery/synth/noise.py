"""Smooth random fields in space, evaluated anywhere: no picture, no seam.

A field is a function of a point of the mean head, so a subject's skin stays with it through every
expression and view.
"""

import numba
import numpy as np


@numba.njit(cache=True, nogil=True, inline="always")
def _hash(x, y, z, seed):
    """A number of a lattice point. Numba widens the products to 64 bits, so these are not the numbers
    of `geometry.noise`, and skins that are painted already are made of them."""
    h = np.uint32(x) * np.uint32(0x8DA6B343)
    h ^= np.uint32(y) * np.uint32(0xD8163841)
    h ^= np.uint32(z) * np.uint32(0xCB1AB31F)
    h ^= np.uint32(seed) * np.uint32(0x9E3779B1)
    h ^= h >> np.uint32(16)
    h *= np.uint32(0x7FEB352D)
    h ^= h >> np.uint32(15)
    h *= np.uint32(0x846CA68B)
    h ^= h >> np.uint32(16)
    return h


@numba.njit(cache=True, nogil=True, inline="always")
def _unit(h, shift):
    """Ten bits of a hash as a number in -1..1."""
    return np.float32((h >> np.uint32(shift)) & np.uint32(1023)) * np.float32(
        2 / 1023
    ) - np.float32(1)


@numba.njit(cache=True, nogil=True, fastmath=True)
def _gradient_noise(points, scale, octaves, gain, seed, out):
    for i in range(points.shape[0]):
        amplitude = np.float32(1)
        frequency = scale
        for octave in range(octaves):
            x = points[i, 0] * frequency[0]
            y = points[i, 1] * frequency[1]
            z = points[i, 2] * frequency[2]
            ix, iy, iz = np.floor(x), np.floor(y), np.floor(z)
            fx, fy, fz = x - ix, y - iy, z - iz
            ux = fx * fx * fx * (fx * (fx * 6 - 15) + 10)
            uy = fy * fy * fy * (fy * (fy * 6 - 15) + 10)
            uz = fz * fz * fz * (fz * (fz * 6 - 15) + 10)
            dx = 30 * fx * fx * (fx * (fx - 2) + 1)
            dy = 30 * fy * fy * (fy * (fy - 2) + 1)
            dz = 30 * fz * fz * (fz * (fz - 2) + 1)
            value = np.float32(0)
            gx = np.float32(0)
            gy = np.float32(0)
            gz = np.float32(0)
            for corner in range(8):
                cx, cy, cz = corner & 1, (corner >> 1) & 1, corner >> 2
                h = _hash(int(ix) + cx, int(iy) + cy, int(iz) + cz, seed + octave * 7919)
                a, b, c = _unit(h, 0), _unit(h, 10), _unit(h, 20)
                dot = a * (fx - cx) + b * (fy - cy) + c * (fz - cz)
                wx = ux if cx else 1 - ux
                wy = uy if cy else 1 - uy
                wz = uz if cz else 1 - uz
                value += wx * wy * wz * dot
                gx += wy * wz * (wx * a + (dx if cx else -dx) * dot)
                gy += wx * wz * (wy * b + (dy if cy else -dy) * dot)
                gz += wx * wy * (wz * c + (dz if cz else -dz) * dot)
            out[i, 0] += amplitude * value
            out[i, 1] += amplitude * gx * frequency[0]
            out[i, 2] += amplitude * gy * frequency[1]
            out[i, 3] += amplitude * gz * frequency[2]
            amplitude *= gain
            frequency = frequency * np.float32(2)


def gradient_noise(points, size, seed, octaves=1, gain=0.5):
    """Noise and its slope.

    Args:
        points: [N, 3] mm.
        size: mm of the largest blobs, one number or one an axis; each octave halves it.
        seed: integer.
        octaves: how many layers are added.
        gain: strength of each layer relative to the one before.

    Returns:
        value [N] about -0.6..0.6 and gradient [N, 3] per mm, both float32.

    References:
        Perlin, "Improving noise", ACM Transactions on Graphics 21(3), 2002.
    """
    points = np.ascontiguousarray(points, np.float32)
    scale = (1 / np.broadcast_to(np.asarray(size, np.float32), (3,))).astype(np.float32)
    out = np.zeros((len(points), 4), np.float32)
    _gradient_noise(points, scale, octaves, np.float32(gain), int(seed) & 0xFFFFFF, out)
    return out[:, 0], out[:, 1:]


@numba.njit(cache=True, nogil=True, fastmath=True)
def _cells(points, scale, seed, distance, ident):
    for i in range(points.shape[0]):
        x, y, z = points[i, 0] * scale, points[i, 1] * scale, points[i, 2] * scale
        ix, iy, iz = int(np.floor(x)), int(np.floor(y)), int(np.floor(z))
        best = np.float32(9)
        which = np.uint32(0)
        for cx in range(ix - 1, ix + 2):
            for cy in range(iy - 1, iy + 2):
                for cz in range(iz - 1, iz + 2):
                    h = _hash(cx, cy, cz, seed)
                    px = cx + 0.5 + 0.45 * _unit(h, 0) - x
                    py = cy + 0.5 + 0.45 * _unit(h, 10) - y
                    pz = cz + 0.5 + 0.45 * _unit(h, 20) - z
                    d = px * px + py * py + pz * pz
                    if d < best:
                        best = d
                        which = h
        distance[i] = np.sqrt(best) / scale
        ident[i] = np.float32(which & np.uint32(0xFFFF)) / np.float32(65535)


def cells(points, size, seed):
    """Distance [N] mm to the nearest of random points `size` mm apart, and that point's own number 0..1."""
    points = np.ascontiguousarray(points, np.float32)
    distance, ident = np.zeros(len(points), np.float32), np.zeros(len(points), np.float32)
    _cells(points, np.float32(1 / size), int(seed) & 0xFFFFFF, distance, ident)
    return distance, ident
