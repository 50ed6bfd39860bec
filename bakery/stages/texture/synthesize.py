"""Hidden skin synthesised so that its feature correlations are those it most likely has.

Saito 2017, section 5, equation 3: L-BFGS on the picture itself, from a low-frequency albedo. Here the
start has the person's own grain, the correlations are windowed, and only the luma changes: colour
follows. What the photo shows stays as it is and counts in its windows.

Of the correlations only those of bands with themselves are matched. Derivatives and products of octaves
make pocks: blends of several people's have no picture without them (docs/log-skin.md).
"""

from dataclasses import dataclass, replace

import numpy as np

from bakery.geometry.color import LUMA
from bakery.geometry.fill import around
from bakery.geometry.lbfgs import minimize
from bakery.stages.texture.correlations import (
    DARKEST,
    DENSITY,
    KINDS,
    WINDOWS,
    Correlations,
    Filters,
    Windows,
    split_by_sign,
)

STEPS = 30  # of L-BFGS
TONE = 3.0  # weight of the low-frequency tone against the correlations
NEAR = 4.0  # weight of the change itself: without it, a few texels change much, which makes pocks
MOST = 2.0  # times the mean square of the start: beside brows, more would make crumbs of skin
FEWEST = 40  # hidden texels of a window
FLOOR = 0.1  # of a feature's usual mean square, by which windows with less of it count


@dataclass(frozen=True, eq=False)
class Grid:
    """Texels in the order of their windows, and what is wanted of W windows; f = 2 * OCTAVES."""

    number: np.ndarray  # [N] of texels
    starts: np.ndarray  # [W] where each window begins in `number`
    count: np.ndarray  # [W] texels of each
    usual: np.ndarray  # [f, W] mean squares by which features are measured
    wanted: np.ndarray  # [f, W] mean squares over the usual ones
    weight: np.ndarray  # [W], sums to 1

    def off(self, bands: np.ndarray, slopes: np.ndarray) -> float:
        """How far bands [OCTAVES, H * W] are from what is wanted; its slopes are added to `slopes`."""
        features = split_by_sign(bands[:, self.number])
        off = self.shares(features) - self.wanted
        pull = (4 * self.weight * off / (self.usual * self.count)).astype(np.float32)
        slope = np.repeat(pull, self.count, axis=1) * features
        slopes[:, self.number] += slope[0::2] - slope[1::2]
        return float((self.weight * off**2).sum())

    def shares(self, features: np.ndarray) -> np.ndarray:
        """Mean squares [f, W] of features [f, N] over the usual ones."""
        return np.add.reduceat(features**2, self.starts, axis=1) / self.count / self.usual

    def within_reach(self, bands: np.ndarray) -> "Grid":
        """The same, with no more wanted than MOST times what bands [OCTAVES, H * W] have."""
        has = self.shares(split_by_sign(bands[:, self.number]))
        return replace(self, wanted=np.minimum(self.wanted, MOST * has))


class Objective:
    """Equation 3 of a log-luma, as a function of how its hidden texels change."""

    def __init__(
        self,
        luma: np.ndarray,
        hidden: np.ndarray,
        on_skin: np.ndarray,
        size: int,
        number: np.ndarray,
        place: np.ndarray,
        wanted: Correlations,
    ) -> None:
        """Prepare it.

        Args:
            luma: [H, W] float32, the start; hidden: [H, W] 0..1, how far each texel may change.
            on_skin: [H, W] 0 or 1; size: texels on a side of the atlas that they are cut from.
            number: [N] flat number of each texel that has a window; place: [N, 2] in windows.
            wanted: what the skin most likely looks like.
        """
        self.luma, self.share = luma, hidden.reshape(-1)
        self.free = np.flatnonzero(self.share > 0)
        self.filters = Filters(on_skin, size)
        levels = self.filters.levels(luma)
        self.tone = levels[-1]
        hides = self.share[number]
        # A second grid half a window off, so that no borders of windows show.
        energies, known = wanted_of(wanted), wanted.known > 0.5
        self.grids = [
            grid.within_reach(_bands(levels).reshape(-1, luma.size))
            for shift, of in ((0, (energies, known)), (0.5, halfway(energies, known)))
            if (grid := grid_of(number, place + shift, hides, *of)) is not None
        ]
        energy = wanted.energy()[known].mean(0) if known.any() else np.ones(1)
        each = 1 / max(float(hides.sum()), 1.0)
        self.firm = (hidden > 0) * np.float32(np.sqrt(TONE * each / max(energy[-1], 1e-8)))
        self.near = NEAR * each / max(float(energy.sum()), 1e-8)

    def at(self, change: np.ndarray) -> np.ndarray:
        """The log-luma [H, W] at a change of the free texels [n]."""
        flat = self.luma.reshape(-1).copy()
        flat[self.free] += self.share[self.free] * change
        return flat.reshape(self.luma.shape)

    def __call__(self, change: np.ndarray) -> tuple[float, np.ndarray]:
        """Value and gradient [n] at a change of the free texels [n]."""
        levels = self.filters.levels(self.at(change))
        bands = _bands(levels)
        slopes = np.zeros((len(bands), self.luma.size), np.float32)
        value = sum(grid.off(bands.reshape(slopes.shape), slopes) for grid in self.grids)
        slopes = slopes.reshape(bands.shape)
        blank = np.zeros_like(slopes[:1])
        of_levels = np.concatenate([slopes, blank]) - np.concatenate([blank, slopes])
        off = (levels[-1] - self.tone) * self.firm
        of_levels[-1] += 2 * off * self.firm
        gradient = self.filters.levels_adjoint(of_levels).reshape(-1)[self.free]
        value += float((off**2).sum()) + self.near * float((change**2).sum())
        return value, gradient * self.share[self.free] + 2 * self.near * change


def _bands(levels: list[np.ndarray]) -> np.ndarray:
    return np.stack([fine - coarse for fine, coarse in zip(levels, levels[1:])])


def wanted_of(wanted: Correlations) -> np.ndarray:
    """Mean squares [f, W] of each octave's band, lighter and darker."""
    diagonal = np.diagonal(wanted.gram, axis1=1, axis2=2).T
    return diagonal[[row for row in range(len(diagonal)) if row % KINDS < 2]]


def halfway(energies: np.ndarray, known: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mean squares [f, W'] in windows that lie half a window off: means of four; known [W'] bool."""
    square = (-1, WINDOWS, WINDOWS)
    both = np.concatenate([energies * known, known[None]]).reshape(square)
    wide = np.pad(both, ((0, 0), (1, 1), (1, 1)))
    total = wide[:, :-1, :-1] + wide[:, :-1, 1:] + wide[:, 1:, :-1] + wide[:, 1:, 1:]
    mass = total[-1].reshape(-1)
    return total[:-1].reshape(len(energies), -1) / np.maximum(mass, 1), mass > 0


def grid_of(
    number: np.ndarray,
    place: np.ndarray,
    hides: np.ndarray,
    energies: np.ndarray,
    known: np.ndarray,
) -> Grid | None:
    """The windows with hidden texels; None if there are none.

    Args:
        number: [N] of texels; place: [N, 2] in windows of a square grid.
        hides: [N] 0..1: windows count by how much of them is hidden.
        energies: [f, W] wanted mean squares; known: [W] bool.
    """
    side = round(np.sqrt(len(known)))
    cell = np.clip(np.floor(place).astype(int), 0, side - 1)
    window = cell[:, 1] * side + cell[:, 0]
    hidden = np.bincount(window, weights=hides, minlength=len(known))
    used = known & (hidden >= FEWEST)
    if not used.any():
        return None
    rows = np.flatnonzero(used[window])
    order = rows[np.argsort(window[rows], kind="stable")]
    count = np.bincount(window[order], minlength=len(known))[used]
    usual = energies[:, used] + FLOOR * energies[:, known].mean(1, keepdims=True) + 1e-12
    return Grid(
        number[order],
        np.cumsum(count) - count,
        count,
        usual,
        energies[:, used] / usual,
        hidden[used] / hidden[used].sum(),
    )


def synthesized(
    albedo: np.ndarray,
    hidden: np.ndarray,
    on_skin: np.ndarray,
    wanted: Correlations,
    windows: Windows,
) -> np.ndarray:
    """Change hidden skin until its correlations are the wanted ones.

    Args:
        albedo: [T, T, 3] linear, complete; hidden: [T, T] 0..1, 0 where it must stay as it is.
        on_skin: [T, T] 0 or 1; windows: of an atlas of T texels on a side.

    Returns:
        [T, T, 3] linear.
    """
    size = windows.atlas.size
    inside = windows.number >= 0
    near = np.zeros(size * size, np.uint8)
    near[windows.atlas.index[inside]] = hidden.reshape(-1)[windows.atlas.index[inside]] > 0
    near = near.reshape(size, size)
    if not near.any():
        return albedo
    margin = int(np.ceil(2 * Filters.REACH * size / DENSITY)) + 4
    border = ((margin, margin), (margin, margin))
    rows, columns = around(np.pad(near, border), margin)
    luma, share, weight = (
        np.ascontiguousarray(np.pad(picture, border)[rows, columns], np.float32)
        for picture in (np.log(np.maximum(albedo @ LUMA, DARKEST)), hidden * near, on_skin)
    )
    y, x = np.divmod(windows.atlas.index, size)
    y, x = y + margin - rows.start, x + margin - columns.start
    inside &= (y >= 0) & (y < luma.shape[0]) & (x >= 0) & (x < luma.shape[1])
    number = (y * luma.shape[1] + x)[inside]
    objective = Objective(luma, share, weight, size, number, windows.place[inside], wanted)
    change = minimize(objective, np.zeros(len(objective.free), np.float32), STEPS)
    ratio = np.zeros((size + 2 * margin,) * 2, np.float32)
    ratio[rows, columns] = objective.at(change) - luma
    out: np.ndarray = albedo * np.exp(ratio[margin:-margin, margin:-margin])[..., None]
    return out
