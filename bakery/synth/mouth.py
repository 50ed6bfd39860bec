"""What shows between the lips: teeth, gums, tongue and the dark behind them."""

import cv2
import numpy as np

from bakery.synth.chart import smoothstep
from bakery.synth.light import shine_on
from bakery.synth.surface import highlights

# Part -> linear reflectance, share of the light that reaches it, roughness.
PARTS_INSIDE = {
    "mouth_cavity": ((0.24, 0.075, 0.065), 0.45, 0.40),
    "teeth_upper": ((0.72, 0.675, 0.585), 1.0, 0.24),
    "teeth_lower": ((0.69, 0.64, 0.55), 0.9, 0.24),
    "gums_upper": ((0.48, 0.20, 0.18), 0.8, 0.28),
    "gums_lower": ((0.48, 0.20, 0.18), 0.7, 0.28),
    "tongue": ((0.43, 0.165, 0.15), 0.8, 0.34),
    "eye_socket": ((0.45, 0.24, 0.20), 0.8, 0.35),
}
DEPTH = 20.0  # mm behind the lips in which light falls to about a quarter


def opening(kinds, numbers, pixel):
    """How far inside the mouth's outline each pixel lies [H, W] 0..1: dim under the lips' edge."""
    mask = np.isin(kinds, numbers).astype(np.float32)
    if not mask.any():
        return mask
    return cv2.GaussianBlur(mask, (0, 0), max(1.3 / pixel, 0.5))


def shade_inside(
    name, points, normal, view, lips, inside, visibility, environment, reflectance=None, reach=None
):
    """Colour [n, 3] linear of one part.

    Args:
        name: key of PARTS_INSIDE.
        points: [n, 3] mm camera space; normal, view: [n, 3] unit.
        lips: z of the lips in camera space, mm.
        inside: [n] from `opening`.
        visibility: [lamps, n].
        environment: the light.
        reflectance: [3] or [n, 3] in place of the one in PARTS_INSIDE.
        reach: [n] share of the light that comes in between the lips, in place of a guess.
    """
    albedo, share, rough = PARTS_INSIDE[name]
    albedo = albedo if reflectance is None else reflectance
    soft = normal * 0.6 + view * 0.4
    soft /= np.linalg.norm(soft, axis=1, keepdims=True)
    warm = np.array([1.22, 1.10, 0.98])  # light has met lips and tongue before
    light = shine_on(soft, environment.irradiance_ambient())
    for lamp, lit in zip(environment.lamps, visibility):
        facing = np.clip(soft @ lamp.direction * 0.7 + 0.3, 0, 1) * (0.55 + 0.45 * lit)
        light = light + facing[:, None] * lamp.color
    if name == "eye_socket":
        reach = np.ones(len(points))
    elif reach is None:
        depth = np.clip((lips - 4 - points[:, 2]) / DEPTH, 0, 4)
        reach = np.exp(-1.4 * depth) * (0.18 + 0.82 * smoothstep(0.3, 0.95, inside))
    roughness = np.full(len(points), rough, np.float32)
    shine = highlights(normal, view, roughness, 0.04, environment, visibility, reach)
    return (np.array(albedo) * light * share * warm + 0.7 * shine) * reach[:, None]
