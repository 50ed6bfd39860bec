"""The loops of `bakery.synth.quick`, compiled."""

import numba
import numpy as np


@numba.njit(cache=True, nogil=True, fastmath=True)
def gather(face, weight, faces, values):
    """Blend vertex values [V, C] at points (face [n], barycentric [n, 3]): [n, C] float32."""
    count, channels = len(face), values.shape[1]
    out = np.empty((count, channels), np.float32)
    for i in range(count):
        a, b, c = faces[face[i], 0], faces[face[i], 1], faces[face[i], 2]
        wa, wb, wc = weight[i, 0], weight[i, 1], weight[i, 2]
        for k in range(channels):
            out[i, k] = wa * values[a, k] + wb * values[b, k] + wc * values[c, k]
    return out


@numba.njit(cache=True, nogil=True, fastmath=True)
def unit(vectors):
    """Rows [n, 3] scaled to length 1."""
    out = np.empty(vectors.shape, np.float32)
    for i in range(len(vectors)):
        x, y, z = vectors[i, 0], vectors[i, 1], vectors[i, 2]
        scale = np.float32(1) / (np.sqrt(x * x + y * y + z * z) + np.float32(1e-9))
        out[i, 0], out[i, 1], out[i, 2] = x * scale, y * scale, z * scale
    return out


@numba.njit(cache=True, nogil=True, fastmath=True)
def tilt(face, faces, points, steps, slope, smooth, steepest):
    """Unit normals [n, 3] of a surface with relief.

    Args:
        face: [n] face of each point; faces: [F, 3]; points: [V, 3] mm.
        steps: [F, 2, 2] texels (u, v) along the first and second edge of each face.
        slope: [n, 2] mm of height per texel along u and v.
        smooth: [n, 3] unit normals without relief.
        steepest: tangent of the steepest slope that is kept.
    """
    out = np.empty(smooth.shape, np.float32)
    e1, e2, g = np.empty(3), np.empty(3), np.empty(3)
    for i in range(len(face)):
        f = face[i]
        a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
        g11, g12, g22 = 0.0, 0.0, 0.0
        for d in range(3):
            e1[d], e2[d] = points[b, d] - points[a, d], points[c, d] - points[a, d]
            g11 += e1[d] * e1[d]
            g12 += e1[d] * e2[d]
            g22 += e2[d] * e2[d]
        # Height gained along each edge, and the gradient in the face's plane that gives just that.
        r1 = steps[f, 0, 0] * slope[i, 0] + steps[f, 0, 1] * slope[i, 1]
        r2 = steps[f, 1, 0] * slope[i, 0] + steps[f, 1, 1] * slope[i, 1]
        determinant = max(g11 * g22 - g12 * g12, 1e-6)
        one, two = (g22 * r1 - g12 * r2) / determinant, (g11 * r2 - g12 * r1) / determinant
        along, square = 0.0, 0.0
        for d in range(3):
            g[d] = one * e1[d] + two * e2[d]
            along += g[d] * smooth[i, d]
        for d in range(3):
            g[d] -= along * smooth[i, d]
            square += g[d] * g[d]
        limit = min(1.0, steepest / max(np.sqrt(square), 1e-6))
        scale = 1 / np.sqrt(1 + square * limit * limit)
        for d in range(3):
            out[i, d] = (smooth[i, d] - g[d] * limit) * scale
    return out


@numba.njit(cache=True, nogil=True, fastmath=True)
def swell(faces, posed, neutral):
    """How much blood each vertex [V] gains (> 0: skin pressed together) or loses (< 0: stretched)."""
    total, mass = np.zeros(len(posed), np.float32), np.full(len(posed), 1e-6, np.float32)
    for f in range(len(faces)):
        a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
        now, rest = _area(posed, a, b, c), max(_area(neutral, a, b, c), 1e-3)
        change = min(max(1 - now / rest, -0.5), 0.5) * rest
        for k in range(3):
            total[faces[f, k]] += change
            mass[faces[f, k]] += rest
    return total / mass


@numba.njit(cache=True, nogil=True, fastmath=True, inline="always")
def _area(points, a, b, c):
    x1, y1, z1 = (
        points[b, 0] - points[a, 0],
        points[b, 1] - points[a, 1],
        points[b, 2] - points[a, 2],
    )
    x2, y2, z2 = (
        points[c, 0] - points[a, 0],
        points[c, 1] - points[a, 1],
        points[c, 2] - points[a, 2],
    )
    nx, ny, nz = y1 * z2 - z1 * y2, z1 * x2 - x1 * z2, x1 * y2 - y1 * x2
    return np.sqrt(nx * nx + ny * ny + nz * nz)
