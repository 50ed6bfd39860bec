"""Lights and darks of whole locks: noise along the flow, the same for neighbouring cards and the cap."""

import cv2
import numpy as np

from bakery.geometry.sample import bilinear
from bakery.stages.hair import chart as charts
from bakery.stages.hair.curls import detail
from bakery.stages.hair.portrait import Portrait
from bakery.stages.hair.shell import Shell

FINER = 4  # cells of the noise a cell of the chart, either way
WAVES = 48  # that the noise is the sum of
ACROSS = 7.0, 26.0  # mm, their lengths
DRAWN, PACE = 0.3, 3.0  # of a wisp's length that it is drawn out either way, and mm of a step
BAND = 1.5, 9.0  # mm: finer is wisps, wider is light and shadow
SQUARE = 0.6  # cosine to the camera from which the photo's contrast is its hair's
FEWEST = 150.0  # mm^2 of hair that tell it
USUAL = 0.2  # standard deviation of log brightness where they do not
RANGE = 0.06, 0.4  # that it is held to


def make_locks(shell: Shell, flow: np.ndarray, longest: float, seed: int = 7) -> np.ndarray:
    """Noise of mean 0 and variance 1 that hardly changes along the flow.

    Args:
        flow: [ROWS, COLUMNS, 3] from root to tip.
        longest: mm of wisps.

    Returns:
        [ROWS * FINER, COLUMNS * FINER] float32; a chart takes it at FINER times a place's cell.
    """
    cells = charts.grid(FINER)
    points = shell.surface(cells, 1.0)
    noise = _waves(points, np.random.default_rng(seed))
    step = FINER * shell.chart.step(cells, points, PACE * shell.chart.take(flow, cells))
    total = drawn_out(noise, step, round(DRAWN * longest / PACE))
    total -= total.mean()
    return total / max(float(total.std()), 1e-6)


def drawn_out(noise: np.ndarray, step: np.ndarray, count: int) -> np.ndarray:
    """Noise [h, w] summed along so many steps [h, w, 2] either way, texels (x, y); columns go around.

    References:
        Cabral and Leedom, "Imaging vector fields using line integral convolution", SIGGRAPH 1993.
    """
    wide = np.float32(noise.shape[1])
    spread, moves = (
        np.pad(p.astype(np.float32), ((0, 0), (0, 1)) + ((0, 0),) * (p.ndim - 2), "wrap")
        for p in (noise, step)
    )
    start = np.mgrid[: noise.shape[0], : noise.shape[1]].astype(np.float32)
    total = spread[:, :-1].copy()
    for sign in np.float32([1, -1]):
        y, x = start
        for _ in range(count):
            move = cv2.remap(moves, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
            x, y = (x + sign * move[..., 0]) % wide, y + sign * move[..., 1]
            total += cv2.remap(spread, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return total


def lock_contrast(portrait: Portrait, shell: Shell, cosine: np.ndarray) -> float:
    """Standard deviation of log brightness of locks in the photo.

    Args:
        cosine: [ROWS, COLUMNS] between the shell's normal and the line of sight.
    """
    hair = (portrait.hair > 0.95).astype(np.float32)
    fine, all_but_wide = (detail(portrait, hair, mm) for mm in BAND)
    pixels, _ = portrait.pixels(shell.surface(charts.grid(), 1.0))
    seen = shell.seen * (cosine > SQUARE) * portrait.inside(pixels)
    seen = seen * (bilinear(hair, pixels) > 0.5)
    # Cells count by their area in the photo, about.
    share = seen * np.maximum(cosine, 0) * np.prod(shell.sides(), 0)
    if share.sum() < FEWEST:
        return USUAL
    power = (all_but_wide - fine) ** 2 * hair
    variance = (bilinear(power, pixels) * share).sum() / share.sum()
    return float(np.clip(np.sqrt(variance), *RANGE))


def _waves(points, rng):
    """The same in all directions: a sum of plane waves in space."""
    way = rng.normal(size=(WAVES, 3))
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    length = np.exp(rng.uniform(*np.log(ACROSS), WAVES))
    phase = rng.uniform(0, 2 * np.pi, WAVES)
    turn = points.astype(np.float32) @ (way * (2 * np.pi / length)[:, None]).T.astype(np.float32)
    return np.cos(turn + phase.astype(np.float32)).sum(-1) * np.float32((2 / WAVES) ** 0.5)
