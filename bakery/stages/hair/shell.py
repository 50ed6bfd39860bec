"""The surface that hair reaches to: as far out as the photo's outline, and there only."""

from dataclasses import dataclass

import cv2
import numpy as np

from bakery.geometry import camera as cameras
from bakery.geometry.fill import smoothstep
from bakery.geometry.sample import bilinear
from bakery.heads.base import HeadModel
from bakery.heads.scalp import scalp
from bakery.landmarks import CHIN
from bakery.stages.hair import chart as charts
from bakery.stages.hair.chart import COLUMNS, DOME, ROWS, STEP, Chart
from bakery.stages.hair.portrait import NOTHING, Portrait, at

REACH = 130.0  # mm beyond the skull that hair is looked for
LEAST = 1.2  # mm that hair stands off the skin
GAP = 14.0  # mm of background after which no more hair belongs to the outline
HANG = 0.12  # mm that hanging hair falls inwards a mm
RISE = 22.0  # mm from the hairline over which hair rises to its height
TALL = 45.0  # mm: what stands out farther is a knot, which the back does not have
EAR_SEEN = 90.0  # mm2 of an ear in the photo, from which hair hangs behind it
SIDE = 60.0, 74.0  # degrees from the camera: what hangs beside the face is farther round
OFF = 18.0  # mm off the skin from which hair hangs
NEAR = (0.15, 0.6)  # cosine to the camera: hair is told badly up to it, and well from it on
HELD = 10  # rows below the chart's equator down to which both sides are alike
BIT = 0.1  # of the largest piece of hair: smaller ones are none
PLAIN = 5.0  # mm that hair stands off an unseen skull at least


@dataclass(frozen=True, eq=False)
class Shell:
    """Hair as a distance a cell; all grids [ROWS, COLUMNS]."""

    chart: Chart
    base: np.ndarray  # mm from the axis: what hair lies on
    radius: np.ndarray  # mm: what it reaches to
    there: np.ndarray  # 0..1: whether there is any
    seen: np.ndarray  # 0..1: whether the photo says so
    growth: np.ndarray  # 0..1: scalp
    below: float  # mm below the chin that it reaches

    def surface(self, cells: np.ndarray, share: float | np.ndarray) -> np.ndarray:
        """Points at a share [...] of the way from the base to the shell at cells [..., 2]."""
        base, radius = (self.chart.take(g, cells) for g in (self.base, self.radius))
        return self.chart.place(cells, base + share * (radius - base))


def make_shell(portrait: Portrait, head: HeadModel, neutral: np.ndarray) -> Shell:
    """The shell of the hair in a portrait."""
    chart = charts.make_chart(head, neutral)
    cells = charts.grid()
    growth = _growth(chart, head, neutral)
    eye = cameras.position(portrait.camera)
    base, covered = _base(chart, portrait)
    ear = cv2.dilate((chart.ears - chart.skull > 3).astype(np.uint8), np.ones((3, 3))) > 0
    ear &= (cells[..., 1] > DOME - 8) & (cells[..., 1] < DOME + 24)
    for side, under in zip((charts.azimuth() < 0, charts.azimuth() > 0), covered):
        growth = np.where(ear & side & under, 1.0, growth)  # hair over an ear is as good as scalp
    outline, hairy = _outline(chart, portrait, base, eye)
    base = _hanging(base)
    radius = _radius(base, outline, hairy, eye, chart)
    chin = float(head.landmarks(neutral)[CHIN, 1].mean())
    there = seen = np.zeros((ROWS, COLUMNS))
    # What hangs ends in the air; elsewhere, and beside the face, hair rises from the skin.
    hung = radius - chart.skull > OFF
    behind = np.cos(charts.azimuth() - _sides(chart, eye, 85.0)[2]) < 0.1
    for _ in range(2):
        there, seen = _presence(
            chart, portrait, cells, base, radius, growth, hairy, eye, covered, chin - 25
        )
        away = distance_inside(there > 0.5)
        rise = smoothstep(-2.0, RISE, away)
        rise = np.where(hung & behind, np.maximum(rise, 0.75), rise)
        lifted = _radius(base, outline, hairy, eye, chart)
        radius = base + LEAST + np.maximum(lifted - base - LEAST, 0) * charts.smooth(rise, 5.0)
    rows = np.flatnonzero((there > 0.5).any(1))
    lowest = charts.EQUATOR - (rows[-1] + 1 - DOME) * STEP if len(rows) else charts.EQUATOR
    return Shell(chart, base, radius, there, seen, growth, float(chin - lowest))


def _growth(chart: Chart, head: HeadModel, neutral: np.ndarray) -> np.ndarray:
    """Share of the scalp in each cell."""
    faces = head.faces[head.part_faces("skin")]
    share = scalp(head)[faces].mean(1)
    cells, distance = chart.cell(neutral[faces].mean(1))
    row, column = (np.clip(cells[:, k].astype(int), 0, n - 1) for k, n in ((1, ROWS), (0, COLUMNS)))
    total = np.bincount(row * COLUMNS + column, share, ROWS * COLUMNS).reshape(ROWS, COLUMNS)
    count = np.bincount(row * COLUMNS + column, None, ROWS * COLUMNS).reshape(ROWS, COLUMNS) * 1.0
    near = charts.smooth(total, 7.0) / np.maximum(charts.smooth(count, 7.0), 1e-6)
    near[: DOME // 4] = 1
    return np.where(charts.smooth(count, 7.0) > 1e-3, near, 0)


def _base(chart: Chart, portrait: Portrait) -> tuple[np.ndarray, tuple[bool, bool]]:
    """The skull, with the ear of a side whose ear is under hair, and which (right, left) ones are."""
    out = chart.skull.copy()
    wide = cv2.dilate(chart.ears.astype(np.float32), np.ones((3, 3))) + 2
    ends = chart.center + np.array([[-75.0, -20, 0], [75.0, -20, 0]])
    right, left = portrait.pixels(ends)[0][:, 0]
    seen = np.flatnonzero(portrait.ears.any(0))
    of_left = np.abs(seen - left) < np.abs(seen - right)
    area = portrait.ears.sum(0)[seen] / portrait.scale**2
    covered = area[~of_left].sum() < EAR_SEEN, area[of_left].sum() < EAR_SEEN
    for side, under in zip((charts.azimuth() < 0, charts.azimuth() > 0), covered):
        if under:
            out[:, side] = wide[:, side]
    return charts.smooth(out, 3.0), (bool(covered[0]), bool(covered[1]))


def _hanging(base: np.ndarray) -> np.ndarray:
    """What hair lies on when it hangs: below what stands out it falls freely."""
    out = base.copy()
    for row in range(DOME - 4, ROWS):
        out[row] = np.maximum(out[row], out[row - 1] - HANG * STEP)
    return out


def _sides(chart: Chart, eye: np.ndarray, radius: float) -> tuple[float, float, float]:
    """Azimuths of the outline (right, left), and of the camera."""
    toward = eye - chart.center
    around = np.arctan2(toward[0], toward[2])
    off = np.pi / 2 - np.arcsin(min(radius / np.hypot(toward[0], toward[2]), 0.5))
    return around - off, around + off, around


def _outline(chart, portrait, base, eye):
    """How far hair reaches on both sides.

    Returns:
        distances [ROWS, 2] mm (right, left; nan where no hair is), and evidence [ROWS, 2] 0..1.
    """
    sides = _sides(chart, eye, 85.0)[:2]
    rows = np.arange(ROWS) + 0.5
    far = np.full((ROWS, 2), np.nan)
    hairy = np.zeros((ROWS, 2))
    steps = np.arange(0, REACH + 60, 1.0)
    for side, around in enumerate(sides):
        cells = np.stack([np.full(ROWS, (around / (2 * np.pi) + 0.5) * COLUMNS), rows], -1)
        start = chart.take(base, cells)
        begin = np.minimum(start, 60.0) - 5
        distance = begin[:, None] + steps
        points = chart.place(np.repeat(cells[:, None], len(steps), 1), distance)
        pixels, _ = portrait.pixels(points)
        inside = portrait.inside(pixels)
        hair = (bilinear(portrait.hair, pixels) > 0.5) & inside
        other = (at(portrait.behind, pixels) & ~hair) | ~inside
        gap = np.zeros(ROWS)
        open_ = np.ones(ROWS, bool)
        amount = np.zeros(ROWS)
        for k in range(len(steps)):
            beyond = distance[:, k] > start + 3
            gap = np.where(hair[:, k], 0, gap + (other[:, k] & beyond))
            open_ &= gap < GAP
            mine = hair[:, k] & open_
            far[mine, side] = distance[mine, k]
            amount += mine & (distance[:, k] > start - 12)
        hairy[:, side] = smoothstep(2.0, 7.0, amount)
    return far, hairy


def _radius(base, outline, hairy, eye, chart):
    """Distances that agree with the outline on both sides, and go on around the head."""
    right, left, front = _sides(chart, eye, 85.0)
    turn = charts.azimuth() - front
    share = 0.5 + 0.5 * np.sin(turn)  # 1 on the left, 0 on the right
    offsets = []
    for side, around in enumerate((right, left)):
        column = np.full(ROWS, (around / (2 * np.pi) + 0.5) * COLUMNS)
        here = chart.take(base, np.stack([column, np.arange(ROWS) + 0.5], -1))
        offset = outline[:, side] - here
        known = np.isfinite(offset) & (hairy[:, side] > 0.3)
        if known.any():
            rows = np.arange(ROWS)
            offset = np.interp(rows, rows[known], offset[known])
            padded = np.pad(offset, 2, "edge")
            offset = np.convolve(np.median(np.lib.stride_tricks.sliding_window_view(padded, 5), 1),
                                 np.ones(3) / 3, "same")  # fmt: skip
        else:
            offset = np.full(ROWS, PLAIN)
        offsets.append(offset)
    right, left = offsets
    across = right[:, None] * (1 - share) + left[:, None] * share
    back = 0.5 - 0.5 * np.cos(turn)  # 1 behind
    lower = (np.arange(ROWS)[:, None] + 0.5 - DOME) * STEP  # mm below the equator
    # Behind hair lies closer than it stands out to the sides, and a knot is not repeated there.
    plain = np.clip(across, PLAIN, TALL)
    hanging = smoothstep(10, 70, lower)
    behind = plain * (0.75 - 0.45 * hanging)
    before = np.minimum(across, TALL) * (0.8 - 0.3 * hanging)
    flank = np.abs(np.sin(turn)) ** 1.5
    offset = flank * across + (1 - flank) * np.where(back > 0.5, behind, before)
    return np.maximum(charts.smooth(base + offset, 5.0), chart.skull + LEAST)


def _presence(chart, portrait, cells, base, radius, growth, hairy, eye, covered, low):
    """Whether hair is in each cell, and whether the photo says so."""
    points = chart.place(cells, radius)
    pixels, depth = portrait.pixels(points)
    inside = portrait.inside(pixels)
    turn = charts.azimuth() - _sides(chart, eye, 85.0)[2]
    outward = points - chart.center
    outward[..., 1] = np.maximum(outward[..., 1], 0)
    toward = eye - points
    cosine = (outward * toward).sum(-1) / (
        np.linalg.norm(outward, axis=-1) * np.linalg.norm(toward, axis=-1)
    )
    photo = bilinear(portrait.hair, pixels)
    before = (depth < at(portrait.depth, pixels) + 6) | (photo > 0.5)  # the fitted head may err
    seen = smoothstep(-0.02, 0.2, cosine) * inside * before
    # Of a turned head the near side tells of the far one, whose rim is thin and easily missed.
    well = smoothstep(*NEAR, cosine) * inside * before
    twin = np.clip(well[:, ::-1] - well, 0, 1) * (cells[..., 1] < DOME + HELD)
    seen = seen * (1 - twin)
    # Below an ear that is seen, hair hangs behind it.
    aside = smoothstep(SIDE[0], SIDE[1], np.abs((np.degrees(turn) + 180) % 360 - 180))
    open_ear = np.where(np.sin(turn) > 0, not covered[1], not covered[0])
    level = (cells[..., 1] > DOME + 10) & (points[..., 1] > low) & open_ear
    photo = np.where(level, photo * aside, photo)
    left_share = (0.5 + 0.5 * np.sin(turn))[None]
    towards = np.abs(2 * left_share - 1)
    row = np.arange(ROWS)
    # Above the ears the outline tells bare scalp from hair; below it, what hangs beside the neck.
    level = DOME - 2
    crown = np.where((row < level)[:, None], hairy, hairy[level - 6 : level].max(0)[None])
    of_side = np.where(left_share > 0.5, crown[:, 1:], crown[:, :1])
    scalp_ = growth * (towards * of_side + (1 - towards) * crown.max(1, keepdims=True))
    start = DOME + 14
    down = hairy.copy()
    down[start:] = np.minimum.accumulate(_closed(down[start:]), 0)
    down[:start] = 0
    side = np.where(left_share > 0.5, down[:, 1:], down[:, :1])
    curtain = towards * side + (1 - towards) * down.min(1, keepdims=True)
    curtain = curtain * (np.cos(turn) < 0.35)
    for k in range(start - 1, DOME, -1):  # what hangs is held from above
        curtain[k] = np.maximum(curtain[k], curtain[k + 1] * (np.cos(turn) < 0.1))
    hidden = np.maximum(scalp_, curtain) * (1 - twin) + photo[:, ::-1] * twin
    # What hangs behind neck and shoulders ends where background shows in its place.
    gone = np.ones(hidden.shape, bool)
    for distance in (base, radius):
        behind, _ = portrait.pixels(chart.place(cells, distance))
        through = portrait.inside(behind) & at(portrait.behind, behind)
        gone &= through & portrait_clear(portrait, behind)
        gone &= bilinear(portrait.hair, behind) < 0.3
    gone &= twin < 0.3  # the far rim of a skull that is fitted too wide
    hidden = np.where(gone, 0, hidden)
    there = seen * photo + (1 - seen) * hidden
    # Between what the photo shows and what it does not, there is no gap.
    wide = np.pad(there.astype(np.float32), ((0, 0), (8, 8)), "wrap")
    closed = cv2.morphologyEx(wide, cv2.MORPH_CLOSE, np.ones((5, 7), np.uint8))[:, 8:-8]
    bare = (seen * (1 - photo) > 0.5) | gone
    there = np.where(bare, there, np.maximum(there, closed))
    return np.clip(charts.smooth(_held(there), 2.5), 0, 1), seen


def _held(there: np.ndarray) -> np.ndarray:
    """Presence [ROWS, COLUMNS] without bits that hang by nothing: collars, earrings."""
    round_ = np.concatenate([there, there], 1)  # what goes around the back is in one piece
    _, parts, sizes, _ = cv2.connectedComponentsWithStats((round_ > 0.5).astype(np.uint8))
    area = sizes[:, cv2.CC_STAT_AREA].astype(float)
    area[0] = 0
    small = (parts > 0) & (area[parts] < BIT * area.max())
    return np.where(small[:, :COLUMNS] & small[:, COLUMNS:], 0, there)


def portrait_clear(portrait: Portrait, pixels: np.ndarray) -> np.ndarray:
    """Whether nothing of the head is at pixels [..., 2]: the camera sees what is behind."""
    clear: np.ndarray = at(portrait.depth, pixels) >= NOTHING
    return clear


def _closed(values):
    """Evidence [n, 2] with gaps of up to four rows filled."""
    padded = np.pad(values, ((2, 2), (0, 0)), "edge")
    windows = np.lib.stride_tricks.sliding_window_view(padded, 5, axis=0)
    return windows.max(-1)


def distance_inside(mask: np.ndarray) -> np.ndarray:
    """Distance [ROWS, COLUMNS] mm within a mask of cells from its border, less than 0 outside."""
    wide = np.pad(mask, ((1, 0), (COLUMNS // 2, COLUMNS // 2)), "wrap").astype(np.uint8)
    wide[0] = wide[1].max()
    inner = cv2.distanceTransform(wide, cv2.DIST_L2, 3)
    outer = cv2.distanceTransform(1 - wide, cv2.DIST_L2, 3)
    away = (inner - outer)[1:, COLUMNS // 2 : -COLUMNS // 2]
    return np.clip(away, -1000.0, 1000.0) * STEP  # rows; none of it may be beside a mask
