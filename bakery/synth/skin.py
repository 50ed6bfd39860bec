"""Skin: where melanin, blood, oil and relief lie, and what colour that gives.

All of it is designed here from facts about pigments; nothing is taken from a picture of a person.
"""

from dataclasses import dataclass

import numpy as np

from bakery.landmarks import LIPS_OUTER
from bakery.synth.chart import (
    BROW_LOWER,
    BROW_UPPER,
    LID_LOWER,
    LID_UPPER,
    RADIUS,
    SIDES,
    SIGN,
    smoothstep,
)
from bakery.synth.noise import cells, gradient_noise
from bakery.synth.wrinkles import age_lines

# Absorption of melanin falls as wavelength^-3.33 and haemoglobin peaks in the green (Jacques,
# "Optical properties of biological tissues: a review", 2013), averaged over broad R, G, B bands and
# flattened, since blue light turns back before it meets the deeper pigment.
DERMIS = np.array([0.80, 0.66, 0.56], np.float32)  # what pigment-free skin reflects
MELANIN = np.array([0.56, 0.70, 0.80], np.float32)
HAEMOGLOBIN = np.array([0.075, 0.34, 0.37], np.float32)


@dataclass(frozen=True)
class SkinMaps:
    """A subject's skin on the chart."""

    pigment: np.ndarray  # [H, W, 4] melanin, haemoglobin, lips 0..1, hair shadow 0..1
    relief: np.ndarray  # [H, W, 4] height mm, its slopes along x and y, pores 0..1
    gloss: np.ndarray  # [H, W] roughness of the surface 0..1


def skin_color(melanin, haemoglobin):
    """Diffuse reflectance [N, 3] linear of amounts [N] of pigment."""
    melanin, haemoglobin = np.asarray(melanin), np.asarray(haemoglobin)
    return DERMIS * np.exp(-np.outer(melanin, MELANIN) - np.outer(haemoglobin, HAEMOGLOBIN))


def brow_mask(chart, side, edge=1.0):
    """Where a brow grows, on the chart."""
    upper, lower = chart.spot(BROW_UPPER[side]), chart.spot(BROW_LOWER[side])
    return chart.polygon(np.concatenate([upper, lower[::-1]]), edge)


def beard_mask(chart):
    """Where a beard grows, on the chart 0..1, lips left out."""
    spot = chart.spot
    nose = spot(2)[1]
    left = [
        [0, nose - 2.5],
        spot(326) + [0, -4],
        spot(410) + [7, 4],
        spot(291) + [11, -2],
        spot(352) * [0.55, 0] + [0, spot(291)[1]] + [16, 0],
        spot(361) + [-14, 2],
        spot(323) + [-6, 6],
        spot(454) + [0, 0],
        spot(454) + [12, -6],
        spot(361) + [12, -10],
        spot(397) + [12, -18],
        [38, spot(152)[1] - 26],
        [0, spot(152)[1] - 34],
    ]
    left = np.asarray(left, float)
    ring = np.concatenate([left, left[::-1] * [-1, 1]])
    mask = chart.polygon(ring, 3.0)
    lips = chart.polygon(spot(LIPS_OUTER), 0.0)
    return mask * (1 - smoothstep(0.1, 0.6, chart.blur(lips, 1.2)))


def _blood(chart, rng):
    """Haemoglobin relative to the face's mean: redder nose, cheeks, ears, chin; paler forehead."""
    spot, blob = chart.spot, chart.blob
    out = chart.blank() + 1
    out += 0.32 * blob(spot(4), (11, 10)) + 0.16 * blob(spot(4) + [0, 18], (9, 16))
    out += 0.14 * blob(spot(199), (15, 9)) - 0.16 * blob(spot(151) + [0, 8], (34, 18))
    for side in SIDES:
        s, left = SIGN[side], side == "left"
        out += 0.26 * blob(spot(280 if left else 50) + [s * -2, -4], (17, 14))
        out += 0.22 * blob(spot(278 if left else 48), (5, 6))
        lids = np.concatenate([spot(LID_UPPER[side]), spot(LID_LOWER[side])])
        out += 0.20 * blob(lids.mean(0), (17, 9)) + 0.25 * blob(lids[8] + [0, -1], (4, 4))
        ear = [s * chart.ear[:2].mean(), chart.ear[2:].mean()]
        out += 0.45 * blob(ear, (19, 26))
    x = chart.blur(rng.normal(size=out.shape).astype(np.float32), 9.0)
    return out + 0.10 * x / x.std()


def _melanin(chart, subject, rng):
    """Melanin relative to the face's mean: darker lids and under-eyes, blotches, moles."""
    spot, blob = chart.spot, chart.blob
    old = np.clip((subject.age - 25) / 50, 0, 1.1)
    out = chart.blank() + 1
    dark = 0.22 + 0.10 * min(subject.melanin, 2) + 0.25 * old
    for side in SIDES:
        s = SIGN[side]
        upper, lower = spot(LID_UPPER[side]), spot(LID_LOWER[side])
        out += dark * 0.8 * blob(lower.mean(0) + [-s * 3, -7], (13, 4.5))
        out += dark * 0.7 * blob(upper.mean(0) + [0, 4], (14, 5)) + dark * blob(upper[8], (7, 6))
    out += 0.10 * blob(spot(164), (14, 5)) + 0.12 * blob(spot(17) + [0, -5], (12, 3))
    out += 0.12 * blob(spot(152) + [0, -30], (80, 18)) + 0.06 * blob(spot(151), (30, 15))
    x = chart.blur(rng.normal(size=out.shape).astype(np.float32), 6.0)
    out += (0.035 + 0.05 * old) * x / x.std()
    out += (
        subject.melanin
        / (0.3 + subject.melanin)
        * 0.16
        * smoothstep(35, 95, np.abs(chart.grid()[0]))
    )
    for _ in range(subject.moles):
        place = [rng.uniform(-70, 70), rng.uniform(spot(152)[1] - 40, spot(10)[1])]
        size = rng.uniform(0.35, 0.95)
        out += rng.uniform(1.2, 2.6) / (0.45 + subject.melanin) * blob(place, size)
    for _ in range(int(26 * max(old - 0.5, 0))):
        place = [rng.uniform(-80, 80), rng.uniform(spot(152)[1], spot(10)[1] + 15)]
        spot_mask = smoothstep(
            0.35, 0.7, blob(place, (rng.uniform(0.8, 2.6), rng.uniform(0.8, 2.2)))
        )
        out += rng.uniform(0.15, 0.5) / (0.6 + subject.melanin) * spot_mask
    return out


def design_skin(chart, subject, scalp, smile=0.0, brow_raise=0.0, frown=0.0):
    """Paint a subject's skin maps.

    Args:
        chart: where to paint.
        subject: whose skin.
        scalp: [H, W] density of the hair on the scalp, which darkens the skin between its roots.
        smile, brow_raise, frown: 0..1, how far the expression folds the skin.
    """
    spot, blob = chart.spot, chart.blob
    lips = chart.polygon(spot(LIPS_OUTER), 0.45)
    blood, melanin = (
        _blood(chart, subject.rng("blood")),
        _melanin(chart, subject, subject.rng("melanin")),
    )
    shadow = scalp * (0.85 if subject.hair in ("bald", "thinning") else 0.96)
    beard = beard_mask(chart)
    growth = max(subject.stubble, min(subject.beard / 6, 1))
    shadow = np.maximum(shadow, beard * (0.05 * (growth > 0) + 0.26 * growth))
    for side in SIDES:
        shadow = np.maximum(
            shadow, 0.30 * subject.brow_density * chart.blur(brow_mask(chart, side), 1.6)
        )
        for ring, strength in ((LID_UPPER, 0.55), (LID_LOWER, 0.22)):
            edge = chart.blur(chart.line(spot(ring[side]) - [0, 0.3], 0.9), 0.45)
            shadow = np.maximum(shadow, strength * np.clip(edge * 1.3, 0, 1))
    pigment = np.stack([melanin, blood, lips, shadow], -1)

    height = age_lines(chart, subject.rng("wrinkles"), subject.age, smile, brow_raise, frown)
    height *= 1 - lips
    slope_y, slope_x = np.gradient(height)
    slope_x, slope_y = slope_x * chart.density, -slope_y * chart.density
    pores = 0.55 + 0.35 * blob(spot(4), (14, 16)) + 0.15 * blob(spot(151), (30, 18))
    rough = 0.50 - 0.10 * blob(spot(4) + [0, 8], (9, 24)) - 0.06 * blob(spot(151), (28, 16))
    rough -= 0.05 * blob(spot(199), (12, 10))
    for side in SIDES:
        rough += 0.14 * blob(spot(LID_LOWER[side][8]) + [0, -7], (7, 9))
    for side in SIDES:
        left = side == "left"
        pores += 0.35 * blob(spot(280 if left else 50), (18, 16))
        pores -= 0.30 * blob(spot(LID_LOWER[side]).mean(0) + [0, -5], (14, 7))
        rough -= 0.05 * blob(spot(280 if left else 50) + [0, 8], (13, 9))
    rough = rough / (0.8 + 0.2 * subject.gloss) - 0.12 * lips
    relief = np.stack([height, slope_x, slope_y, np.clip(pores * (1 - lips), 0.05, 1.2)], -1)
    return SkinMaps(pigment.astype(np.float32), relief.astype(np.float32), rough.astype(np.float32))


def shade_inputs(chart, maps, subject, points, hair_color):
    """What the renderer needs to know of skin points.

    Args:
        points: [N, 3] mm on the mean head.
        hair_color: [3] linear, tints skin between roots.

    Returns:
        albedo [N, 3] linear, roughness [N], slope [N, 3] gradient of the fine relief in head space,
        cavity [N] 0..1, lips [N] 0..1.
    """
    flat = chart.pixels(chart.flat(points))
    from bakery.geometry.sample import bilinear

    pigment, relief = bilinear(maps.pigment, flat), bilinear(maps.relief, flat)
    rough = bilinear(maps.gloss, flat)
    lips = pigment[:, 2]

    mottle, _ = gradient_noise(points, 7.0, subject.seed + 1, octaves=4, gain=0.62)
    grain, _ = gradient_noise(points, 1.6, subject.seed + 2, octaves=2, gain=0.7)
    old = np.clip((subject.age - 20) / 55, 0, 1.1)
    blood = pigment[:, 1] * (1 + (0.20 + 0.12 * old) * mottle + 0.10 * grain)
    melanin = pigment[:, 0] * (1 + (0.07 + 0.10 * old) * mottle - 0.06 * grain)
    amount = 0.16 + subject.melanin * melanin
    if subject.freckles > 0:
        near, own = cells(points, 2.3, subject.seed + 3)
        where = chart.blob(chart.spot(4) + [0, 12], (42, 20)) + 0.35
        mask = smoothstep(0.35 + 0.75 * own, 0.1 + 0.4 * own, near) * (own > 0.45)
        amount += subject.freckles * 0.55 * mask * bilinear(where, flat)
    blood = subject.haemoglobin * blood * (0.75 + 0.25 / (0.6 + subject.melanin))
    bare = skin_color(amount, blood)
    fade = 0.2 + 0.8 / (1 + 0.7 * subject.melanin)
    ruddy = skin_color(
        amount * 0.88 + 0.10 + 0.04 * subject.melanin,
        (3.0 + 0.4 * grain + 0.4 * mottle) * (0.7 + 0.4 * subject.lip_color) * (0.25 + 0.75 * fade),
    )
    ruddy = ruddy * np.array(
        [1.0, 0.96, 1.10], np.float32
    )  # thin skin over deep blood looks cooler
    albedo = bare + (ruddy - bare) * (lips * (0.78 + 0.1 * subject.lip_color))[:, None]

    pore, pore_slope = gradient_noise(points, 1.15, subject.seed + 4, octaves=2, gain=0.75)
    bump, bump_slope = gradient_noise(points, 5.5, subject.seed + 5, octaves=2, gain=0.5)
    crease, crease_slope = gradient_noise(
        points, (1.0, 7.0, 4.0), subject.seed + 6, octaves=2, gain=0.6
    )
    strength = relief[:, 3]
    slope = pore_slope * (0.15 * (0.8 + 0.4 * old) * strength)[:, None]
    slope += bump_slope * (0.16 + 0.12 * old) * (1 - lips)[:, None]
    slope += crease_slope * (0.26 * lips)[:, None]
    x, z = points[:, 0], points[:, 2] - chart.axis
    along = RADIUS / np.maximum(x * x + z * z, 100.0)
    slope[:, 0] += relief[:, 1] * along * z
    slope[:, 2] -= relief[:, 1] * along * x
    slope[:, 1] += relief[:, 2]

    groove = np.clip(-relief[:, 0], 0, 1.2)
    cavity = np.exp(-0.55 * groove) * (1 + 0.10 * np.clip(pore * strength, -1, 0.4))
    cavity *= 1 + 0.35 * np.clip(crease, -1, 0) * lips
    shadow = np.clip(pigment[:, 3] * (1 + 0.5 * grain), 0, 1)[:, None]
    tint = np.asarray(hair_color, np.float32) * 0.8 + 0.004
    albedo = albedo * (1 - shadow) + np.minimum(tint, albedo) * shadow
    rough = rough + np.clip(pigment[:, 3], 0, 1) * (0.8 - rough)  # no shine between roots
    return (
        albedo.astype(np.float32),
        np.clip(rough + 0.06 * grain, 0.22, 0.8),
        slope,
        cavity.astype(np.float32),
        lips,
    )
