"""Lamps, ambient light and what shades them.

An environment is a few round soft lamps and an ambient dome. The dome and the lamps' soft part reach
the skin through spherical harmonics with the head's own shadows baked at the vertices; the strongest
lamp is shadowed per pixel.
"""

from dataclasses import dataclass

import numba
import numpy as np

from bakery.geometry import harmonics
from bakery.geometry.raster import rasterize

FAR = 1e4  # mm: depth offset that makes the rasteriser's 1/z interpolation parallel


@dataclass(frozen=True)
class Lamp:
    """A round soft light far away."""

    direction: np.ndarray  # [3] unit, camera space, toward the lamp
    color: np.ndarray  # [3] irradiance it gives a surface that faces it, linear
    radius: float  # degrees, how wide it looks from the face


@dataclass(frozen=True)
class Environment:
    """The light of one picture; the first lamp is the key."""

    lamps: tuple
    ambient: np.ndarray  # [9, 3] spherical harmonics of the dome's radiance, linear, camera space

    def radiance(self):
        """Spherical harmonics [9, 3] of the radiance of dome and lamps."""
        total = self.ambient.copy()
        for lamp in self.lamps:
            total += lamp_radiance(lamp)
        return total

    def irradiance_ambient(self):
        """Spherical harmonics [9, 3] of the dome's irradiance / pi, without lamps and shadows."""
        return self.ambient * harmonics.COSINE[:, None] / np.pi

    def irradiance(self):
        """Spherical harmonics [9, 3] of the irradiance / pi (what albedo 1 shows), without shadows."""
        return self.radiance() * harmonics.COSINE[:, None] / np.pi


def lamp_radiance(lamp):
    """A lamp as radiance harmonics [9, 3]: its irradiance on a facing surface is color * pi."""
    return np.outer(harmonics.basis(lamp.direction), lamp.color * np.pi)


def dome(rng, level, warm=0.0):
    """Ambient radiance [9, 3]: a dome brighter above, with a coloured floor and a lighter side."""
    out = np.zeros((9, 3))
    tint = np.array([1 + 0.08 * warm, 1.0, 1 - 0.1 * warm])
    out[0] = level * tint / harmonics.C0
    out[1] = level * rng.uniform(0.15, 0.45) * tint / harmonics.C1
    out[2] = level * rng.uniform(-0.1, 0.35) * tint / harmonics.C1
    out[3] = level * rng.uniform(-0.25, 0.25) * tint / harmonics.C1
    out[6] = level * rng.uniform(-0.05, 0.05) * tint / harmonics.C20
    return out


def sphere_directions(count):
    """Directions [count, 3] spread evenly over the sphere (Fibonacci)."""
    k = np.arange(count) + 0.5
    z = 1 - 2 * k / count
    angle = np.pi * (1 + 5**0.5) * k
    radius = np.sqrt(1 - z * z)
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), z], 1)


def disc_directions(lamp, count):
    """Directions [count, 3] spread evenly over a lamp's disc."""
    axis = np.eye(3)[np.abs(lamp.direction).argmin()]
    right = np.cross(lamp.direction, axis)
    right /= np.linalg.norm(right)
    up = np.cross(right, lamp.direction)
    k = np.arange(count) + 0.5
    r = np.tan(np.radians(lamp.radius)) * np.sqrt(k / count)
    angle = np.pi * (1 + 5**0.5) * k
    out = lamp.direction + np.outer(r * np.cos(angle), right) + np.outer(r * np.sin(angle), up)
    return out / np.linalg.norm(out, axis=1, keepdims=True)


class ShadowMap:
    """How deep the scene is seen from one direction."""

    def __init__(self, vertices, faces, toward, size):
        axis = np.eye(3)[np.abs(toward).argmin()]
        right = np.cross(axis, toward)
        right /= np.linalg.norm(right)
        self.frame = np.stack([right, np.cross(toward, right), toward], 1)  # [3, 3]
        turned = vertices @ self.frame
        low, high = turned[:, :2].min(0) - 5, turned[:, :2].max(0) + 5
        self.low, self.scale = low, (size - 1) / (high - low).max()
        pixels = (turned[:, :2] - low) * self.scale
        seen = rasterize(pixels, FAR - turned[:, 2], faces, (size, size))
        self.height = np.where(seen.face >= 0, FAR - seen.depth, -FAR).astype(np.float32)

    def lit(self, points, bias, soft):
        """How much [N] of the direction reaches points [N, 3]; bias and softness in mm."""
        out = np.zeros(len(points), np.float32)
        points = np.ascontiguousarray(points, np.float32)
        frame, low = self.frame.astype(np.float32), self.low.astype(np.float32)
        _lit(points, frame, low, np.float32(self.scale), self.height, bias, soft, out)
        return out


@numba.njit(cache=True, nogil=True, fastmath=True)
def _lit(points, frame, low, scale, height, bias, soft, out):
    rows, columns = height.shape
    for i in range(points.shape[0]):
        px, py, pz = points[i, 0], points[i, 1], points[i, 2]
        x = (px * frame[0, 0] + py * frame[1, 0] + pz * frame[2, 0] - low[0]) * scale - np.float32(
            0.5
        )
        y = (px * frame[0, 1] + py * frame[1, 1] + pz * frame[2, 1] - low[1]) * scale - np.float32(
            0.5
        )
        z = px * frame[0, 2] + py * frame[1, 2] + pz * frame[2, 2] + np.float32(bias)
        x = min(max(x, np.float32(0)), np.float32(columns - 1.001))
        y = min(max(y, np.float32(0)), np.float32(rows - 1.001))
        ix, iy = int(x), int(y)
        fx, fy = x - ix, y - iy
        top = height[iy, ix] * (1 - fx) + height[iy, ix + 1] * fx
        bottom = height[iy + 1, ix] * (1 - fx) + height[iy + 1, ix + 1] * fx
        above = (top * (1 - fy) + bottom * fy - z) / np.float32(soft)
        out[i] = 1 - min(max(above, np.float32(0)), np.float32(1))


@numba.njit(cache=True, nogil=True, fastmath=True)
def _evaluate(normals, light, out):
    for i in range(normals.shape[0]):
        x, y, z = normals[i, 0], normals[i, 1], normals[i, 2]
        for c in range(3):
            out[i, c] = (
                harmonics.C0 * light[0, c]
                + harmonics.C1 * (y * light[1, c] + z * light[2, c] + x * light[3, c])
                + harmonics.C2 * (x * y * light[4, c] + y * z * light[5, c] + x * z * light[7, c])
                + harmonics.C20 * (3 * z * z - 1) * light[6, c]
                + harmonics.C22 * (x * x - y * y) * light[8, c]
            )


def shine_on(normals, light):
    """`harmonics.irradiance` for many normals [N, 3], not below 0: [N, 3] float32."""
    out = np.zeros((len(normals), 3), np.float32)
    _evaluate(np.ascontiguousarray(normals, np.float32), np.asarray(light, np.float32), out)
    return np.maximum(out, 0)


def transfer(vertices, normals, faces, count=64, size=192, bias=2.0):
    """Shadowed light transfer [V, 9] of vertices, such that transfer @ radiance is what albedo 1 shows.

    References:
        Sloan, Kautz and Snyder, "Precomputed radiance transfer", SIGGRAPH 2002.
    """
    out = np.zeros((len(vertices), 9))
    points = (vertices + normals * 0.8).astype(np.float32)
    open_sky = np.zeros(len(vertices))
    for toward in sphere_directions(count):
        facing = np.clip(normals @ toward, 0, None)
        lit = ShadowMap(vertices, faces, toward, size).lit(points, bias, 4.0) * facing
        out += np.outer(lit, harmonics.basis(toward))
        open_sky += lit
    scale = 4 / count  # 4 pi / count directions, over pi
    return out * scale, open_sky * scale
