"""What tone hidden skin most likely has: a basis of people's tones, fitted to what a photo shows.

The low-frequency albedo of Saito 2017, section 3, taken from the skin that is seen instead of from the
photo: lips below a hand and brows below a fringe come from the people that the basis was learned of.
The basis is of logarithms, so that exposure and white balance, which are free, only add to it.
"""

import cv2
import numpy as np

from bakery.geometry.fill import sparse_blur
from bakery.geometry.sample import bilinear
from bakery.heads.base import HeadModel
from bakery.landmarks import OVAL
from bakery.stages.atlas import Atlas, make_atlas, uv_polygon
from bakery.stages.fit.albedo import load_albedo, texel_chart
from bakery.stages.texture.correlations import DARKEST
from bakery.stages.texture.database import SkinDatabase

FITTED = 256  # texels on a side, at which amounts are found
# The basis counts within the face's contour and fades into one plain tone towards it: beyond, and before
# the ears, people's hair and grazing light are in it. Scale of the contour, of its width alone, and blur
# over the atlas's side.
WITHIN, NARROW, FADE = 0.92, 0.58, 1 / 35
# What the modes leave of a texel, as a standard deviation of the logarithm, times the square root of the
# texels that err alike (about 300 of FITTED).
NOISE = 5.0
MOST = 2.5  # standard deviations of a mode
UNSEEN = 0.3  # linear level of a skin of which nothing is seen


def likely_tone(
    albedo: np.ndarray,
    weight: np.ndarray,
    head: HeadModel,
    atlas: Atlas,
    database: SkinDatabase,
) -> np.ndarray:
    """The most likely tone of a whole skin, given a part of it.

    Args:
        albedo: [T, T, 3] linear; weight: [T, T] 0..1, how surely it is seen.
        atlas: of T texels on a side, of the head's skin.

    Returns:
        [T, T, 3] float32 linear; beyond the chart one plain tone.
    """
    amounts, level = _fitted(albedo, weight, head, database)
    chart = database.tone + np.einsum("a,ayxc->yxc", amounts, database.tone_modes)
    tone, share = _on_atlas(chart[None].astype(np.float32), head, atlas)
    plain = np.median(tone[0, share > 0.5], 0)
    picture = np.tile((plain + level).astype(np.float32), (albedo.shape[0] * albedo.shape[1], 1))
    picture[atlas.index] += share[:, None] * (tone[0] - plain)
    out: np.ndarray = np.exp(picture).reshape(albedo.shape)
    return out


def _on_atlas(charts: np.ndarray, head: HeadModel, atlas: Atlas) -> tuple[np.ndarray, np.ndarray]:
    """Charts [n, S, S, 3] at the N texels of an atlas of the skin.

    Returns:
        values [n, N, 3]; how far the chart knows the place [N] 0..1.
    """
    size = atlas.size
    place = texel_chart(head, load_albedo(), atlas)
    within = uv_polygon(head, OVAL, WITHIN, size)
    across = head.landmark_uv()[OVAL, 0] * size
    middle, half = (across.max() + across.min()) / 2, np.ptp(across) / 2
    within[:, np.abs(np.arange(size) + 0.5 - middle) > NARROW * half] = 0
    share = sparse_blur(within, FADE * size).reshape(-1)[atlas.index]
    pixels = np.clip(place, 0, 1) * charts.shape[1]
    return np.stack([bilinear(chart, pixels) for chart in charts]), share


def _fitted(
    albedo: np.ndarray, weight: np.ndarray, head: HeadModel, database: SkinDatabase
) -> tuple[np.ndarray, np.ndarray]:
    """Amounts [A] of the modes, and the level [3] of the logarithm: a ridge regression."""
    charts = np.concatenate([database.tone[None], database.tone_modes])
    atlas = make_atlas(head, FITTED).take("skin")
    (mean, *modes), share = _on_atlas(charts, head, atlas)
    size, count = (FITTED, FITTED), len(modes)
    small = cv2.resize(albedo * weight[..., None], size, interpolation=cv2.INTER_AREA)
    mass = cv2.resize(weight, size, interpolation=cv2.INTER_AREA)
    seen = mass.reshape(-1)[atlas.index]
    color = small.reshape(-1, 3)[atlas.index] / np.maximum(seen, 1e-3)[:, None]
    rows = np.flatnonzero((seen > 0.5) & (share > 0.5))
    if len(rows) < 10 * count:
        return np.zeros(count), np.full(3, np.log(UNSEEN))
    left = np.log(np.maximum(color[rows], DARKEST)) - mean[rows]
    columns = np.zeros((count + 3, len(rows), 3), np.float32)
    columns[:count] = np.stack(modes)[:, rows]
    for channel in range(3):
        columns[count + channel, :, channel] = 1
    flat = columns.reshape(count + 3, -1)
    ridge = np.diag([NOISE**2] * count + [1e-6] * 3)
    found = np.linalg.solve(flat @ flat.T + ridge, flat @ left.reshape(-1))
    return np.clip(found[:count], -MOST, MOST), found[count:]
