"""Lamps, ambient light and what shades them.

An environment is a few round soft lamps and an ambient dome. The dome and the lamps' soft part reach
the skin through spherical harmonics with the head's own shadows baked at the vertices; the strongest
lamp is shadowed per pixel.
"""

from dataclasses import dataclass

import numpy as np

from bakery.geometry import harmonics
from bakery.geometry.raster import rasterize
from bakery.geometry.sample import bilinear

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
        return self.ambient * COSINE[:, None] / np.pi

    def irradiance(self):
        """Spherical harmonics [9, 3] of the irradiance / pi (what albedo 1 shows), without shadows."""
        return self.radiance() * COSINE[:, None] / np.pi


# Convolution with the clamped cosine, per coefficient (Ramamoorthi and Hanrahan 2001).
COSINE = np.array([np.pi] + [2 * np.pi / 3] * 3 + [np.pi / 4] * 5)


def direction(azimuth, elevation):
    """Unit vector of angles in degrees: azimuth to the picture's right, elevation up, 0 at the camera."""
    a, e = np.radians(azimuth), np.radians(elevation)
    return np.array([np.sin(a) * np.cos(e), np.sin(e), np.cos(a) * np.cos(e)])


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
        turned = points @ self.frame.astype(np.float32)
        above = bilinear(self.height, (turned[:, :2] - self.low) * self.scale) - turned[:, 2]
        return 1 - np.clip((above - bias) / soft, 0, 1)


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
