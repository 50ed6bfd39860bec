"""What the subject wears: a shell around neck and shoulders that hides where the head model ends."""

from dataclasses import dataclass

import cv2
import numpy as np

from bakery.geometry.sample import bilinear
from bakery.synth.chart import smoothstep
from bakery.synth.noise import gradient_noise

AROUND = 160  # columns of the shell
DOWN = 72  # its rows
OPEN = ("suit", "jacket")  # clothes with an opening in front that shows a shirt
OPENING = (62.0, 190.0)  # mm: half its width at the neck, its depth
LAPEL = 40.0  # mm


@dataclass(frozen=True)
class Body:
    """Neck and clothes as a column of varying radius, over which long hair falls."""

    center: float  # z of its axis, mm
    low: float  # y of row 0, mm
    step: float  # mm from row to row, upward
    radius: np.ndarray  # [rows, AROUND] mm

    def height(self, points):
        """How far points [..., 3] lie above it, mm, and the outward direction [..., 3]."""
        x, z = points[..., 0], points[..., 2] - self.center
        away = np.hypot(x, z) + 1e-6
        column = np.arctan2(x, z) / (2 * np.pi) * AROUND + AROUND / 2 + 0.5
        row = (points[..., 1] - self.low) / self.step + 0.5
        wide = np.pad(self.radius, ((0, 0), (1, 1)), "wrap")
        at = np.stack([column + 1, row], -1)
        here, above = bilinear(wide, at), bilinear(wide, at + [0, 1.0])
        slope = (here - above) / self.step  # of the surface outward, going down
        norm = np.sqrt(1 + slope**2)
        out = np.stack([x / away, slope, z / away], -1) / norm[..., None]
        height = np.where(row > len(self.radius) - 1, 99.0, (away - here) / norm)
        return height, out


@dataclass(frozen=True)
class Garment:
    """Clothes in head space."""

    vertices: np.ndarray  # [n, 3] mm
    faces: np.ndarray  # [m, 3]
    band: np.ndarray  # [n] 1 on collar and hem, else 0
    covered: np.ndarray  # [F] bool: faces of the head that lie under the clothes
    body: Body  # what hair falls over
    throat: float  # y of the neck line in front, mm


def _profile(skin, center):
    """Radius [rows, AROUND] of the neck's skin by level and angle, and the levels [rows] mm."""
    levels = np.arange(skin[:, 1].min(), skin[:, 1].min() + 110, 4.0)
    angle = np.arctan2(skin[:, 0], skin[:, 2] - center)
    radius = np.hypot(skin[:, 0], skin[:, 2] - center)
    column = np.round((angle / (2 * np.pi) + 0.5) * AROUND).astype(int) % AROUND
    out = np.zeros((len(levels), AROUND))
    columns = np.arange(AROUND)
    for row, y in reversed(list(enumerate(levels))):
        near = np.abs(skin[:, 1] - y) < 5
        np.maximum.at(out[row], column[near], radius[near])
        known = np.flatnonzero(out[row])
        above = out[min(row + 1, len(levels) - 1)]
        if len(known) < 8:
            out[row] = above
            continue
        gap = np.abs((columns[:, None] - known[None] + AROUND // 2) % AROUND - AROUND // 2).min(1)
        filled = np.interp(columns, known, out[row, known], period=AROUND)
        out[row] = np.where(gap <= 5, np.maximum(filled, 0), above)
    return out, levels


def _smooth(radius, sigma):
    """Blur radii [rows, AROUND] along both directions."""
    pad = 12
    wide = np.pad(radius, ((0, 0), (pad, pad)), "wrap")
    return cv2.GaussianBlur(wide, (0, 0), 2.0, None, sigma, borderType=cv2.BORDER_REPLICATE)[
        :, pad:-pad
    ]


def make_garment(head, subject, neutral):
    """Cut clothes to a neutral shape [V, 3] mm."""
    rng = subject.rng("clothes")
    skin = neutral[head.part_vertices("skin")]
    bottom = skin[:, 1].min()
    chin = head.landmarks(neutral)[152]
    slabs = [skin[np.abs(skin[:, 1] - y) < 4] for y in np.arange(chin[1] - 36, chin[1] - 4, 4)]
    filled = [slab for slab in slabs if len(slab) > 8]
    throat = filled[0]  # the lowest, clear of the jaw
    center = float((throat[:, 2].min() + throat[:, 2].max()) / 2)
    neck = min(filled, key=lambda slab: np.abs(slab[:, 0]).max())
    low = skin[skin[:, 1] < chin[1] - 6]
    profile, levels = _profile(low, center)
    profile = profile.astype(np.float32)
    half = float(np.abs(neck[:, 0]).max())

    angle = (np.arange(AROUND) / AROUND - 0.5) * 2 * np.pi
    front = np.cos(angle)
    high, rise, side = {
        "crew": (30.0, 46.0, 12.0), "collar": (34.0, 42.0, 12.0), "turtleneck": (56.0, 40.0, 0.0),
        "suit": (42.0, 42.0, 12.0), "jacket": (14.0, 64.0, 16.0),
    }[subject.clothes]  # fmt: skip
    line = bottom + high + rise * (1 - front) / 2 + side * np.sin(angle) ** 2
    if subject.clothes == "collar":
        line = line - 24 * smoothstep(0.62, 0.12, np.abs(angle))
    width = rng.uniform(0.92, 1.05)
    rows = []
    share = np.linspace(0, 1, DOWN) ** 1.35
    start = bottom + 64
    for y in line - 330 * share[:, None]:
        d = np.clip(start - y, 0, None)
        out_x = half + 2 + 146 * width * (1 - np.exp(-d / 48))
        out_front = half * 0.80 + 6 + 66 * (1 - np.exp(-((d / 130) ** 1.3)))
        out_back = half * 0.80 + 8 + 62 * (1 - np.exp(-((d / 80) ** 1.1)))
        out_z = np.where(front > 0, out_front, out_back)
        shell = 1 / np.power(
            np.abs(np.sin(angle) / out_x) ** 2.2 + np.abs(front / out_z) ** 2.2, 1 / 2.2
        )
        row = (y - levels[0]) / (levels[1] - levels[0]) + 0.5
        tight = 4.2 + bilinear(profile, np.stack([np.arange(AROUND) + 0.5, row], -1))
        tight = np.max([np.roll(tight, k) for k in range(-3, 4)], 0)
        neck = (subject.clothes == "turtleneck") & (y > bottom + 40)
        rows.append(np.stack([y, tight, np.where(neck, tight, np.maximum(shell, tight))]))
    y, tight, loose = np.stack(rows, 1)
    loose = np.maximum(_smooth(loose, 4.5), _smooth(tight, 1.5))
    rows = np.stack([loose * np.sin(angle), y, center + loose * front], -1)
    outward = np.stack([np.sin(angle), np.zeros(AROUND), front], 1)
    band_rows = {"crew": 20.0, "turtleneck": 30.0}.get(subject.clothes, 0.0)
    below = line[None] - rows[..., 1]
    band = (
        smoothstep(band_rows + 1.0, band_rows - 1.0, below) if band_rows else np.zeros_like(below)
    )
    rows += band[..., None] * outward * (2.0 if subject.clothes == "crew" else 3.5)
    throat = float(line[AROUND // 2])
    if subject.clothes in OPEN:
        over = _beside_opening(rows, throat)
        rows += (4.0 * smoothstep(-4.0, 5.0, over))[..., None] * outward
    fold = rng.normal(size=3) * 4
    points = rows.reshape(-1, 3)
    bumps, _ = gradient_noise(points + fold, (46, 90, 46), subject.seed + 71, octaves=2)
    rows += (bumps.reshape(below.shape) * 7 * smoothstep(25, 90, below))[..., None] * outward
    body = _body(rows, y, tight, center)
    inner = rows[:1] - outward * 2.6 + [0, -1.0, 0]
    deeper = inner - [0, 14.0, 0] - outward * 7.0  # the throat recedes below the collar
    rim = rows[:1] - outward * 1.2 + [0, 1.8, 0]
    rows = np.concatenate([deeper, inner, rim, rows])
    band = np.concatenate([np.repeat(band[:1], 3, 0), band])
    vertices, faces, bands = rows.reshape(-1, 3), _grid(len(rows)), band.ravel()
    if subject.clothes in ("collar", "suit"):
        leaf, leaf_faces = _collar(rows[3:], line, angle, outward)
        faces = np.concatenate([faces, leaf_faces + len(vertices)])
        vertices = np.concatenate([vertices, leaf])
        bands = np.concatenate([bands, np.full(len(leaf), 0.5)])
    hidden = _hidden(head, neutral, angle, line, center, subject.clothes == "turtleneck")
    return Garment(
        vertices.astype(np.float32),
        faces.astype(np.int32),
        bands.astype(np.float32),
        hidden,
        body,
        throat,
    )


def _body(rows, levels, tight, center):
    """The `Body` of a shell [DOWN, AROUND, 3] and of the neck [DOWN, AROUND] mm above it.

    Args:
        levels: [DOWN, AROUND] y of the shell's rows, mm.
    """
    y = np.arange(levels.min(), levels.max() + 12, 4.0)
    radius = np.hypot(rows[..., 0], rows[..., 2] - center)
    out = [
        np.where(
            y <= levels[0, k] + 2,
            np.interp(y, levels[::-1, k], radius[::-1, k]),
            np.interp(y, levels[::-1, k], tight[::-1, k]) - 2,
        )
        for k in range(AROUND)
    ]
    return Body(center, float(y[0]), 4.0, np.stack(out, 1).astype(np.float32))


def _grid(rows, closed=True):
    """Faces of a sheet of rows x AROUND vertices."""
    r, c = np.mgrid[: rows - 1, : AROUND if closed else AROUND - 1]
    a, b = r * AROUND + c, r * AROUND + (c + 1) % AROUND
    quads = np.stack([a, a + AROUND, b + AROUND, b], -1).reshape(-1, 4)
    return np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


def _collar(rows, line, angle, outward):
    """The two leaves of a shirt collar, folded over at the neck line."""
    count = 14
    away = np.abs(angle)
    gap = smoothstep(0.06, 0.16, away)
    long = 15 + 36 * np.clip(1 - np.abs(away - 0.30) / 0.34, 0, 1)
    frontal = (0.2 + 0.8 * smoothstep(1.5, 0.7, away))[:, None]
    top = rows[0] + [0, 10.0, 0] - outward * (5.0 + 5 * smoothstep(0.5, 1.5, away))[:, None]
    out = []
    for s in np.linspace(0, 1, count):
        roll = np.sin(np.pi * min(s * 5, 1)) * 2.5
        y = top[:, 1] + roll - s * long * gap
        reach = 2.2 + (2.5 * np.sin(np.pi * min(s * 3, 0.5)) + 5.5 * s) * frontal
        level = np.clip(line - y, 0, None)
        row = np.clip(level / 330, 0, 1) ** (1 / 1.35) * (len(rows) - 1)
        k = np.clip(row.astype(int), 0, len(rows) - 2)
        w = (row - k)[:, None]
        column = np.arange(AROUND)
        body = rows[k, column] * (1 - w) + rows[k + 1, column] * w
        flat = np.stack([body[:, 0], y, body[:, 2]], 1)
        out.append(flat + outward * reach)
    sheet = np.stack(out)
    back = sheet - outward * 2.2
    faces = _grid(count)
    gone = gap < 0.02
    column = faces % AROUND
    faces = faces[~gone[column].any(1)]
    lift = sheet.reshape(-1, 3)
    under = back.reshape(-1, 3)
    return np.concatenate([lift, under]), np.concatenate([faces, faces[:, ::-1] + len(lift)])


def _hidden(head, neutral, angle, line, center, close):
    """Faces [F] of the head that lie well below the neck line, less so where it fits closely."""
    where = np.arctan2(neutral[:, 0], neutral[:, 2] - center)
    edge = np.interp(where, angle, line, period=2 * np.pi)
    depth = 10 if close else 27 + 13 * np.clip(np.cos(where), 0, 1)
    below = neutral[:, 1] < edge - depth
    return below[head.faces].all(1)


def _beside_opening(points, throat):
    """How far [...] points [..., 3] lie beside a jacket's opening, mm; negative within."""
    x, y, z = np.abs(points[..., 0]), points[..., 1], points[..., 2]
    wide, deep = OPENING
    edge = wide * np.clip((y - throat + deep) / (deep + 25), -0.05, 1.2)
    return np.where(z > -95, (x - edge) * deep / np.hypot(wide, deep), 99.0)


def _worn_over(subject, points, band, throat, albedo):
    """Shirt, tie and lapels of a jacket laid into its albedo [N, 3]."""
    over = _beside_opening(points, throat)
    x, low = np.abs(points[:, 0]), throat - points[:, 1]
    collar = (band > 0.4) & (band < 0.6)
    shirt = smoothstep(0.5, -0.5, over) * ~collar + collar
    near = np.where(collar, 0, over)
    shade = 1 - 0.45 * np.exp(-((near / 7.0) ** 2)) * (near < 0) * ~collar
    inner = np.asarray(subject.shirt_color) * shade[:, None]
    if subject.tie_color is not None:
        half = np.interp(low, [-14, 16, 20, 190], [15.0, 9.5, 10.5, 42.0])
        knot = 1 - 0.5 * np.exp(-(((low - 18) / 2.0) ** 2))
        tie = smoothstep(0.5, -0.5, x - half) * (low > -14) * ~collar * (points[:, 2] > -60)
        ridge = 0.72 + 0.28 * np.cos(np.pi / 2 * np.clip(x / half, 0, 1)) ** 0.5
        stripe = smoothstep(-0.2, 0.2, np.sin((points[:, 0] + 0.9 * low) * 2 * np.pi / 17.0))
        color = np.asarray(subject.tie_color) * (1 + 0.9 * stripe[:, None])
        shadow = 1 - 0.4 * np.exp(-(((x - half) / 4.0) ** 2)) * (x > half) * (low > -8)
        inner = inner * np.where(collar, 1, shadow)[:, None]
        inner = inner * (1 - tie[:, None]) + color * (tie * ridge * knot)[:, None]
    wide = LAPEL * np.clip((OPENING[1] - 20 - low) / 110, 0, 1) ** 0.6
    notch = np.where(low < 32, 0.72, 1.0) * wide
    seam = np.exp(-(((over - notch) / 0.9) ** 2)) + 0.8 * np.exp(-(((low - 32) / 0.9) ** 2)) * (
        (over > 0.66 * wide) & (over < wide)
    )
    cast = np.exp(-np.clip(over - notch, 0, None) / 3.0) * (over > notch) * (wide > 1)
    edge = 0.5 * np.exp(-((over / 1.2) ** 2)) * (over > 0)
    jacket = albedo * (1 - 0.55 * np.clip(seam, 0, 1) - 0.35 * cast + edge)[:, None]
    return jacket * (1 - shirt[:, None]) + inner * shirt[:, None]


def cloth_inputs(subject, points, band, throat):
    """Albedo [N, 3] linear and slope [N, 3] of cloth at rest points [N, 3] mm.

    Args:
        band: [N] of `Garment`.
        throat: of `Garment`.
    """
    folds, fold_slope = gradient_noise(
        points, (38, 75, 38), subject.seed + 72, octaves=3, gain=0.45
    )
    knit, knit_slope = gradient_noise(
        points, (0.9, 1.5, 0.9), subject.seed + 73, octaves=2, gain=0.8
    )
    angle = np.arctan2(points[:, 0], points[:, 2] + 60)
    rib = np.cos(angle * 150) * band if subject.clothes == "crew" else 0 * angle
    albedo = subject.cloth_color * (1 + 0.10 * knit + 0.05 * folds + 0.10 * rib)[:, None]
    if subject.clothes in OPEN:
        albedo = np.clip(_worn_over(subject, points, band, throat, albedo), 0.003, 0.8)
    return albedo.astype(np.float32), fold_slope * 6.0 + knit_slope * 0.10
