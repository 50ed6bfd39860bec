"""Eyes, painted on round balls: iris, pupil, sclera, cornea, the shadow and wetness of the lids."""

import numpy as np

from bakery.synth.chart import IRIS, smoothstep
from bakery.synth.light import shine_on
from bakery.synth.noise import gradient_noise
from bakery.synth.subject import IRIS_COLORS

EYES = ("left", "right")


def _lid_distance(where, mask, pixel):
    """Distance [n] mm below the upper and above the lower lid of visible eye pixels.

    Args:
        where: rows [n], columns [n] of the eye's pixels.
        mask: [H, W] bool of those pixels.
        pixel: mm of one pixel.
    """
    rows, columns = where
    left, right, top, bottom = columns.min(), columns.max(), rows.min(), rows.max()
    window = mask[top : bottom + 1, left : right + 1]
    first = np.where(window.any(0), window.argmax(0), 0).astype(float)
    last = np.where(window.any(0), window.shape[0] - 1 - window[::-1].argmax(0), 0).astype(float)
    width = max(3, int(1.2 / pixel) | 1)
    kernel = np.hanning(width + 2)[1:-1]
    kernel /= kernel.sum()

    def smooth(line):
        return np.convolve(np.pad(line, width // 2, "edge"), kernel, "valid")

    upper, lower = smooth(first)[columns - left], smooth(last)[columns - left]
    return (
        np.maximum(rows - top - upper, 0) * pixel,
        np.maximum(lower - (rows - top), 0) * pixel,
        (columns - left) / max(right - left, 1),
    )


def shade_eye(
    subject, side, points, where, mask, pixel, marks, center, ball, environment, visibility
):
    """Colour [n, 3] linear of the pixels of one eyeball.

    Args:
        side: "left" or "right".
        points: [n, 3] mm camera space.
        where: rows [n], columns [n] of those pixels; mask: [H, W] bool of them.
        pixel: mm of one pixel at the eye.
        marks: [L, 3] landmarks, camera space.
        center: [3] of the ball; ball: its radius, mm.
        environment: the light.
        visibility: [n] how much of the key lamp reaches each point.
    """
    axis = marks[IRIS[side][0]] - center
    axis /= np.linalg.norm(axis)
    ring = marks[list(IRIS[side][1:])] - center
    ring /= np.linalg.norm(ring, axis=1, keepdims=True)
    iris = float(np.clip(np.sin(np.arccos(np.clip(ring @ axis, -1, 1))).mean() * ball, 5.4, 6.4))
    right = np.cross([0, 1.0, 0], axis)
    right /= np.linalg.norm(right)
    frame = np.stack([right, np.cross(axis, right), axis], 1)

    outward = points - center
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    view = -points / np.linalg.norm(points, axis=1, keepdims=True)
    local, seen = outward @ frame, view @ frame
    flat = local[:, :2] * ball
    depth = 2.6 * (1 - np.clip((flat**2).sum(1) / iris**2, 0, 1))
    flat_iris = flat - seen[:, :2] / np.maximum(seen[:, 2:], 0.3) * depth[:, None] * 0.6
    r = np.linalg.norm(flat_iris, axis=1) / iris
    edge = np.linalg.norm(flat, axis=1) / iris
    angle = np.arctan2(flat_iris[:, 1], flat_iris[:, 0])

    seed = subject.seed + (51 if side == "left" else 52)
    around = np.stack([np.cos(angle), np.sin(angle), 0.30 * r], 1)
    fibre, _ = gradient_noise(around, 0.16, seed, octaves=3, gain=0.75)
    broad, _ = gradient_noise(around, 0.55, seed + 1, octaves=2)
    inner, outer = (np.array(c) for c in IRIS_COLORS[subject.iris])
    pupil = 0.34 + 0.03 * np.sin(subject.seed)
    collar = 0.56 + 0.10 * broad + 0.05 * fibre
    mix = smoothstep(collar - 0.16, collar + 0.18, r)[:, None]
    color = inner * (1 - mix) + outer * mix
    color = color * np.exp(0.95 * fibre + 0.35 * broad)[:, None]
    color *= (1 + 0.25 * np.exp(-(((r - collar) / 0.07) ** 2)))[:, None]
    color *= (1 - 0.72 * smoothstep(0.78, 1.0, r))[:, None]
    color *= smoothstep(pupil - 0.03, pupil + 0.05, r)[:, None]
    color += 0.0015

    vein_a, _ = gradient_noise(points - center, 3.2, seed + 2, octaves=3)
    vein_b, _ = gradient_noise(points - center, 1.3, seed + 3, octaves=2)
    thread = np.exp(-((vein_a / 0.020) ** 2)) * np.clip(0.3 + vein_b, 0, 1)
    down, up, across = _lid_distance(where, mask, pixel)
    corner = np.clip(np.abs(across - 0.5) * 2, 0, 1) ** 2
    old = np.clip((subject.age - 25) / 50, 0, 1)
    sclera = np.array([0.46, 0.415, 0.39]) - old * np.array([0.03, 0.045, 0.075])
    sclera = sclera - min(subject.melanin, 2) * np.array([0.045, 0.05, 0.058])
    sclera = np.repeat(sclera[None], len(points), 0)
    red = (0.08 + 0.30 * corner + 0.12 * old)[:, None] * (0.35 + 0.65 * thread[:, None])
    sclera = sclera * (1 - red * np.array([0.12, 0.72, 0.66]))
    inner_corner = marks[362 if side == "left" else 133]
    caruncle = smoothstep(6.2, 2.6, np.linalg.norm(points - inner_corner, axis=1))[:, None]
    sclera = sclera * (1 - caruncle) + caruncle * np.array([0.47, 0.235, 0.20]) * (
        1.25 - 0.25 * min(subject.melanin, 2)
    )
    limbus = smoothstep(0.94, 1.09, edge)[:, None]
    base = color * (1 - limbus) + sclera * limbus
    base *= (1 - 0.20 * np.exp(-(((edge - 1.05) / 0.10) ** 2)))[:, None]

    shade = (0.20 + 0.80 * smoothstep(-0.5, 4.2, down)) * (0.70 + 0.30 * smoothstep(0, 1.6, up))
    shade *= 0.74 + 0.26 * smoothstep(0.0, 0.16, across) * smoothstep(1.0, 0.84, across)
    soft = outward * 0.55 + np.array([0, 0, 0.45])
    soft /= np.linalg.norm(soft, axis=1, keepdims=True)
    light = shine_on(soft, environment.irradiance_ambient())
    for k, lamp in enumerate(environment.lamps):
        facing = np.clip(soft @ lamp.direction * 0.8 + 0.2, 0, 1)
        light = light + facing[:, None] * lamp.color * (visibility[:, None] if k == 0 else 0.85)
    through = (
        1
        + 0.5
        * (1 - limbus)
        * smoothstep(-0.6, 0.8, -local @ frame.T @ environment.lamps[0].direction)[:, None]
    )
    out = base * light * shade[:, None] * through

    bulge = 4.6 * ball / 12
    normal = local * ball - np.array([0, 0, bulge])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    blend = smoothstep(0.86, 1.12, edge)[:, None]
    wobble = gradient_noise(points - center, 2.4, seed + 4, octaves=2)[1] * 0.05
    normal = normal * (1 - blend) + (local + wobble @ frame) * blend
    normal = (normal / np.linalg.norm(normal, axis=1, keepdims=True)) @ frame.T
    cosine = np.clip((normal * view).sum(1), 0.02, 1)
    fresnel = 0.026 + 0.974 * (1 - cosine) ** 5
    mirror = 2 * cosine[:, None] * normal - view
    sky = shine_on(mirror, environment.ambient)
    out += sky * (fresnel * 0.8 * shade)[:, None]
    for k, lamp in enumerate(environment.lamps):
        radius = np.radians(max(lamp.radius, 4.0))
        off = np.arccos(np.clip(mirror @ lamp.direction, -1, 1))
        soft_edge = 0.12 if lamp.radius < 20 else 0.9
        disc = smoothstep(radius * (1 + soft_edge), radius * (1 - soft_edge), off) * (
            1 - 0.35 * blend[:, 0]
        )
        glint = lamp.color / (radius * radius) * (2.0 if lamp.radius < 20 else 0.7)
        lit = (0.45 + 0.55 * visibility if k == 0 else 0.8) * smoothstep(0.0, 0.8, down)
        out += np.minimum(glint * (disc * fresnel * lit)[:, None], 1.4)
    wet = np.exp(-(((up - 0.22) / 0.20) ** 2)) * (0.35 + 0.65 * np.clip(0.5 + vein_b * 1.5, 0, 1))
    out += (wet * 0.10)[:, None] * light
    return out.astype(np.float32)
