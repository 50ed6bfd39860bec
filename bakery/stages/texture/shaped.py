"""Grain shaped in each octave so that the completed skin has the energy it most likely has there."""

import cv2
import numpy as np

from bakery.geometry.color import LUMA
from bakery.geometry.sample import bilinear
from bakery.stages.texture.correlations import (
    DARKEST,
    OCTAVES,
    WINDOWS,
    Correlations,
    Filters,
    Windows,
)

GAIN = (0.1, 2.0)  # of a band of the person's own grain: more would show crumbs
# The likely tone is a blend of people, whose lips and creases do not quite meet: their edges are too faint.
SHARPENED = 2  # the octave from which the tone's own band is raised as well
SHARPER = 1.6  # times, at most
CLEAR = 0.25  # of the amplitude that is wanted: a band of less has no edges
BEYOND = 1.0  # gain outside the chart: the person's own grain as it is


def shaped(
    grain: np.ndarray, base: np.ndarray, wanted: Correlations, windows: Windows
) -> np.ndarray:
    """Scale the octaves of a grain, in windows.

    The base has energy of its own, at lips and brows: in the coarser octaves it is raised, and the grain
    makes up what is still missing.

    Args:
        grain: [T, T, 3] log ratio, alike everywhere; base: [T, T, 3] linear, smooth.
        wanted: what the skin most likely looks like.

    Returns:
        [T, T, 3] log ratio.
    """
    on_skin = windows.atlas.paint(np.ones(len(windows.number), np.float32))
    luma = grain @ LUMA
    filters = Filters(on_skin, len(luma))
    own = filters.levels(luma)
    smooth = filters.levels(np.log(np.maximum(base @ LUMA, DARKEST)))
    aim = wanted.energy()
    out = grain - luma[..., None] + own[-1][..., None]
    strength = np.zeros_like(luma)
    for octave in range(OCTAVES):
        band = own[octave] - own[octave + 1]
        had = max(float((band.reshape(-1)[windows.atlas.index] ** 2).mean()), 1e-10)
        edges = smooth[octave] - smooth[octave + 1]
        given = _window_means(edges**2, windows)
        if octave >= SHARPENED:
            short = np.sqrt(aim[:, octave] / np.maximum(given, 1e-10))
            raised = (wanted.known > 0) & (short < 1 / CLEAR)
            times = np.where(raised, np.clip(short, 1, SHARPER), BEYOND)
            out += (edges * on_skin * (_spread_out(times, windows) - 1))[..., None]
            given = given * times**2
        missing = np.maximum(aim[:, octave] - given, 0)
        gain = np.clip(np.sqrt(missing / had), *GAIN)
        gain = _spread_out(np.where(wanted.known > 0, gain, BEYOND), windows)
        out += (band * gain)[..., None]
        strength += gain / OCTAVES
    # Blotches of colour go with the grain's strength.
    color = grain - luma[..., None]
    return out + color * (np.minimum(strength, 1) - 1)[..., None]


def _window_means(values: np.ndarray, windows: Windows) -> np.ndarray:
    """Mean [W] of a picture [T, T] over each window."""
    inside = windows.number >= 0
    number, of = windows.number[inside], values.reshape(-1)[windows.atlas.index[inside]]
    total = np.bincount(number, weights=of, minlength=WINDOWS**2)
    return total / np.maximum(windows.size, 1)


def _spread_out(values: np.ndarray, windows: Windows) -> np.ndarray:
    """A value a window [W] as a smooth picture [T, T], BEYOND outside the chart."""
    grid = values.reshape(WINDOWS, WINDOWS, 1).astype(np.float32)
    padded = cv2.copyMakeBorder(grid, 2, 2, 2, 2, cv2.BORDER_CONSTANT, value=BEYOND)
    place = np.clip(windows.place + 2, 0, WINDOWS + 4).astype(np.float32)
    at_texels = bilinear(padded.reshape(WINDOWS + 4, WINDOWS + 4, 1), place)[:, 0]
    return windows.atlas.paint(at_texels)
