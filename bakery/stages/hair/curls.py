"""What curls look like: the photo's own, spread over hair that it does not show."""

import cv2
import numpy as np

from bakery.geometry.color import LUMA
from bakery.geometry.fill import normalized_blur, smoothstep
from bakery.geometry.sample import bilinear
from bakery.stages.hair.portrait import Portrait

WIDE = 8.0  # mm over which straight hair runs one way
# Coherence of directions over WIDE from which hair is straight, and below which it is all curls; by
# looking at 40 of 142 portraits of congress/train in the order of it.
STRAIGHT, CURLY = 0.5, 0.3
# mm: finer changes of brightness tell directions, and over what their strength is taken. Where hair is even
# and dark, there is the noise of the photo alone, which runs no way.
CONTRAST = 3.0, 4.0
FLAT = 1e-9  # variance that hair of one colour counts with
DETAIL = 7.0  # mm: wider changes of brightness are light and shadow
INNER = 3.0  # mm from the outline of hair: nearer, it is mixed with what is behind
# mm of the pieces that are put together; small ones where large ones are too few
PATCHES = 12.0, 8.0
OVERLAP = 1 / 3  # of a piece
TILE = 120.0  # mm after which the pattern repeats
TRIED = 40  # pieces of the photo for each place: with many more the same ones come again and again
PIECES = 2000  # to choose from
FEWEST = 1.0  # of a piece's area: places of pieces that the photo must show, or they repeat
MOST = 0.35  # standard deviation of log brightness; more of it is gloss or noise in black hair
SHARP = 6.0  # power of the normal that parts the three directions in which the pattern is laid on


def curliness(portrait: Portrait, angle: np.ndarray, sure: np.ndarray) -> float:
    """How far the photo's hair is made of curls: 0 runs one way, 1 runs no way.

    Args:
        angle, sure: [H, W], see bakery.stages.hair.directions.photographed.
    """
    inner = _inner(portrait).astype(np.float32)
    if not inner.any():
        return 0.0
    double = np.stack([np.cos(2 * angle), np.sin(2 * angle)], -1) * (sure * inner)[..., None]
    blurred = cv2.GaussianBlur(double, (0, 0), WIDE * portrait.scale)
    mass = cv2.GaussianBlur(inner, (0, 0), WIDE * portrait.scale)
    coherence = np.hypot(blurred[..., 0], blurred[..., 1]) / np.maximum(mass, 1e-3)
    light = detail(portrait, inner, CONTRAST[0])
    variance = normalized_blur(light**2, inner, CONTRAST[1] * portrait.scale)[inner > 0]
    median = np.quantile(coherence[inner > 0], 0.5, weights=variance + FLAT, method="inverted_cdf")
    return float(smoothstep(STRAIGHT, CURLY, median))


def detail(portrait: Portrait, hair: np.ndarray, mm: float) -> np.ndarray:
    """Log brightness [H, W] of hair [H, W] 0..1, without what changes over more than so many mm."""
    gray = np.log(np.maximum(portrait.color @ LUMA.astype(np.float32), 2e-3)).astype(np.float32)
    fine: np.ndarray = gray - normalized_blur(gray, hair, mm * portrait.scale)
    return fine


def _inner(portrait: Portrait) -> np.ndarray:
    size = 2 * max(round(INNER * portrait.scale), 1) + 1
    return cv2.erode((portrait.hair > 0.95).astype(np.uint8), np.ones((size, size), np.uint8)) > 0


class Curls:
    """Log brightness of curls at any place, from a tile put together of the photo's pieces."""

    def __init__(self, tile: np.ndarray, scale: float, share: float = 1.0) -> None:
        """
        Args:
            tile: [N, N] float32 log brightness around 0, its borders fit together.
            scale: pixels a millimetre.
            share: 0..1, how far hair is made of them.
        """
        self.tile, self.scale, self.share = tile, scale, share

    def at(self, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """Log brightness [n] at points [n, 3] mm of a surface with normals [n, 3].

        The tile is laid on along each axis, and each direction counts by how far the surface faces it.
        """
        weight = np.abs(normals) ** SHARP
        # The square root keeps the contrast where two patterns mix.
        weight /= np.maximum(np.sqrt((weight**2).sum(-1, keepdims=True)), 1e-9)
        total = np.zeros(len(points))
        padded = np.pad(self.tile, (0, 1), "wrap")
        for axis in range(3):
            flat = np.delete(points, axis, 1) * self.scale + 37.0 * axis
            total += weight[:, axis] * bilinear(padded, flat % len(self.tile) + 0.5)
        return total


def take_curls(portrait: Portrait, share: float = 1.0, seed: int = 5) -> Curls | None:
    """The photo's curls as a tile; None where it shows too little hair.

    Args:
        share: see Curls.

    References:
        Efros and Freeman, "Image quilting for texture synthesis and transfer", SIGGRAPH 2001: pieces
        that fit what is there already, one after another; here their overlaps are faded, not cut.
    """
    scale = portrait.scale
    fine = detail(portrait, (portrait.hair > 0.95).astype(np.float32), DETAIL)
    inner = _inner(portrait)
    for patch in (round(mm * scale) for mm in PATCHES):
        rows, columns = _places(inner, patch)
        if len(rows) >= FEWEST * patch**2:
            break
    else:
        return None
    overlap = max(round(OVERLAP * patch), 1)
    rng = np.random.default_rng(seed)
    chosen = rng.choice(len(rows), min(len(rows), PIECES), replace=False)
    pieces = np.stack([fine[r : r + patch, c : c + patch]
                       for r, c in zip(rows[chosen], columns[chosen])])  # fmt: skip
    pieces = np.concatenate([pieces, pieces[:, :, ::-1]]) - pieces.mean()
    tile = quilt(pieces, overlap, max(round(TILE * scale / (patch - overlap)), 2), rng)
    # Fading has taken contrast off.
    tile *= min(float(pieces.std()), MOST) / max(float(tile.std()), 1e-6)
    return Curls(np.clip(tile, -3 * MOST, 3 * MOST), scale, share)


def _places(inner, patch):
    """Rows and columns of the top left corners of all squares of `patch` pixels within a mask."""
    whole = cv2.erode(inner.astype(np.uint8), np.ones((patch, patch), np.uint8),
                      anchor=(0, 0), borderType=cv2.BORDER_CONSTANT, borderValue=0)  # fmt: skip
    return np.nonzero(whole[: 1 - patch, : 1 - patch])


def quilt(pieces: np.ndarray, overlap: int, count: int, rng: np.random.Generator) -> np.ndarray:
    """A tile of `count` x `count` pieces whose opposite borders fit.

    Args:
        pieces: [n, P, P] to choose from.
        overlap: pixels that neighbours share, less than P.

    Returns:
        [N, N] float32, N = count (P - overlap).
    """
    size = pieces.shape[1]
    step = size - overlap
    side = count * step
    tile = np.zeros((side, side), np.float32)
    filled = np.zeros((side, side), np.float32)
    ramp = np.minimum((np.arange(size) + 1) / (overlap + 1), 1.0)
    ramp = np.minimum(ramp, ramp[::-1]).astype(np.float32)
    fade = np.minimum(ramp[:, None], ramp)
    for row in range(count):
        for column in range(count):
            window = np.ix_((row * step + np.arange(size)) % side,
                            (column * step + np.arange(size)) % side)  # fmt: skip
            there, known = tile[window], filled[window]
            tried = pieces[rng.integers(0, len(pieces), TRIED)]
            best = tried[(((tried - there) ** 2) * (known > 0)).sum((1, 2)).argmin()]
            share = np.where(known > 0, fade, 1.0)
            tile[window] = there + share * (best - there)
            filled[window] = 1
    return tile
