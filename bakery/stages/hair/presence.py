"""Where on the chart hair is: as the photo shows it squarely, elsewhere as on the other side."""

from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np

from bakery.geometry import camera as cameras
from bakery.geometry.fill import smoothstep
from bakery.geometry.sample import bilinear
from bakery.heads.base import HeadModel
from bakery.heads.scalp import scalp
from bakery.stages.hair import chart as charts
from bakery.stages.hair.chart import COLUMNS, DOME, ROWS, Chart
from bakery.stages.hair.portrait import NOTHING, Portrait, at
from bakery.stages.hair.sideburns import sideburns
from bakery.stages.hair.temples import Temples, temples_of

SIDE = 60.0, 74.0  # degrees from the camera: what hangs beside the face is farther round
FLANK = 85.0  # mm, radius of the cylinder on whose sides the outline lies
SQUARE = (0.02, 0.12)  # cosine to the camera: the photo says nothing up to it, all from it on
NEAR = (0.15, 0.6)  # the same for what the other side may overrule
BETTER = 0.25  # by which that of the other side is larger where this one says nothing
FIRM = (0.45, 0.7)  # but for what is seen well itself: none of it, all of it
MIRROR = 0.7  # weight of what the other side shows, where the own one is not seen
PRIOR = 0.06  # weight of the usual hairline
TURNED = (5.0, 15.0)  # degrees: of a turned head the near side tells of the far one
LINE = 3.5  # mm over which a hairline is smooth, twice
BESIDE = 10.0  # mm around what is half told that tell of it
HELD = 10  # rows below the chart's equator down to which hair grows where it is
HANGS = 14  # rows below the equator from which hair hangs
SKIPPED = 2  # rows that hair before cheeks hangs over
BETWEEN = 5  # columns, wider than what hangs below a gap between locks
SLIT = 9  # columns, wider than a gap in hair that hangs over an ear
CHEEK = 40.0  # degrees from the camera, up to which there is none: that is the face
HOLE = 24  # cells: smaller gaps in hair are none
EAR = 3.0  # mm off the skull: ears
LOBE = 3.0  # mm that an ear stands off the skull, where hair that covers it goes on to its end
EAR_ROWS = -8, 24  # rows below the equator between which ears are
ENDS = 2  # rows that it goes on below it
SKIN = 3.0  # mm over which what the photo shows on the skin is gathered
BIT = 0.1  # of the largest piece of hair: smaller ones are none


@dataclass(frozen=True)
class Seen:
    """What a photo shows on the skin; all grids [ROWS, COLUMNS]."""

    hair: np.ndarray  # 0..1
    told: np.ndarray  # 0..1, whether it shows skin or hair
    cosine: np.ndarray  # to the line of sight
    burns: np.ndarray  # [2, 12] 0..1, of `sideburns`


def growth_of(chart: Chart, head: HeadModel, neutral: np.ndarray) -> np.ndarray:
    """Share of the scalp in each cell [ROWS, COLUMNS] 0..1; neutral [V, 3] mm."""
    faces = head.faces[head.part_faces("skin")]
    share = scalp(head)[faces].mean(1)
    cells, distance = chart.cell(neutral[faces].mean(1))
    total, count = (charts.gathered(cells, values) for values in (share, np.ones(len(share))))
    near = charts.smooth(total, 5.0) / np.maximum(charts.smooth(count, 5.0), 1e-6)
    near[: DOME // 4] = 1
    return np.where(charts.smooth(count, 5.0) > 1e-3, near, 0)


def sides_of(chart: Chart, eye: np.ndarray) -> tuple[float, float, float]:
    """Azimuths of the outline (right, left), and of the camera at `eye` [3] mm."""
    toward = eye - chart.center
    around = np.arctan2(toward[0], toward[2])
    off = np.pi / 2 - np.arcsin(min(FLANK / np.hypot(toward[0], toward[2]), 0.5))
    return around - off, around + off, around


def alike(hairy: np.ndarray, front: float) -> np.ndarray:
    """Evidence [ROWS, 2] of both sides: above the ears both are alike, as the hairier one.

    The far rim of a turned head is thin, and a skull that is fitted too wide hides it: there the near
    side tells of what hangs, too.

    Args:
        hairy: [ROWS, 2] 0..1 (right, left).
        front: radians, azimuth of the camera.
    """
    near = int(front > 0)
    turned = smoothstep(*TURNED, np.degrees(abs(front)))
    out = hairy.copy()
    out[:, 1 - near] = np.maximum(out[:, 1 - near], turned * hairy[:, near])
    out[: DOME + HELD] = hairy[: DOME + HELD].max(1, keepdims=True)
    return out


def ears_under(
    hidden: tuple[bool, bool], beside: tuple[bool, bool], front: float
) -> tuple[bool, bool]:
    """Which (right, left) ears are under hair.

    An ear that cannot be seen is, if there is hair beside its lobe. The far one of a head that is turned is
    hidden anyway: it is as the near one.

    Args:
        hidden: whether the photo does not show an ear.
        beside: whether it shows hair beside its lobe.
        front: radians, azimuth of the camera.
    """
    right, left = (a and b for a, b in zip(hidden, beside))
    if abs(np.degrees(front)) < np.mean(TURNED):
        return right, left
    near = left if front > 0 else right
    return hidden[0] and near, hidden[1] and near


def curtain_of(hairy: np.ndarray, turn: np.ndarray) -> np.ndarray:
    """How surely hair hangs in each cell [ROWS, COLUMNS]: as far as both sides have it, behind.

    Args:
        hairy: [ROWS, 2] evidence of both sides.
        turn: [COLUMNS] radians from the camera.
    """
    left = (0.5 + 0.5 * np.sin(turn))[None]
    towards = np.abs(2 * left - 1)
    down = hairy.copy()
    down[HANGS + DOME :] = np.minimum.accumulate(_closed(down[HANGS + DOME :]), 0)
    down[: HANGS + DOME] = 0
    side = np.where(left > 0.5, down[:, 1:], down[:, :1])
    curtain: np.ndarray = towards * side + (1 - towards) * down.min(1, keepdims=True)
    curtain = curtain * (np.cos(turn) < 0.35)
    for k in range(HANGS + DOME - 1, DOME, -1):  # what hangs is held from above
        curtain[k] = np.maximum(curtain[k], curtain[k + 1] * (np.cos(turn) < 0.1))
    return curtain


def presence(
    chart: Chart,
    portrait: Portrait,
    base: np.ndarray,
    radius: np.ndarray,
    growth: np.ndarray,
    hairy: np.ndarray,
    covered: tuple[bool, bool],
    low: float,
    skin: Seen,
    temples: Temples,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Whether hair is in each cell, whether the photo says so, and where hair is that it does not show.

    [ROWS, COLUMNS] 0..1 each.

    Args:
        base, radius: mm, what hair lies on and reaches to.
        growth: 0..1, scalp.
        hairy: [ROWS, 2] evidence of the outline (right, left).
        covered: whether the (right, left) ear is under hair.
        low: mm, height above which hair beside an ear that is seen hangs behind it.
        skin: what the photo shows on it.
        temples: of all cells.
    """
    eye = cameras.position(portrait.camera)
    turn = charts.azimuth() - sides_of(chart, eye)[2]
    left = (0.5 + 0.5 * np.sin(turn))[None]
    towards = np.abs(2 * left - 1)
    # Above the ears the outline tells bare scalp from hair; below it, what hangs beside the neck.
    level = DOME - 2
    crown = np.where(
        (np.arange(ROWS) < level)[:, None], hairy, hairy[level - 6 : level].max(0)[None]
    )
    of_side = np.where(left > 0.5, crown[:, 1:], crown[:, :1])
    scalp_ = growth * (towards * of_side + (1 - towards) * crown.max(1, keepdims=True))
    hidden = np.maximum(scalp_, curtain_of(hairy, turn))
    grown, square = _grown(skin, scalp_, temples)
    hung, seen = _hung(chart, portrait, base, radius, hidden, covered, turn, low, eye)
    under = np.where(np.sin(turn) > 0, covered[1], covered[0])
    last = np.where(under, 6, HELD)  # hair that covers ears hangs from their tips on
    upper = smoothstep(0.0, -4.0, np.arange(ROWS)[:, None] + 0.5 - DOME - last)
    there = upper * grown + (1 - upper) * hung
    # What is half told goes with what is told beside it, or its border is ragged.
    sure = (2 * there - 1) ** 2 + 1e-3
    beside = charts.smooth(there * sure, BESIDE) / charts.smooth(sure, BESIDE)
    there = beside + np.clip(sure, 0, 1) * (there - beside)
    over_ears = under & (np.cos(turn) < np.cos(np.radians(CHEEK)))
    slits = np.where(over_ears & (np.arange(ROWS) >= DOME)[:, None], _slits(there), 0)
    slits = np.maximum(slits, over_ears * _lobes(np.maximum(there, slits), chart))
    there = _hanging(np.maximum(there, slits), turn)
    line = np.clip(1.2 * (charts.smooth(_held(there), LINE) - 0.5) + 0.5, 0, 1)
    return _held(line), (upper * square + (1 - upper) * seen) * (1 - slits), slits


def _cosine(chart, points, eye):
    outward = points - chart.center
    outward[..., 1] = np.maximum(outward[..., 1], 0)
    toward = eye - points
    return (outward * toward).sum(-1) / (
        np.linalg.norm(outward, axis=-1) * np.linalg.norm(toward, axis=-1)
    )


def seen_on(chart: Chart, portrait: Portrait, head: HeadModel, neutral: np.ndarray) -> Seen:
    """What the photo shows on the skin of a head, gathered in each cell; not on ears.

    Args:
        neutral: [V, 3] mm.
    """
    faces = head.faces[head.part_faces("skin")]
    points = neutral[faces].mean(1)
    normals = np.cross(*(neutral[faces[:, k]] - neutral[faces[:, 0]] for k in (1, 2)))
    cosine = cameras.facing(points, normals, portrait.camera)
    places = head.mean[faces].mean(1)
    cells, distance = chart.cell(points)
    pixels, depth = portrait.pixels(points)
    hair = bilinear(portrait.hair, pixels)
    told = (hair > 0.5) | ~at(portrait.behind, pixels)
    told = told & portrait.inside(pixels) & (depth < at(portrait.depth, pixels) + 6)
    lies = (distance < chart.take(chart.skull, cells) + EAR) & (cells[:, 1] < ROWS)

    def gathered(values):
        return charts.smooth(charts.gathered(cells[lies], values[lies]), SKIN)

    weight = told * (np.maximum(cosine, 0) + 1e-3)
    count = np.maximum(gathered(np.ones(len(faces))), 1e-6)
    return Seen(
        np.clip(gathered(weight * hair) / np.maximum(gathered(weight), 1e-9), 0, 1),
        np.clip(gathered(told * 1.0) / count, 0, 1), gathered(cosine) / count,
        sideburns(temples_of(head, places), places, pixels, cosine, portrait.hair),
    )  # fmt: skip


def _grown(seen, usual, temples):
    """Where hair grows out of the skin, and how squarely that is seen."""
    own, other = trusted(seen.cosine, seen.told)
    grown = weighed(own, other, seen.hair, usual, lambda grid: charts.smooth(grid, LINE))
    grown = temples.smooth(grown, seen.cosine * seen.told, seen.burns)
    return np.maximum(grown, temples.above_ears(seen.burns)), own


def trusted(
    cosine: np.ndarray, told: np.ndarray, square: tuple[float, float] = SQUARE
) -> tuple[np.ndarray, np.ndarray]:
    """How far one photo tells where hair grows by each place itself, and by that of the other side.

    At a slant a few millimetres of the fit are centimetres of the head: there, what the other side
    shows counts for more.

    Args:
        cosine: between the skin and the line of sight; grids whose columns run backwards on the
            other side of the head.
        told: 0..1, whether the photo shows skin or hair there; backdrop is of a skull fitted too wide.
        square: cosine up to which the photo says nothing, and from which on all.

    Returns:
        0..1 each.
    """
    own, well = (smoothstep(*limits, cosine) * told for limits in (square, NEAR))
    seen = np.maximum(cosine, 0) * told
    worse = np.clip((seen[:, ::-1] - seen) / BETTER, 0, 1)
    own = own * (1 - worse * (1 - smoothstep(*FIRM, seen)))
    return own, MIRROR * well[:, ::-1] * (1 - own)


def weighed(
    own: np.ndarray,
    other: np.ndarray,
    hair: np.ndarray,
    usual: np.ndarray,
    blur: Callable[[np.ndarray], np.ndarray],
) -> np.ndarray:
    """Where hair grows, 0..1.

    Args:
        own, other: of `trusted`.
        hair: 0..1, whether the photo shows hair.
        usual: 0..1, whether hair grows where nothing tells.
        blur: over what a hairline is smooth.
    """
    weight = own + other + PRIOR
    value = own * hair + other * hair[:, ::-1] + PRIOR * usual
    found: np.ndarray = blur(value) / np.maximum(blur(weight), 1e-6)
    return found


def _hung(chart, portrait, base, radius, hidden, covered, turn, low, eye):
    """Where hair hangs beside the neck, and whether the photo says so."""
    cells = charts.grid()
    points = chart.place(cells, radius)
    pixels, depth = portrait.pixels(points)
    photo = bilinear(portrait.hair, pixels)
    before = (depth < at(portrait.depth, pixels) + 6) | (photo > 0.5)  # the fitted head may err
    seen = smoothstep(-0.02, 0.2, _cosine(chart, points, eye)) * portrait.inside(pixels) * before
    # Below an ear that is seen, hair hangs behind it.
    aside = smoothstep(SIDE[0], SIDE[1], np.abs((np.degrees(turn) + 180) % 360 - 180))
    open_ear = np.where(np.sin(turn) > 0, not covered[1], not covered[0])
    level = (cells[..., 1] > DOME + 10) & (points[..., 1] > low) & open_ear
    photo = np.where(level, photo * aside, photo)
    # What hangs behind neck and shoulders ends where background shows in its place.
    gone = np.ones(hidden.shape, bool)
    for distance in (base, radius):
        behind, _ = portrait.pixels(chart.place(cells, distance))
        through = portrait.inside(behind) & at(portrait.behind, behind)
        gone &= through & (at(portrait.depth, behind) >= NOTHING)
        gone &= bilinear(portrait.hair, behind) < 0.3
    hidden = np.where(gone, 0, hidden)
    there = seen * photo + (1 - seen) * hidden
    # Between what the photo shows and what it does not, there is no gap.
    wide = np.pad(there.astype(np.float32), ((0, 0), (8, 8)), "wrap")
    closed = cv2.morphologyEx(wide, cv2.MORPH_CLOSE, np.ones((5, 7), np.uint8))[:, 8:-8]
    bare = (seen * (1 - photo) > 0.5) | gone
    return np.where(bare, there, np.maximum(there, closed)), seen


def _hanging(there: np.ndarray, turn: np.ndarray) -> np.ndarray:
    """Presence [ROWS, COLUMNS] without what hangs before cheeks and jaw from nothing.

    Such hair is behind the head: the jaw was fitted too wide, or an ear lies between.

    Args:
        turn: [COLUMNS] radians from the camera.
    """
    out = there.copy()
    before = np.cos(turn) > np.cos(np.radians(SIDE[1]))
    for row in range(DOME, ROWS):
        held = out[row - SKIPPED : row].max(0)
        held = np.where(before, np.minimum(out[row], held), out[row])
        # Hair on both sides of it holds it too: the skin above is a gap between locks.
        wide = np.pad(held.astype(np.float32), COLUMNS // 8, "wrap")[None]
        beside = cv2.morphologyEx(wide, cv2.MORPH_CLOSE, np.ones((1, BETWEEN), np.uint8))
        beside = beside[0, COLUMNS // 8 : -(COLUMNS // 8)]
        out[row] = np.maximum(held, np.minimum(out[row], beside))
    return out


def _slits(there: np.ndarray) -> np.ndarray:
    """Gaps [n, COLUMNS] 0 or 1 in presence, of hair that hangs over ears: beside the locks next to the face.

    Earrings, lit strands and the neck behind are what shows there.
    """
    wide = np.pad(there.astype(np.float32), ((0, 0), (SLIT, SLIT)), "wrap")
    closed = cv2.morphologyEx(wide, cv2.MORPH_CLOSE, np.ones((1, SLIT), np.uint8))
    return ((there <= 0.5) & (closed[:, SLIT:-SLIT] > 0.5)).astype(float)


def _lobes(there: np.ndarray, chart: Chart) -> np.ndarray:
    """Rest of the ears [ROWS, COLUMNS] 0 or 1 that hair [ROWS, COLUMNS] 0..1 covers in part.

    A lobe looks out of a bob; on an ear of another shape it would stick out of the hair like a fin.
    """
    ear = chart.ears - chart.skull > LOBE
    ear[: DOME + EAR_ROWS[0]] = ear[DOME + EAR_ROWS[1] :] = False  # shoulders stand out, too
    ear = cv2.dilate(ear.astype(np.uint8), np.ones((2 * ENDS + 1, 5))) > 0
    covered = np.maximum.accumulate((ear & (there > 0.5)).astype(np.uint8), 0)
    covered = cv2.dilate(covered, np.ones((1, 7), np.uint8)) > 0
    bare = (ear & covered & (there <= 0.5)).astype(np.uint8)
    around: np.ndarray = ear & (cv2.dilate(bare, np.ones((7, 3), np.uint8)) > 0)
    return around.astype(float)


def _held(there: np.ndarray) -> np.ndarray:
    """Presence [ROWS, COLUMNS] without bits that hang by nothing, as collars and earrings, and holes."""
    area = _areas(there > 0.5)
    kept = np.where((area > 0) & (area < BIT * area.max()), 0, there)
    hole = _areas(kept <= 0.5)
    return np.where((hole > 0) & (hole < HOLE), 1, kept)


def _areas(mask: np.ndarray) -> np.ndarray:
    """Cells of the piece of a mask [ROWS, COLUMNS] that each of its cells belongs to, 0 outside."""
    round_ = np.concatenate([mask, mask], 1).astype(np.uint8)  # what goes around is in one piece
    _, parts, sizes, _ = cv2.connectedComponentsWithStats(round_)
    area = np.where(parts > 0, sizes[parts, cv2.CC_STAT_AREA], 0).astype(float)
    return np.maximum(area[:, :COLUMNS], area[:, COLUMNS:])


def _closed(values):
    """Evidence [n, 2] with gaps of up to four rows filled."""
    padded = np.pad(values, ((2, 2), (0, 0)), "edge")
    windows = np.lib.stride_tricks.sliding_window_view(padded, 5, axis=0)
    return windows.max(-1)
