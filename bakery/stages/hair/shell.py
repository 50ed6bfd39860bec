"""The surface that hair reaches to: as far out as the photo's outline, and there only."""

from dataclasses import dataclass

import cv2
import numpy as np

from bakery.geometry import camera as cameras
from bakery.geometry.fill import smoothstep
from bakery.geometry.sample import bilinear
from bakery.heads.base import HeadModel
from bakery.landmarks import CHIN
from bakery.stages.hair import chart as charts
from bakery.stages.hair.chart import COLUMNS, DOME, ROWS, STEP, Chart
from bakery.stages.hair.portrait import Portrait, at
from bakery.stages.hair.presence import (
    EAR_ROWS,
    HANGS,
    HELD,
    alike,
    curtain_of,
    ears_under,
    growth_of,
    presence,
    seen_on,
    sides_of,
)
from bakery.stages.hair.temples import temples_of

REACH = 130.0  # mm beyond the skull that hair is looked for
LEAST = 1.2  # mm that hair stands off the skin
GAP = 14.0  # mm of background after which no more hair belongs to the outline
HANG = 0.12  # mm that hanging hair falls inwards a mm
STEEP = 1.0  # mm that hair on the skin rises a mm from the hairline at most
RISE = 14.0  # mm from the hairline over which hair rises to its height
TALL = 45.0  # mm: what stands out farther is a knot, which the back does not have
BACK = (0.4, 0.7)  # of the way behind the ears, from where on hair lies on all of the skin
EAR_SEEN = 90.0  # mm2 of an ear in the photo, from which hair hangs behind it
EAR = np.array([75.0, -20.0, 0.0])  # mm from the chart's middle: the upper half of the left ear
LOW = 25.0  # mm below that, from where on only a lobe is seen, which hair that hangs over an ear leaves
PIERCED = 4.0  # mm that an ear stands off the skull
LOBES = slice(DOME + 10, DOME + 14)  # rows of the chart beside them
OFF = 18.0  # mm off the skin from which hair hangs
# mm off the skin from which its tips are in the air: off scalp, and off skin that it does not grow on.
AIR, AIR_BARE = 12.0, 4.0
FREE = 22  # rows below the equator from which all of them are
PLAIN = 5.0  # mm that hair stands off an unseen skull at least
NAPE, SHORTER = (-5.0, 70.0), 0.8  # mm below the equator over which short hair gets so much shorter
AHEAD = 4.0  # mm that hair beside the face stands before the skin where it begins
THROUGH = (
    15.0  # degrees from the middle of the face: hair that reaches it stands as far out as it likes
)
FLANKS = (
    75.0  # degrees from the camera, from which hair beside the face is not asked where it begins
)
SLACK = 1.2  # mm of backdrop that hair may cover
WIDE = 0.35  # of its height that hair has where the skull itself is fitted too wide


@dataclass(frozen=True, eq=False)
class Shell:
    """Hair as a distance a cell; all grids [ROWS, COLUMNS]."""

    chart: Chart
    base: np.ndarray  # mm from the axis: what hair lies on
    radius: np.ndarray  # mm: what it reaches to
    there: np.ndarray  # 0..1: whether there is any
    seen: np.ndarray  # 0..1: whether the photo says so
    slits: np.ndarray  # 0..1: where there is some though the photo shows skin
    growth: np.ndarray  # 0..1: scalp
    below: float  # mm below the chin that it reaches

    def surface(self, cells: np.ndarray, share: float | np.ndarray) -> np.ndarray:
        """Points at a share [...] of the way from the base to the shell at cells [..., 2]."""
        base, radius = (self.chart.take(g, cells) for g in (self.base, self.radius))
        return self.chart.place(cells, base + share * (radius - base))

    def sides(self) -> tuple[np.ndarray, np.ndarray]:
        """How wide and how tall each cell is on the shell: [ROWS, COLUMNS] mm each.

        Where hair hangs beside the neck, the shell is nearly square to the chart: a cell is 50 mm wide.
        """
        cells = charts.grid()
        wide, tall = (
            np.linalg.norm(
                self.surface(cells + step, 1.0) - self.surface(cells - step, 1.0), axis=-1
            )
            for step in ([0.5, 0.0], [0.0, 0.5])
        )
        return wide, tall


def told(shell: Shell) -> np.ndarray:
    """How far the photo may tell where hair before skin ends: [ROWS, COLUMNS] 0..1.

    All of hair that hangs; of hair that grows there, only what is seen squarely (`presence`).
    """
    low = smoothstep(HELD - 2, HELD + 4, charts.grid()[..., 1] - DOME)
    found: np.ndarray = np.maximum(np.maximum(low, hanging(shell)), shell.seen)
    return found * (1 - shell.slits)


def hanging(shell: Shell) -> np.ndarray:
    """How surely hair stands off skin that it does not grow on: [ROWS, COLUMNS] 0..1."""
    thick = (shell.radius - shell.chart.skull) * (shell.growth < 0.3)
    found: np.ndarray = smoothstep(8, 14, thick)
    return found


def in_the_air(shell: Shell) -> np.ndarray:
    """Where hair that ends has its tips in the air, not on the skin: [ROWS, COLUMNS] bool."""
    down = charts.grid()[..., 1] - DOME
    off = np.maximum(shell.radius, shell.base) - shell.chart.skull
    free = np.where(shell.growth < 0.3, AIR_BARE, AIR)
    found: np.ndarray = ((off > free) & (down > 4)) | (down > FREE)
    return found


def make_shell(portrait: Portrait, head: HeadModel, neutral: np.ndarray) -> Shell:
    """The shell of the hair in a portrait."""
    chart = charts.make_chart(head, neutral)
    cells = charts.grid()
    growth = growth_of(chart, head, neutral)
    eye = cameras.position(portrait.camera)
    front = sides_of(chart, eye)[2]
    turn = charts.azimuth() - front
    base, covered = _base(chart, portrait, front, _beside_lobes(portrait, chart, eye))
    ear = cv2.dilate((chart.ears - chart.skull > 3).astype(np.uint8), np.ones((3, 3))) > 0
    ear &= (cells[..., 1] > DOME + EAR_ROWS[0]) & (cells[..., 1] < DOME + EAR_ROWS[1])
    for side, under in zip((charts.azimuth() < 0, charts.azimuth() > 0), covered):
        growth = np.where(ear & side & under, 1.0, growth)  # hair over an ear is as good as scalp
    outline, hairy = _outline(chart, portrait, base, eye)
    hairy = alike(hairy, front)
    free = _free(curtain_of(hairy, turn), covered, turn)
    base = base + free * (_hanging(base) - base)
    radius = _radius(base, outline, hairy, eye, chart, free)
    base, radius = _walled(portrait, chart, base, radius, turn)
    radius = _within(portrait, chart, base, radius)
    chin = float(head.landmarks(neutral)[CHIN, 1].mean())
    there = seen = slits = np.zeros((ROWS, COLUMNS))
    # What hangs ends in the air; elsewhere, and beside the face, hair rises from the skin.
    hung = (radius - chart.skull > OFF) & (free > 0.5)
    tall = np.maximum(radius - base - LEAST, 0)
    skin = seen_on(chart, portrait, head, neutral)
    temples = temples_of(head, chart.place(cells, chart.skull))
    for _ in range(2):
        there, seen, slits = presence(
            chart, portrait, base, radius, growth, hairy, covered, chin - 25, skin, temples
        )
        inside = charts.distance_inside(there > 0.5)
        rise = smoothstep(-2.0, RISE, inside)
        steep = np.clip((STEEP * inside + 1) / np.maximum(tall, 1e-3), 0, 1)
        falling = smoothstep(-2.0, RISE, charts.distance_inside(_without_hem(there > 0.5, free)))
        rise = np.where(hung, falling, np.minimum(rise, steep))
        radius = base + LEAST + tall * charts.smooth(rise, 5.0)
    # A lobe that hair covers is under it. Where an ear stands out farther than other hair does, hair is behind
    # it, and its ends would pierce it.
    radius = np.where(slits > 0.5, np.maximum(radius, chart.ears + LEAST), radius)
    pierced = (chart.ears - chart.skull > PIERCED) & (radius < chart.ears)
    there = np.where(pierced, 0, there)
    rows = np.flatnonzero((there > 0.5).any(1))
    lowest = charts.EQUATOR - (rows[-1] + 1 - DOME) * STEP if len(rows) else charts.EQUATOR
    return Shell(chart, base, radius, there, seen, slits, growth, float(chin - lowest))


def _beside_lobes(portrait: Portrait, chart: Chart, eye: np.ndarray) -> np.ndarray:
    """Whether hair hangs beside the lobe of each (right, left) ear: [2] bool.

    It stands out farther than an ear does: a narrow rim is the ear itself, in the shade, or an earring.
    """
    far, hairy = _outline(chart, portrait, chart.skull, eye)
    skull = [chart.take(chart.skull, _cells_down(around)) for around in sides_of(chart, eye)[:2]]
    off = np.nan_to_num(far - np.stack(skull, -1), nan=0.0)
    found: np.ndarray = (hairy[LOBES].max(0) > 0.5) & (off[LOBES].max(0) > OFF)
    return found


def _without_hem(there: np.ndarray, free: np.ndarray) -> np.ndarray:
    """Cells [ROWS, COLUMNS] bool of hair that goes on down for ever where it hangs: its tips stand off."""
    out, hangs = there.copy(), free > 0.5
    out[DOME:, hangs] = np.logical_or.accumulate(there[DOME:, hangs], 0)
    return out


def _free(curtain: np.ndarray, covered: tuple[bool, bool], turn: np.ndarray) -> np.ndarray:
    """How far hair falls freely below the equator [COLUMNS] 0..1; the rest lies on the neck."""
    hangs = curtain[DOME + HANGS : DOME + HANGS + 4].max(0)
    under = np.where(np.sin(turn) > 0, covered[1], covered[0]) & (np.abs(np.cos(turn)) < 0.8)
    both = np.maximum(hangs, under)
    wide = np.pad(both, 4, "wrap")
    free: np.ndarray = np.convolve(wide, np.ones(5) / 5, "same")[4:-4]
    return free


def _walled(
    portrait: Portrait, chart: Chart, base: np.ndarray, radius: np.ndarray, turn: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Both distances [ROWS, COLUMNS] mm with no hair farther forward than where it begins on the skin.

    Hair beside the face is seen edge on: all that the photo shows of it may stand as far back as that.

    Args:
        turn: [COLUMNS] radians from the camera.
    """
    cells = charts.grid()
    pixels, depth = portrait.pixels(chart.place(cells, chart.skull))
    bare = (bilinear(portrait.hair, pixels) < 0.5) & portrait.inside(pixels)
    bare &= (depth < at(portrait.depth, pixels) + 6) & ~at(portrait.behind, pixels)
    bare = cv2.morphologyEx(bare.astype(np.uint8), cv2.MORPH_OPEN, np.ones((3, 5))) > 0
    ahead = np.cos(turn)
    forward = charts.around() * chart.skull * ahead
    limit = np.full(radius.shape, np.inf)
    for side in (-1, 1):
        away = np.degrees(side * ((turn + np.pi) % (2 * np.pi) - np.pi))
        order = np.argsort(-away)
        order = order[(away[order] > -THROUGH) & (away[order] < 90)]  # from the ear to the nose
        reached = ~bare[:, order] | (away[order] > FLANKS)
        joined = np.logical_and.accumulate(reached, 1)
        wall = np.where(joined, forward[:, order], -np.inf).max(1) + AHEAD
        wall[joined[:, -1]] = np.inf
        wall[DOME:] = np.minimum.accumulate(wall[DOME:])  # what hangs falls down, not forward
        mine = (away > 0) & (away < 90)
        limit[:, mine] = wall[:, None] / np.maximum(charts.around() * ahead[mine], 0.02)
    tall = radius - base
    base = np.clip(limit, np.minimum(chart.skull, base), base)
    kept = np.clip(np.minimum(limit - base, tall), np.minimum(tall, LEAST), None)
    return base, base + charts.smooth(kept, 4.0)


def _within(portrait: Portrait, chart: Chart, base: np.ndarray, radius: np.ndarray) -> np.ndarray:
    """Distances [ROWS, COLUMNS] mm with nothing before the backdrop, as far as the skull allows."""
    size = 2 * max(int(SLACK * portrait.scale), 1) + 1
    clear = cv2.erode(portrait.behind.astype(np.uint8), np.ones((size, size), np.uint8)) > 0
    share = np.full(radius.shape, WIDE)  # of a skull that is itself before it
    for part in np.linspace(0, 1, 9):
        pixels, _ = portrait.pixels(chart.place(charts.grid(), base + part * (radius - base)))
        free = ~(portrait.inside(pixels) & at(clear, pixels))
        share = np.where(free, np.maximum(part, share), share)
    return base + charts.smooth(share, 5.0) * (radius - base)


def _base(
    chart: Chart, portrait: Portrait, front: float, beside: np.ndarray
) -> tuple[np.ndarray, tuple[bool, bool]]:
    """The skull, with the ear of a side whose ear is under hair, and which (right, left) ones are.

    Args:
        beside: [2] bool, whether hair is beside the lobe of each.
    """
    back = smoothstep(
        *BACK, -np.cos(charts.azimuth())
    )  # there is no ear that hair would lie before
    out = chart.skull + back * (chart.ears - chart.skull)
    wide = cv2.dilate(chart.ears.astype(np.float32), np.ones((3, 3))) + 2
    right, left = portrait.pixels(chart.center + [EAR * (-1, 1, 1), EAR])[0]
    columns = np.arange(portrait.ears.shape[1])
    of_left = np.abs(columns - left[0]) < np.abs(columns - right[0])
    sides = zip((right, left), beside, (~of_left, of_left))
    hidden = tuple(
        _hidden(portrait.ears[:, of], at_[1], under, portrait.scale) for at_, under, of in sides
    )
    covered = ears_under(hidden, tuple(beside.tolist()), front)
    for side, under in zip((charts.azimuth() < 0, charts.azimuth() > 0), covered):
        if under:
            out[:, side] = wide[:, side]
    return charts.smooth(out, 3.0), covered


def _hidden(ear: np.ndarray, upper: float, beside: bool, scale: float) -> bool:
    """Whether hair hides an ear.

    Args:
        ear: [H, n] bool, what is labelled so on its side.
        upper: row of its upper half.
        beside: whether hair is beside its lobe: of what hangs over it, that alone looks out.
        scale: pixels a millimetre.
    """
    rows = np.flatnonzero(ear.any(1))
    return bool(ear.sum() < EAR_SEEN * scale**2 or (beside and rows[0] > upper + LOW * scale))


def _hanging(base: np.ndarray) -> np.ndarray:
    """What hair lies on when it hangs: below what stands out it falls freely."""
    out = base.copy()
    for row in range(DOME - 4, ROWS):
        out[row] = np.maximum(out[row], out[row - 1] - HANG * STEP)
    return out


def _cells_down(around):
    """Cells [ROWS, 2] of an azimuth, radians, from the top of the chart down."""
    column = np.full(ROWS, (around / (2 * np.pi) + 0.5) * COLUMNS)
    return np.stack([column, np.arange(ROWS) + 0.5], -1)


def _outline(chart, portrait, base, eye):
    """How far hair reaches on both sides.

    Returns:
        distances [ROWS, 2] mm (right, left; nan where no hair is), and evidence [ROWS, 2] 0..1.
    """
    sides = sides_of(chart, eye)[:2]
    far = np.full((ROWS, 2), np.nan)
    hairy = np.zeros((ROWS, 2))
    steps = np.arange(0, REACH + 60, 1.0)
    for side, around in enumerate(sides):
        cells = _cells_down(around)
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


def _radius(base, outline, hairy, eye, chart, free):
    """Distances that agree with the outline on both sides, and go on around the head."""
    right, left, front = sides_of(chart, eye)
    turn = charts.azimuth() - front
    share = 0.5 + 0.5 * np.sin(turn)  # 1 on the left, 0 on the right
    offsets = []
    for side, around in enumerate((right, left)):
        here = chart.take(base, _cells_down(around))
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
    # Short hair gets shorter down to the nape.
    offset = offset * (1 - SHORTER * (1 - free) * smoothstep(*NAPE, lower))
    return np.maximum(charts.smooth(base + offset, 5.0), chart.skull + LEAST)
