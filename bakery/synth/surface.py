"""Shading of surfaces, pixel by pixel."""

import cv2
import numba
import numpy as np

from bakery.synth.light import shine_on

# Radii in mm of how far red, green and blue light spreads in skin (after Jensen et al. 2001).
SPREAD = np.array([1.9, 0.75, 0.45])
SPREAD_SHARE = np.array([0.72, 0.55, 0.40])


@numba.njit(cache=True, nogil=True, fastmath=True)
def _ggx(normal, view, light, roughness, reflectance, out):
    for i in range(normal.shape[0]):
        nx, ny, nz = normal[i, 0], normal[i, 1], normal[i, 2]
        vx, vy, vz = view[i, 0], view[i, 1], view[i, 2]
        nl = nx * light[0] + ny * light[1] + nz * light[2]
        if nl <= 0:
            continue
        hx, hy, hz = vx + light[0], vy + light[1], vz + light[2]
        length = np.sqrt(hx * hx + hy * hy + hz * hz) + np.float32(1e-9)
        nv = max(nx * vx + ny * vy + nz * vz, np.float32(0.05))
        nh = min(max((nx * hx + ny * hy + nz * hz) / length, np.float32(0)), np.float32(1))
        vh = (vx * hx + vy * hy + vz * hz) / length
        rough = min(max(roughness[i], np.float32(0.08)), np.float32(1))
        a2 = rough * rough * rough * rough
        bell = nh * nh * (a2 - 1) + 1
        k = (rough + 1) * (rough + 1) * np.float32(0.125)
        fresnel = reflectance[i] + (1 - reflectance[i]) * (1 - vh) ** 5
        shadowing = (nl * (1 - k) + k) * (nv * (1 - k) + k)
        out[i] = a2 / (bell * bell) * fresnel * np.float32(0.25) * nl / shadowing


def ggx(normal, view, light, roughness, reflectance):
    """Microfacet highlight times cosine and pi [N] of a light direction [3].

    References:
        Walter et al., "Microfacet models for refraction through rough surfaces", EGSR 2007.
    """
    count = len(normal)
    out = np.zeros(count, np.float32)
    single = np.float32
    _ggx(
        np.ascontiguousarray(normal, single),
        np.ascontiguousarray(view, single),
        np.asarray(light, single),
        np.broadcast_to(np.asarray(roughness, single), count),
        np.broadcast_to(np.asarray(reflectance, single), count),
        out,
    )
    return out


def bend(normal, slope):
    """Tilt unit normals [N, 3] by the gradient [N, 3] of a height field."""
    slope = slope - np.einsum("nc,nc->n", slope, normal)[:, None] * normal
    return unit(normal - slope)


def unit(vectors):
    """Vectors [N, 3] scaled to length 1; einsum is four times as fast as `linalg.norm` here."""
    return vectors / np.sqrt(np.einsum("nc,nc->n", vectors, vectors))[:, None]


def highlights(normal, view, roughness, reflectance, environment, visibility, openness):
    """Mirror-like light [N, 3] of lamps and dome; `visibility` [lamps, N]."""
    total = np.zeros((len(normal), 3), np.float32)
    for lamp, lit in zip(environment.lamps, visibility):
        rough = np.sqrt(np.clip(roughness**2 + (np.radians(lamp.radius) * 0.35) ** 2, 0, 1))
        wide = ggx(normal, view, lamp.direction, np.clip(rough * 1.25, 0, 1), reflectance)
        tight = ggx(normal, view, lamp.direction, rough * 0.72, reflectance)
        total += ((0.65 * wide + 0.35 * tight) * lit)[:, None] * lamp.color.astype(np.float32)
    cosine = np.clip(np.einsum("nc,nc->n", normal, view), 0.02, 1)
    mirror = 2 * cosine[:, None] * normal - view
    soft = unit(mirror * 0.75 + normal * 0.25)
    sky = shine_on(soft, environment.irradiance_ambient())
    grazing = reflectance + np.maximum(1 - roughness - reflectance, 0) * (1 - cosine) ** 5
    return total + sky * (grazing * openness**1.5 * 0.8)[:, None]


def diffuse(normal, smooth, environment, visibility, baked, wrap):
    """What albedo 1 shows [N, 3].

    Args:
        normal, smooth: [N, 3] with and without fine relief.
        visibility: [lamps, N].
        baked: [N, 3] shadowed light of the dome at the smooth normal.
        wrap: how far light creeps round, per channel [3]; skin scatters red furthest.
    """
    ambient = environment.irradiance_ambient()
    ratio = np.maximum(shine_on(normal, ambient), 1e-3)
    ratio /= np.maximum(shine_on(smooth, ambient), 1e-3)
    out = baked * np.clip(ratio, 0.5, 1.6)
    for lamp, lit in zip(environment.lamps, visibility):
        fine, coarse = normal @ lamp.direction, smooth @ lamp.direction
        for c in range(3):
            mixed = fine + (coarse - fine) * (0.25 + wrap[c])
            bent = np.clip((mixed + wrap[c] * 0.5) / (1 + wrap[c] * 0.5), 0, 1)
            out[:, c] += bent * lit * lamp.color[c]
    return out


def scatter(light, mask, pixel):
    """Spread light under the skin.

    Args:
        light: [H, W, 3] what albedo 1 shows, 0 outside the skin.
        mask: [H, W] float32 1 on skin.
        pixel: mm of one pixel.
    """
    out = light.copy()
    for c in range(3):
        sigma = SPREAD[c] / pixel
        if sigma < 0.4:
            continue
        blurred = cv2.GaussianBlur(light[..., c], (0, 0), sigma)
        weight = cv2.GaussianBlur(mask, (0, 0), sigma)
        spread = blurred / np.maximum(weight, 1e-3)
        out[..., c] = light[..., c] * (1 - SPREAD_SHARE[c]) + spread * SPREAD_SHARE[c] * mask
    return out
