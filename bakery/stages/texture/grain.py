"""A person's own skin grain, continued over skin that nobody saw.

Small round pieces of what the photo shows plainly, without brows, lips, moles or folds, are laid on a
triangular grid. Three overlap everywhere; their sum keeps the variance of the original, so that the
grain does not fade where they blend.

References:
    Heitz and Neyret, "High-Performance By-Example Noise using a Histogram-Preserving Blending
    Operator", HPG 2018: grid, random pieces and the variance-preserving blend.
"""

import cv2
import numpy as np

from bakery.geometry.color import LUMA
from bakery.geometry.fill import around, normalized_blur
from bakery.geometry.sample import bicubic
from bakery.stages.atlas import Atlas
from bakery.stages.texture.correlations import DARKEST

PIECE = 9.0  # mm, radius of a piece, at most
SMALLEST = 2.5  # mm, radius below which a piece shows nothing but itself
COARSEST = 3.0  # mm, wavelength above which it is tone
PLAIN = (0.3, 1.7)  # local energy of plain skin, of the median's
PIECES = 64  # fewest places to take them from before they are made smaller
STRETCH = (0.5, 2.5)  # of texels, against those of the face, that pieces follow
SHEAR = 1.5  # the same of how far texels lean
LONGEST = 8.0  # texel, length over width, that is made up for
TAPS = np.arange(-2, 2.1, 0.5, dtype=np.float32)  # of a Gaussian, sigmas


def own_grain(
    albedo: np.ndarray, trusted: np.ndarray, vertices: np.ndarray, atlas: Atlas, seed: int = 0
) -> np.ndarray | None:
    """Grain like that of the skin that was seen.

    Args:
        albedo: [T, T, 3] linear; trusted: [T, T] 0..1, where it is seen without doubt.
        vertices: [V, 3] mm; atlas: of the skin.
        seed: of the places that pieces come from.

    Returns:
        [T, T, 3] float32 log ratio to the tone; None where too little plain skin is seen.
    """
    shape = texel_shapes(vertices, atlas)
    known = trusted > 0.9
    if not known.any():
        return None
    usual = np.median(shape[known][:, [0, 2]], 0)
    size = float(usual.mean())
    detail = fine_detail(albedo, trusted, COARSEST / size)
    energy = np.abs(detail @ LUMA) * known
    area = known.astype(np.float32)
    local = normalized_blur(energy, area, 1.5 / size)
    median = np.median(local[known])
    plain = known & (local > PLAIN[0] * median) & (local < PLAIN[1] * median)
    plain = cv2.morphologyEx(plain.astype(np.uint8), cv2.MORPH_CLOSE, np.ones((3, 3)))
    radius = PIECE / size
    while True:
        away = cv2.distanceTransform(plain, cv2.DIST_L2, 5)
        centers = np.argwhere(away > radius)[:, ::-1]
        if len(centers) >= PIECES:
            break
        radius *= 0.8
        if radius * size < SMALLEST:
            return None
    laid = _laid(detail, centers, radius / STRETCH[1], shape / usual[[0, 0, 1]], atlas, seed)
    return rounded(laid, shape)


def rounded(grain: np.ndarray, shapes: np.ndarray) -> np.ndarray:
    """Grain [T, T, 3] blurred so that it is as wide as it is long on the skin.

    Texels of `texel_shapes` are long where charts are stretched, on a neck up to eight times as long as
    wide: grain as fine as they are would be streaks there, as of fur. Linear filtering shows a texel as a
    tent, whose second moment is 1/6; what its covariance on the skin lacks to that of a disc is one
    direction of the texture, along which the grain is blurred.
    """
    out = grain.copy()
    if (shapes[..., 0] > 0).any():
        window = around(shapes[..., 0] > 0, 0)
        out[window] = _rounded(grain[window], shapes[window])
    return out


def _rounded(grain, shapes):
    wide, lean, high = np.moveaxis(shapes, 2, 0).astype(np.float32)
    # The metric J'J of the map from texels to the skin, and its eigenvalues.
    along, both, down = wide**2, wide * lean, lean**2 + high**2
    middle, half = (along + down) / 2, np.hypot((along - down) / 2, both)
    ratio = np.clip((middle + half) / np.maximum(middle - half, 1e-6), 1, LONGEST**2)
    sigma = np.where(wide > 0, np.sqrt((ratio - 1) / 6), 0).astype(np.float32)
    angle = np.arctan2(2 * both, along - down) / 2  # of the long direction
    steps = np.dstack([-np.sin(angle), np.cos(angle)]) * sigma[..., None]
    rows, columns = np.mgrid[: grain.shape[0], : grain.shape[1]].astype(np.float32) + 0.5
    places, shares = np.dstack([columns, rows]), np.exp(-(TAPS**2) / 2)
    out = np.zeros_like(grain)
    for at, share in zip(TAPS, shares / shares.sum()):
        out += share * bicubic(grain, places + at * steps)
    return out


def fine_detail(albedo: np.ndarray, weight: np.ndarray, sigma: float) -> np.ndarray:
    """log albedo [T, T, 3] less its blur of sigma texels, over what has weight [T, T]."""
    whole = np.log(np.maximum(albedo, DARKEST))
    out: np.ndarray = (whole - normalized_blur(whole, weight, sigma)) * weight[..., None]
    return out


def texel_shapes(vertices: np.ndarray, atlas: Atlas) -> np.ndarray:
    """Where a step of one texel leads on the skin [T, T, 3] mm, smooth; 0 off the charts.

    How far along u; how far along that same direction, and how far across it, a step along v leads:
    the triangular factor of the parametrization's Jacobian. Charts lean where they bend round a jaw.
    """
    points = atlas.paint(atlas.at(vertices))
    inside = atlas.paint(np.ones(len(atlas.index), np.float32))
    along_u, along_v = (np.roll(points, -1, side) - points for side in (1, 0))
    known = inside * np.roll(inside, -1, 1) * np.roll(inside, -1, 0)
    wide = np.linalg.norm(along_u, axis=2)
    lean = (along_u * along_v).sum(2) / np.maximum(wide, 1e-6)
    high = np.sqrt(np.maximum((along_v**2).sum(2) - lean**2, 0))
    return normalized_blur(np.dstack([wide, lean, high]), known, atlas.size / 128)


def _laid(
    detail: np.ndarray,
    centers: np.ndarray,
    radius: float,
    stretch: np.ndarray,
    atlas: Atlas,
    seed: int,
) -> np.ndarray:
    """Pieces of a detail [T, T, 3] around `centers` [n, 2] on the whole skin [T, T, 3].

    Args:
        radius: texels, edge of the grid's triangles.
        stretch: [T, T, 3] shapes of texels as of `texel_shapes`, of the usual.
    """
    y, x = np.divmod(atlas.index, atlas.size)
    place = np.stack([x, y], 1).astype(np.float32)
    # Skewed so that the triangles' corners are whole numbers.
    skewed = np.stack([place[:, 0] - place[:, 1] / np.sqrt(3), place[:, 1] * 2 / np.sqrt(3)], 1)
    skewed /= radius
    cell = np.floor(skewed).astype(np.int64)
    part = skewed - cell
    upper = part.sum(1) > 1
    corner = np.where(upper[:, None], 1, 0)
    shares = np.stack([1 - part.sum(1), part[:, 0], part[:, 1]], 1)
    over = np.stack([part.sum(1) - 1, 1 - part[:, 0], 1 - part[:, 1]], 1)
    shares = np.where(upper[:, None], over, shares).astype(np.float32)
    turned = np.where(upper, -1, 1)
    total = np.zeros((len(place), 3), np.float32)
    for number, step in enumerate(((0, 0), (1, 0), (0, 1))):
        node = cell + corner + turned[:, None] * np.array(step)
        flat = np.stack([node[:, 0] + node[:, 1] / 2, node[:, 1] * np.sqrt(3) / 2], 1) * radius
        key = (node[:, 0] * 73856093) ^ (node[:, 1] * 19349663) ^ (seed * 83492791 + 1)
        key = (key ^ (key >> 13)) * 1274126177
        center = centers[(key ^ (key >> 16)) % len(centers)]
        at = np.clip(np.round(flat), 0, atlas.size - 1).astype(int)
        wide, lean, high = stretch[at[:, 1], at[:, 0]].T
        wide, high = (np.where(side > 0, np.clip(side, *STRETCH), 1) for side in (wide, high))
        away = place - flat
        skew = np.clip(lean, -SHEAR, SHEAR) * away[:, 1]
        source = center + np.stack([wide * away[:, 0] + skew, high * away[:, 1]], 1) + 0.5
        total += shares[:, number : number + 1] * bicubic(detail, source.astype(np.float32))
    total /= np.sqrt((shares**2).sum(1))[:, None]
    return atlas.paint(total)
