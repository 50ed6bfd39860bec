"""Triangles of hair: the opaque cap, and ribbons along the wisps."""

from dataclasses import dataclass

import cv2
import numpy as np

from bakery.geometry import camera as cameras
from bakery.geometry.fill import smoothstep
from bakery.stages.hair import chart as charts
from bakery.stages.hair.chart import COLUMNS, DOME, ROWS
from bakery.stages.hair.portrait import NOTHING, Portrait, at
from bakery.stages.hair.presence import sides_of
from bakery.stages.hair.shell import LEAST, Shell, hanging, in_the_air, told
from bakery.stages.hair.strands import KNOTS, LAYERS, Wisps
from bakery.types import Camera

CAP = (0.75, 0.96)  # share of the way from what hair lies on to where it ends, at least and at most
BELOW = 1.5  # mm that the cap lies below that end between the two
LIFTS = dict(zip(LAYERS, (0.4, 0.72, 1.0)))  # of the way from the cap to OUTER, by their layer
OUTER = 1.03  # share that the outermost have
# mm that wisps stand out farther: where nothing cuts them, and on the photo's outline, to which it cuts them.
OVER = 0.5, 3.0
OUTLINE = 0.3, 0.1  # cosine to the line of sight: hair is on the outline, not yet and wholly
UNDER = 2.5  # mm below the skin that the cap's border goes
RETREAT = 1.0, 12.0  # mm that the cap ends before hair that the photo does not show, and does
ASIDE = (
    40.0,
    55.0,
)  # degrees from the camera: a fringe hangs before the face, a temple's hair lies on it
EARS = 85.0, 95.0  # degrees from the middle of the face, from which an ear stands before the skin
TEMPLE = 9.0, 5.0  # rows below the equator from which hair beside the face hangs
BESIDE = 3.0  # mm that the cap ends before a hairline beside the face: single hairs are drawn on the skin
BALD = 22.0  # mm that it ends before bald scalp
SPARSE = 45.0  # mm from bald scalp up to which hair is sparse
NARROW = 22.0  # mm: half as wide as bald scalp is at least: less is a high hairline
# mm that it ends before a nape; rows below the equator, and the cosine behind the ears, from which hair is on one.
NAPE, LOW, BEHIND = 22.0, (5.0, 11.0), (0.4, 0.8)
EVEN = 10.0  # mm beside its border in which it has no steps
RISE = 8.0  # mm over which it rises from its border
ENDS = 3  # rows above the end of hanging hair at which its core ends
# Times its width that a card may have where the shell is nearly square to the chart, and one of a hem, that
# closes a line; how often its edges are moved in for that.
WIDEST, WIDEST_HEM, MOVED = 1.3, 2.0, 3
FINE, COARSE = (2, 2), (4, 4)  # rows and columns of the chart between the cap's vertices
HANGS = 16  # rows below the equator from which the cap has an inner side


@dataclass(frozen=True, eq=False)
class Part:
    """A piece of the mesh: vertices with the place in the chart that they have."""

    vertices: np.ndarray  # [n, 3] mm
    cells: np.ndarray  # [n, 2]
    faces: np.ndarray  # [m, 3]


def cap_share(shell: Shell, portrait: Portrait) -> np.ndarray:
    """How far out the cap goes: shares [ROWS, COLUMNS], nan where it must not be."""
    cells = charts.grid()
    size = 2 * max(int(1.2 * portrait.scale), 1) + 1
    sure = cv2.erode((portrait.hair > 0.6).astype(np.uint8), np.ones((size, size), np.uint8)) > 0
    out = np.full((ROWS, COLUMNS), np.nan)
    untold = told(shell) < 0.5
    highest = cap_height(shell.radius - shell.base)
    for part in (0.0, 0.2, 0.4, 0.6, 0.8, 0.9, 1.0):
        share = part * highest
        pixels, depth = portrait.pixels(shell.surface(cells, share))
        allowed = ~portrait.inside(pixels) | at(sure, pixels)
        allowed |= untold | (depth > body_depth(portrait, shell, pixels) + 6)
        out = np.where(allowed, share, out)
    return out


def cap_height(thick: np.ndarray) -> np.ndarray:
    """The share [...] that the cap has of hair that is [...] mm thick, where nothing keeps it lower."""
    share: np.ndarray = np.clip(1 - BELOW / np.maximum(thick, 1e-3), *CAP)
    return share


def body_depth(portrait: Portrait, shell: Shell, pixels: np.ndarray) -> np.ndarray:
    """Depth [...] mm of what the photo shows at pixels [..., 2] besides hair; NOTHING: backdrop."""
    _, middle = portrait.pixels(shell.chart.center)
    bare = at(portrait.depth, pixels)
    body = np.where(at(portrait.behind, pixels), NOTHING, middle + 25)
    return np.where(bare < NOTHING, bare, body)


def cap_surface(shell: Shell, portrait: Portrait) -> tuple[np.ndarray, np.ndarray]:
    """Where the cap lies and ends.

    Returns:
        distances [ROWS, COLUMNS] mm from the axis, and [ROWS, COLUMNS] mm from its border, below 0
        where it is not.
    """
    cells = charts.grid()
    share = cap_share(shell, portrait)
    hung = in_the_air(shell)
    below = np.roll(shell.there, -ENDS, 0)
    below[-ENDS:] = 0
    there = np.where(hung, np.minimum(shell.there, below), shell.there) > 0.5
    aside = aside_of(shell, portrait)
    before = (shell.growth < 0.35) & _before_face(shell, portrait, cells) & (aside < 0.75)
    # Above the face it would hide the photo's own hairline; beside it, it closes what cards leave open.
    shown = charts.smooth(shell.seen, 5.0) * (1 - aside)
    retreat = np.maximum(np.interp(shown, (0, 1), RETREAT), BESIDE * beside_face(shell, portrait))
    retreat = np.maximum(retreat, BALD * beside_bald(shell))
    retreat = np.maximum(retreat, NAPE * at_nape(shell))
    inner = charts.smooth(charts.distance_inside(there & ~np.isnan(share) & ~before), 4.0) - retreat
    # Steps of it would be teeth of the border.
    inner = charts.smooth(np.clip(inner, -EVEN, EVEN), 4.0) + np.maximum(inner - EVEN, 0)
    lowest = charts.smooth(cv2.erode(np.nan_to_num(share), np.ones((3, 3))), 4.0)
    out = shell.base + lowest * (shell.radius - shell.base) * smoothstep(0, RISE, inner)
    # A lobe that hair covers stays under it where the photo keeps the cap low beside.
    out = np.where(shell.slits > 0.5, np.maximum(out, shell.chart.ears + LEAST), out)
    rim = np.where(hung, 0.0, UNDER) * smoothstep(4.0, -4.0, inner)
    return out - rim, inner


def make_cap(shell: Shell, surface: np.ndarray, inner: np.ndarray, every: tuple[int, int]) -> Part:
    """The cap, with a vertex at every so many rows and columns; its two ends meet with own vertices.

    Args:
        surface, inner: of `cap_surface`.
    """
    rows = np.arange(0, ROWS + 1, every[0])
    columns = np.arange(0, COLUMNS + 1, every[1])
    cells = np.stack(np.meshgrid(columns, rows), -1).astype(float)
    index = np.arange(len(rows) * len(columns)).reshape(cells.shape[:2])
    a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]
    top = np.zeros_like(a, bool)
    top[0] = True  # at the pole the upper edge of a cell is a point
    faces = np.concatenate([np.stack([a, d, c], -1).reshape(-1, 3),
                            np.stack([a, c, b], -1)[~top]])  # fmt: skip
    cells, faces = _clipped(cells.reshape(-1, 2), shell.chart.take(inner, cells).reshape(-1), faces)
    points = shell.chart.place(cells, shell.chart.take(surface, cells))
    low = cells[:, 1] > DOME + HANGS
    off = shell.chart.take(surface - shell.chart.skull, cells) > 6
    inside = faces[low[faces].all(1) & off[faces].any(1)][:, ::-1]
    return Part(points, cells, np.concatenate([faces, inside]))


def _clipped(
    cells: np.ndarray, value: np.ndarray, faces: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Triangles cut where values [n] at their corners fall below 0: cells [m, 2], faces [k, 3]."""
    above = value[faces] > 0
    count = above.sum(1)
    new, out = [cells], [faces[count == 3]]
    total = len(cells)

    def cut(inside, outside):
        nonlocal total
        t = value[inside] / (value[inside] - value[outside])
        new.append(cells[inside] + t[:, None] * (cells[outside] - cells[inside]))
        total += len(t)
        return np.arange(total - len(t), total)

    for number in (1, 2):  # of corners inside
        some = faces[count == number]
        lone = (above[count == number] == (number == 1)).argmax(1)
        row = np.arange(len(some))
        a, b, c = (some[row, (lone + k) % 3] for k in range(3))
        if number == 1:
            out.append(np.stack([a, cut(a, b), cut(a, c)], 1))
        else:
            at_b, at_c = cut(b, a), cut(c, a)
            out += [np.stack([at_b, b, c], 1), np.stack([at_b, c, at_c], 1)]
    every, kept = np.concatenate(new), np.concatenate(out)
    used, compact = np.unique(kept, return_inverse=True)
    return every[used], compact.reshape(-1, 3)


def _before_face(shell: Shell, portrait: Portrait, cells: np.ndarray) -> np.ndarray:
    pixels, depth = portrait.pixels(shell.surface(cells, 1.0))
    bare = at(portrait.depth, pixels)
    return (bare < NOTHING) & (depth < bare + 5)


def beside_face(shell: Shell, portrait: Portrait) -> np.ndarray:
    """Where hair ends in one line beside the face [ROWS, COLUMNS] 0..1: not where it hangs, nor from the ears on."""
    first, last = np.cos(np.radians(EARS))
    before_ears = smoothstep(last, first, np.cos(charts.azimuth()))
    high = smoothstep(*TEMPLE, np.arange(ROWS) + 0.5 - DOME)
    aside = aside_of(shell, portrait) * before_ears * high[:, None]
    found: np.ndarray = aside * (1 - hanging(shell))
    return found


def beside_bald(shell: Shell) -> np.ndarray:
    """Where hair ends at bald scalp [ROWS, COLUMNS] 0..1: it gets sparse there, and ends in no line."""
    bald = (shell.growth > 0.5) & (shell.there < 0.5)
    bald[DOME:] = False  # around ears is no scalp
    core = charts.distance_inside(bald) > NARROW
    if not core.any():
        return np.zeros(bald.shape)
    away = -charts.distance_inside(core) - NARROW
    found: np.ndarray = charts.smooth(smoothstep(SPARSE, 0.0, away), 5.0)
    return found


def at_nape(shell: Shell) -> np.ndarray:
    """Where hair ends on a neck [ROWS, COLUMNS] 0..1: it is cut shorter down to there, and ends in no line."""
    behind = smoothstep(*BEHIND, -np.cos(charts.azimuth()))
    low = smoothstep(*LOW, np.arange(ROWS) + 0.5 - DOME)
    found: np.ndarray = charts.smooth(behind * low[:, None] * ~in_the_air(shell), 5.0)
    return found


def aside_of(shell: Shell, portrait: Portrait) -> np.ndarray:
    """How far each column [COLUMNS] is beside the face, as the camera sees it: 0..1."""
    front = sides_of(shell.chart, cameras.position(portrait.camera))[2]
    near, far = np.cos(np.radians(ASIDE))
    aside: np.ndarray = smoothstep(near, far, np.cos(charts.azimuth() - front))
    return aside


def ribbons(
    shell: Shell, wisps: Wisps, camera: Camera, wider: float = 1.0
) -> tuple[np.ndarray, np.ndarray]:
    """Both edges of each wisp: points [n, KNOTS, 2, 3] and cells [n, KNOTS, 2, 2].

    Args:
        camera: of the photo.
    """
    points = wisps.points.astype(float)
    along = np.gradient(points, axis=1)
    # The chart's own outward direction, from its axis, is steadier than the shell's normal.
    inner = shell.surface(wisps.cells, 0.0) - shell.chart.center
    inner[..., 1] *= wisps.cells[..., 1] < DOME
    side = np.cross(along, inner)
    side /= np.maximum(np.linalg.norm(side, axis=-1, keepdims=True), 1e-6)
    t = np.linspace(0, 1, KNOTS)
    taper = (0.75 + 0.25 * smoothstep(0, 0.3, t)) * (1 - 0.35 * smoothstep(0.6, 1, t))
    half = 0.5 * wider * wisps.width[:, None] * taper
    layer = np.select([np.isclose(wisps.layer, k) for k in LIFTS], list(LIFTS.values()), 1.0)
    cap = cap_height(shell.chart.take(shell.radius - shell.base, wisps.cells))
    lift = cap + layer[:, None] * (OUTER - cap)
    lift = lift * (0.72 + 0.28 * smoothstep(0, 0.35, t))
    tilt = np.where(np.arange(len(points)) % 2, 0.05, -0.05)[:, None]
    edges, cells = [], []
    middle = shell.surface(wisps.cells, lift)
    most = half * np.where(wisps.hem, WIDEST_HEM, WIDEST)[:, None]
    for sign in (-1.0, 1.0):
        # Where the shell stands square to the chart a step aside is a long way on it.
        aside = half[..., None] * side
        for _ in range(MOVED):
            at_, _ = shell.chart.cell(points + sign * aside)
            wide = np.linalg.norm(shell.surface(at_, lift) - middle, axis=-1)
            aside = aside * np.minimum(most / np.maximum(wide, 1e-3), 1)[..., None]
        at_, _ = shell.chart.cell(points + sign * aside)
        edge = shell.surface(at_, lift + sign * tilt)
        outward = edge - shell.chart.center
        outward[..., 1] *= at_[..., 1] < DOME
        outward /= np.maximum(np.linalg.norm(outward, axis=-1, keepdims=True), 1e-6)
        thick = shell.chart.take(shell.radius - shell.base, at_)
        cut = smoothstep(*OUTLINE, np.abs(cameras.facing(edge, outward, camera)))
        over = (OVER[0] + (OVER[1] - OVER[0]) * cut) * smoothstep(2, 9, thick)
        over = over * smoothstep(0, 0.35, t) * ~wisps.hem[:, None]  # a hem is not cut to shape
        edges.append(edge + outward * over[..., None])
        cells.append(at_)
    return np.stack(edges, 2), np.stack(cells, 2)


def ribbon_faces(count: int) -> np.ndarray:
    """Faces [count, 2 (KNOTS - 1), 3] of ribbons whose vertices stand [count, KNOTS, 2]."""
    k = np.arange(KNOTS - 1) * 2
    one = np.stack([np.stack([k, k + 2, k + 3], -1), np.stack([k, k + 3, k + 1], -1)], 1)
    return one.reshape(1, -1, 3) + np.arange(count)[:, None, None] * KNOTS * 2


def hang(shell: Shell, points: np.ndarray, chin: float) -> np.ndarray:
    """How far points [n, 3] stay with neck and shoulders when the head turns, 0..1."""
    cells, distance = shell.chart.cell(points)
    off = distance - shell.chart.take(shell.chart.skull, cells)
    low: np.ndarray = smoothstep(chin + 5, chin - 95, points[:, 1]) * smoothstep(4, 16, off)
    return low.astype(np.float32)
