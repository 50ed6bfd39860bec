"""The pictures on hair: the photo's where it shows hair, and what continues them."""

from dataclasses import dataclass

import cv2
import numpy as np

from bakery.geometry.fill import smoothstep
from bakery.stages.hair.chart import COLUMNS
from bakery.stages.hair.locks import drawn_out
from bakery.stages.hair.pattern import curl_alpha, strand_alpha, streaks
from bakery.stages.hair.portrait import at
from bakery.stages.hair.shell import Shell, in_the_air
from bakery.stages.hair.strands import KNOTS

CAP_PART = 0.3  # of the atlas's height
GUTTER = 2  # texels around each card
STRAND = 0.7  # mm, width of the strands that are made up
PAST = 7.0  # mm that tips of a hem may go past the photo's outline
CRISP = 0.3, 0.6  # of what the photo leaves of them: nothing, and all
OBSERVED, INFERRED = 1, 3
# Of the room of what the photo shows, what unseen parts of the cap get; the percentile of all lengths of a row
# or column that its own is; of their mean, the least that one gets.
UNSEEN_CAP, PERCENTILE, NARROWEST = 0.35, 90, 0.4


@dataclass(frozen=True, eq=False)
class Layout:
    """Where each card lies in the atlas: texels [n] each."""

    left: np.ndarray
    top: np.ndarray
    width: np.ndarray
    height: np.ndarray


@dataclass(frozen=True, eq=False)
class CapMap:
    """Where the cells of the chart lie on the cap's part of the atlas, 0..1 each way.

    Columns and rows are as wide as what they hold: locks that hang beside the neck stand square to the
    chart's columns, and a few of those hold what the photo shows of them.
    """

    columns: np.ndarray  # [COLUMNS + 1], where each begins
    rows: np.ndarray  # [n + 1]

    def places(self, cells: np.ndarray) -> np.ndarray:
        """Places [..., 2] of cells [..., 2]."""
        ends = (self.columns, self.rows)
        return np.stack(
            [np.interp(cells[..., k], np.arange(len(ends[k])), ends[k]) for k in (0, 1)], -1
        )

    def cells(self, places: np.ndarray) -> np.ndarray:
        """Cells [..., 2] of places [..., 2]."""
        ends = (self.columns, self.rows)
        return np.stack(
            [np.interp(places[..., k], ends[k], np.arange(len(ends[k]))) for k in (0, 1)], -1
        )


def map_cap(shell: Shell, surface: np.ndarray, inner: np.ndarray, rows: int) -> CapMap:
    """The map of a cap.

    Args:
        surface, inner: of `mesh.cap_surface`.
        rows: of the chart, that are on it.
    """
    column, row = np.meshgrid(np.arange(COLUMNS + 1.0), np.arange(rows + 1.0))
    cells = np.stack([column, row], -1)
    points = shell.chart.place(cells, shell.chart.take(surface, cells))
    seen = shell.chart.take(shell.seen * (inner > 0), cells)
    share = UNSEEN_CAP + (1 - UNSEEN_CAP) * np.clip(seen, 0, 1)
    ends = []
    for axis in (1, 0):
        apart = np.linalg.norm(np.diff(points, axis=axis), axis=-1)
        near = (np.delete(share, -1, axis) + np.delete(share, 0, axis)) / 2
        wide = np.percentile(apart * near, PERCENTILE, axis=1 - axis)
        wide = np.convolve(np.pad(wide, 1, "edge"), np.ones(3) / 3, "valid")
        wide = np.maximum(wide, NARROWEST * wide.mean())
        ends.append(np.concatenate([[0], np.cumsum(wide) / wide.sum()]))
    return CapMap(*ends)


def pack(width: np.ndarray, length: np.ndarray, size: int) -> Layout:
    """Cards of so many mm in the atlas below the cap, standing up, as large as fits."""
    top = int(CAP_PART * size)
    low, high = 0.05, 4.0
    best = None
    for _ in range(12):
        scale = (low + high) / 2
        found = _shelves(width * scale, length * scale, size, size - top)
        if found is None:
            high = scale
        else:
            low, best = scale, found
    if best is None:
        best = _shelves(width * 0.01, length * 0.01, size, size - top)
    left, above, wide, tall = best
    return Layout(left, above + top, wide, tall)


def _shelves(width, length, side, height):
    wide = np.maximum(np.ceil(width), 4).astype(int)
    tall = np.maximum(np.ceil(length), 8).astype(int)
    left, top = np.zeros(len(wide), int), np.zeros(len(wide), int)
    x = y = shelf = 0
    for n in np.argsort(-tall, kind="stable"):
        w, h = wide[n] + 2 * GUTTER, tall[n] + 2 * GUTTER
        if x + w > side:
            x, y, shelf = 0, y + shelf, 0
        if y + h > height or w > side:
            return None
        left[n], top[n] = x + GUTTER, y + GUTTER
        x, shelf = x + w, max(shelf, h)
    return left, top, wide, tall


def paint_cards(painter, layout, edges, cells, solid, wisps, texture, direction, along, source):
    """Paint all cards into the atlas.

    Args:
        edges: [n, KNOTS, 2, 3] mm; cells: [n, KNOTS, 2, 2] of the chart.
        solid: [n] 0..1: cards with no cap below them, which have fewer gaps.
        wisps: n of them, which the cards follow.
    """
    count = layout.width * layout.height
    card = np.repeat(np.arange(len(count)), count)
    first = np.cumsum(count) - count
    number = np.arange(len(card)) - np.repeat(first, count)
    y, x = np.divmod(number, layout.width[card])
    s, t = (x + 0.5) / layout.width[card], (y + 0.5) / layout.height[card]
    knot = t * (KNOTS - 1)
    k = np.minimum(knot.astype(int), KNOTS - 2)
    f = (knot - k)[:, None]

    def between(values):
        near = values[card, k] * (1 - f[..., None]) + values[card, k + 1] * f[..., None]
        return near[:, 0] * (1 - s[:, None]) + near[:, 1] * s[:, None]

    points = between(edges)
    place, _ = painter.shell.chart.cell(points)
    across = s * (layout.width[card] / layout.height[card] * wisps.length[card]) / STRAND
    streak, ragged = streaks(card, across, t)
    curl = painter.curled(points, place)
    color, shown, left = painter.color(points, place, streak, curl)
    hem = wisps.hem[card]
    alpha = strand_alpha(card, s, across, t, ragged, solid[card], wisps.length[card], hem)
    if curl is not None:
        alpha += painter.curls.share * (curl_alpha(s, t, curl) - alpha)
    there = painter.shell.chart.take(painter.shell.there, place)
    # Only backdrop cuts a hem off: what ends on clothes and skin ends in tips, not along the labels.
    pixels, _ = painter.portrait.pixels(points)
    backdrop = painter.portrait.inside(pixels) & at(painter.portrait.behind, pixels)
    left = np.where(hem & ~backdrop, 1, left)
    left = np.maximum(left, hem * painter.shell.chart.take(painter.shell.slits, place))
    left *= np.maximum(smoothstep(0.3, 0.7, there + 0.25 * (ragged - 0.5)), hem)
    full = painter.shell.chart.take(painter.full, place)
    left *= smoothstep(0.0, 0.4, full - 0.6 * ragged)
    air = painter.shell.chart.take(in_the_air(painter.shell).astype(float), wisps.cells[:, -1])
    for n in np.flatnonzero(wisps.hem | (air > 0.5)):  # what is cut off a lock takes its tip too
        own = slice(first[n], first[n] + count[n])
        lock = left[own].reshape(layout.height[n], layout.width[n])
        past = int(PAST * wisps.hem[n] / wisps.length[n] * len(lock))
        lock = np.concatenate([np.repeat(lock[:1], past, 0), lock[: len(lock) - past]])
        left[own] = np.minimum.accumulate(lock, 0).reshape(-1)
    left = np.where(hem, smoothstep(*CRISP, left), left)  # a tip that is half there is a haze
    alpha *= left
    row, column = layout.top[card] + y, layout.left[card] + x
    texture[row, column, :3] = color * alpha[:, None]
    texture[row, column, 3] = alpha
    direction[row, column] = [0, 1]
    along[row, column] = t
    source[row, column] = np.where(shown > 0.5, OBSERVED, INFERRED)


def paint_cap(painter, surface, cap_map, size, texture, direction, source):
    """Paint the cap's part of the atlas."""
    tall = int(CAP_PART * size)
    y, x = np.mgrid[:tall, :size]
    places = np.stack([(x + 0.5) / size, (y + 0.5) / tall], -1).reshape(-1, 2)
    cells = cap_map.cells(places)
    shell = painter.shell
    points = shell.chart.place(cells, shell.chart.take(surface, cells))
    step = shell.chart.step(cells, points, shell.chart.take(painter.flow, cells))
    near = cells + 0.5 * step / np.maximum(np.abs(step).max(1, keepdims=True), 1e-6)
    # Texels a cell, there: what lies ahead may be beyond the seam.
    step = step * (cap_map.places(near) - places) / np.where(near == cells, 1, near - cells)
    step = step * [size, tall]  # texels a mm
    noise = _cap_streaks(step.reshape(tall, size, 2).astype(np.float32))
    curl = painter.curled(points, cells)
    color, shown, _ = painter.color(points, cells, noise.reshape(-1), curl, skin=True)
    made = color * (0.85 + 0.15 * shown[:, None])
    texture[:tall, :, :3] = made.reshape(tall, size, 3)
    texture[:tall, :, 3] = 1
    unit = step / np.maximum(np.linalg.norm(step, axis=1, keepdims=True), 1e-6)
    direction[:tall] = unit.reshape(tall, size, 2)
    source[:tall] = np.where(shown > 0.5, OBSERVED, INFERRED).reshape(tall, size)


def _cap_streaks(step, length=16):
    """Noise [h, w] drawn out along steps [h, w, 2] texels a mm."""
    noise = np.random.default_rng(11).normal(size=step.shape[:2]).astype(np.float32)
    noise = cv2.GaussianBlur(noise, (0, 0), 0.6)
    total = drawn_out(noise, np.clip(step, -3, 3), length)
    total -= cv2.GaussianBlur(total, (0, 0), 12)
    return total / max(float(total.std()), 1e-6)
