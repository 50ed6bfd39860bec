"""Wisps of hair on the shell: lines that follow its flow, spread evenly."""

from dataclasses import dataclass, fields

import numpy as np

from bakery.stages.hair.chart import COLUMNS, ROWS
from bakery.stages.hair.shell import Shell, in_the_air

PACE = 3.0  # mm a step along a wisp
KNOTS = 8  # points of a wisp that are kept
TRIES = 3000  # places at which wisps are begun, of which few are taken
SHORTEST = 10.0  # mm
HEM = 8.0  # mm between wisps along the line on which hanging hair ends
HEM_WIDER = 1.6  # times the width of others that they have: they close the line
BENT = 8.0  # mm that hair goes inwards where it ends, that does not hang down there
HEM_LENGTH = 36.0, 52.0  # mm that they are long above it
TIP = 3.0, 16.0  # mm that they go on below it: it is no line then
# How far out wisps lie, from below to above; a hem's in the first two by turns.
LAYERS = 0.55, 0.8, 1.0


@dataclass(frozen=True, eq=False)
class Wisps:
    """Locks of hair, n of them, root first."""

    points: np.ndarray  # [n, KNOTS, 3] mm, on the shell
    cells: np.ndarray  # [n, KNOTS, 2] of the chart
    width: np.ndarray  # [n] mm
    length: np.ndarray  # [n] mm
    layer: np.ndarray  # [n] 0..1: how far out of the way from skull to shell
    hem: np.ndarray  # [n] bool: at the line on which hanging hair ends

    def chosen(self, index: np.ndarray) -> "Wisps":
        """Those of an index or a mask."""
        return Wisps(*(getattr(self, entry.name)[index] for entry in fields(self)))


def grow(
    shell: Shell, flow: np.ndarray, count: int, width: float, longest: float, seed: int = 3
) -> Wisps:
    """Cover the shell with wisps.

    Args:
        flow: [ROWS, COLUMNS, 3] from root to tip.
        count: how many at most.
        width: mm of a wisp.
        longest: mm.
    """
    rng = np.random.default_rng(seed)
    sides = shell.sides()
    starts = _starts(shell, sides, rng)
    if not len(starts):
        none = np.zeros((0, KNOTS, 3), np.float32)
        return Wisps(none, none[..., :2], *(np.zeros(0, np.float32),) * 3, np.zeros(0, bool))
    steps = int(longest / PACE)
    reach = rng.uniform(0.65, 1.0, len(starts)) * longest
    above = reach * rng.uniform(0.25, 0.6, len(starts))
    tips = _hem(shell, sides[0])
    starts = np.concatenate([tips, starts])
    reach = np.concatenate([rng.uniform(*HEM_LENGTH, len(tips)), reach])
    above = np.concatenate([reach[: len(tips)], above])
    hem = np.arange(len(starts)) < len(tips)
    up = _trace(shell, flow, starts, -1, steps, above, np.zeros_like(hem))
    below = np.where(hem, rng.uniform(*TIP, len(starts)), reach - up[1])
    down = _trace(shell, flow, starts, 1, steps, below, hem)
    lines = np.concatenate([up[0][:, :0:-1], down[0]], 1)
    first, last = steps - up[2], steps + down[2]
    at = first[:, None] + (last - first)[:, None] * np.linspace(0, 1, KNOTS)
    index = np.floor(at).astype(int)
    part = (at - index)[..., None]
    row = np.arange(len(lines))[:, None]
    points = lines[row, index] * (1 - part) + lines[row, np.minimum(index + 1, 2 * steps)] * part
    length = up[1] + down[1]
    chosen, layer = _spread(shell, sides[0], points, length, width, count, len(tips))
    points = points[chosen]
    cells, _ = shell.chart.cell(points)
    wide = width * rng.uniform(0.8, 1.25, len(chosen))
    wide[hem[chosen]] *= HEM_WIDER
    return Wisps(
        points.astype(np.float32), cells.astype(np.float32), wide.astype(np.float32),
        length[chosen].astype(np.float32), layer.astype(np.float32), hem[chosen],
    )  # fmt: skip


def _starts(shell, sides, rng):
    """Places [n, 3] drawn evenly by area from where hair is; `sides` of its cells."""
    area = np.maximum(shell.there - 0.5, 0) * sides[0] * sides[1]
    if area.sum() < 1:
        return np.zeros((0, 3))
    pick = rng.choice(area.size, TRIES, p=(area / area.sum()).ravel())
    row, column = np.divmod(pick, COLUMNS)
    cells = np.stack([column + rng.random(TRIES), row + rng.random(TRIES)], -1)
    return shell.surface(cells, 1.0)


def _hem(shell, mm):
    """Places [n, 3] along the line on which hanging hair ends, close enough to leave no gap between.

    Args:
        mm: [ROWS, COLUMNS], how wide cells are.
    """
    hung = shell.there * in_the_air(shell)
    found, place = [], 0.0
    for column in range(COLUMNS):
        rows = np.flatnonzero(hung[:, column] > 0.5)
        if not len(rows):
            place = 0.0
            continue
        last = rows[-1]
        # Hair that goes behind the ear ends in no line across.
        ends = (
            shell.radius[max(last - 1, 0), column] - shell.radius[min(last + 1, ROWS - 1), column]
        )
        if ends > BENT:
            continue
        wide = mm[last, column]
        while place < wide:
            found.append([column + place / wide, last + 0.9])
            place += HEM
        place -= wide
    if not found:
        return np.zeros((0, 3))
    return shell.surface(np.array(found), 1.0)


def _trace(shell, flow, starts, sign, steps, reach, over):
    """Follow the flow from `starts`: lines [n, steps + 1, 3], lengths mm and steps [n].

    Args:
        over: [n] bool, those that go on where no hair is.
    """
    point, alive = starts.copy(), np.ones(len(starts), bool)
    out, taken, length = [point], np.zeros(len(starts), int), np.zeros(len(starts))
    for _ in range(steps):
        cells, _ = shell.chart.cell(point)
        heading = shell.chart.take(flow, cells)
        heading /= np.maximum(np.linalg.norm(heading, axis=-1, keepdims=True), 1e-6)
        ahead, _ = shell.chart.cell(point + sign * PACE * heading)
        ahead[:, 1] = np.clip(ahead[:, 1], 0, ROWS)
        here = shell.chart.take(shell.there, ahead)
        there = shell.surface(ahead, 1.0)
        far = length + np.linalg.norm(there - point, axis=-1)
        alive = alive & ((here > 0.45) | over) & (far <= reach)
        point = np.where(alive[:, None], there, point)
        length = np.where(alive, far, length)
        taken += alive
        out.append(point)
    return np.stack(out, 1), length, taken


def _spread(shell, mm, points, length, width, count, first):
    """Which wisps to take so that all is covered evenly: indices, and the layer of each.

    The `first` are taken anyhow; `mm` as in `_hem`.
    """
    fine = np.linspace(0, 1, 24) * (KNOTS - 1)
    index = np.minimum(fine.astype(int), KNOTS - 2)
    part = (fine - index)[None, :, None]
    dense = points[:, index] * (1 - part) + points[:, index + 1] * part
    cells, _ = shell.chart.cell(dense)
    column = cells[..., 0].astype(int) % COLUMNS
    row = np.clip(cells[..., 1].astype(int), 0, ROWS - 1)
    # Narrow columns near the pole are covered by more of them, wide ones by less than one.
    mm = np.maximum(mm, 0.5)
    cover = np.zeros((ROWS, COLUMNS))
    chosen, layer = [], []
    for depth in range(3):
        longest = first + np.argsort(-length[first:], kind="stable")
        for n in np.r_[:first, longest] if depth == 0 else range(first, len(points)):
            if length[n] < SHORTEST or len(chosen) >= count + first:
                continue
            if n >= first and cover[row[n], column[n]].mean() > depth + 0.45:
                continue
            chosen.append(n)
            layer.append(LAYERS[n % 2 if n < first else depth])
            for r, c in zip(row[n], column[n]):
                reach = int(np.clip(width / 2 / mm[r, c], 0, COLUMNS // 2 - 1))
                span = np.arange(c - reach, c + reach + 1) % COLUMNS
                cover[r, span] = np.maximum(cover[r, span], depth + 1)
                for beside in (max(r - 1, 0), min(r + 1, ROWS - 1)):
                    cover[beside, span] = np.maximum(cover[beside, span], depth + 0.6)
    return np.array(chosen, int), np.array(layer)
