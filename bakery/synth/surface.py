"""Shading of skin, cloth and the inside of the mouth, pixel by pixel."""

import cv2
import numpy as np

from bakery.geometry import harmonics
from bakery.geometry.sample import bilinear

# Linear reflectance of what is not skin.
PART_COLORS = {
    "mouth_cavity": (0.26, 0.085, 0.075),
    "teeth_upper": (0.66, 0.61, 0.52),
    "teeth_lower": (0.62, 0.57, 0.48),
    "gums_upper": (0.46, 0.20, 0.18),
    "gums_lower": (0.46, 0.20, 0.18),
    "tongue": (0.42, 0.165, 0.15),
    "eye_socket": (0.42, 0.22, 0.18),
}
# Radii in mm of how far red, green and blue light spreads in skin (after Jensen et al. 2001).
SPREAD = np.array([1.9, 0.75, 0.45])
SPREAD_SHARE = np.array([0.72, 0.55, 0.40])


def ggx(normal, view, light, roughness, reflectance):
    """Microfacet highlight times cosine [N] of a light direction [3].

    References:
        Walter et al., "Microfacet models for refraction through rough surfaces", EGSR 2007.
    """
    half = view + light
    half /= np.linalg.norm(half, axis=1, keepdims=True)
    nl = np.clip(normal @ light, 0, 1)
    nv = np.clip((normal * view).sum(1), 0.05, 1)
    nh = np.clip((normal * half).sum(1), 0, 1)
    vh = np.clip((view * half).sum(1), 0, 1)
    a2 = np.clip(roughness, 0.08, 1) ** 4
    spread = a2 / (np.pi * (nh * nh * (a2 - 1) + 1) ** 2)
    k = (roughness + 1) ** 2 / 8
    shadowing = 1 / ((nl * (1 - k) + k) * (nv * (1 - k) + k))
    fresnel = reflectance + (1 - reflectance) * (1 - vh) ** 5
    return spread * shadowing * fresnel * 0.25 * nl * np.pi


def bend(normal, slope):
    """Tilt unit normals [N, 3] by the gradient [N, 3] of a height field."""
    slope = slope - (slope * normal).sum(1, keepdims=True) * normal
    out = normal - slope
    return out / np.linalg.norm(out, axis=1, keepdims=True)


def highlights(normal, view, roughness, reflectance, environment, visibility, openness):
    """Mirror-like light [N, 3] of lamps and dome; `visibility` [lamps, N]."""
    total = np.zeros((len(normal), 3))
    for lamp, lit in zip(environment.lamps, visibility):
        rough = np.sqrt(np.clip(roughness**2 + (np.radians(lamp.radius) * 0.35) ** 2, 0, 1))
        wide = ggx(normal, view, lamp.direction, np.clip(rough * 1.25, 0, 1), reflectance)
        tight = ggx(normal, view, lamp.direction, rough * 0.72, reflectance)
        total += ((0.65 * wide + 0.35 * tight) * lit)[:, None] * lamp.color
    cosine = np.clip((normal * view).sum(1), 0.02, 1)
    mirror = 2 * cosine[:, None] * normal - view
    soft = mirror * 0.75 + normal * 0.25
    soft /= np.linalg.norm(soft, axis=1, keepdims=True)
    sky = np.maximum(harmonics.irradiance(soft, environment.irradiance_ambient()), 0)
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
    ratio = np.maximum(harmonics.irradiance(normal, ambient), 1e-3)
    ratio /= np.maximum(harmonics.irradiance(smooth, ambient), 1e-3)
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


def gather(picture, columns, rows):
    """Read [H, W, C] at pixel centres."""
    return bilinear(picture, np.stack([columns + 0.5, rows + 0.5], -1))
