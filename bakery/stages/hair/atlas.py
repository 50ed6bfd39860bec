"""The pictures on hair: the photo's where it shows hair, and what continues them."""

from dataclasses import dataclass

import cv2
import numpy as np

from bakery.geometry import camera as cameras
from bakery.geometry.color import LUMA, held, to_encoded
from bakery.geometry.fill import diffuse, smoothstep
from bakery.geometry.raster import rasterize
from bakery.geometry.sample import bilinear
from bakery.stages.hair import chart as charts
from bakery.stages.hair.chart import COLUMNS, DOME, ROWS
from bakery.stages.hair.curls import Curls
from bakery.stages.hair.directions import frame
from bakery.stages.hair.mesh import aside_of, beside_face, body_depth
from bakery.stages.hair.pattern import curl_alpha, strand_alpha, streaks
from bakery.stages.hair.portrait import NOTHING, Portrait, at
from bakery.stages.hair.shell import Shell, told
from bakery.stages.hair.strands import KNOTS

CAP_PART = 0.3  # of the atlas's height
GUTTER = 2  # texels around each card
STRAND = 0.7  # mm, width of the strands that are made up
SHADE = 0.95  # of what unseen hair is as bright as the hair around it
UNSEEN = (
    0.85  # of the way from the nearest colour to the middle one that hair far from the seen has
)
UNLIKE = 0.3  # distance of sRGB colours of skin and of hair that is surely no bald top's
OWN = 4.0  # times its own weight that the colour of a side counts, before the other one's
DIFFERS = 0.5  # log brightness by which made-up hair differs from the middle of the seen
BESIDE = 0.6  # cosine of the azimuth from which hair is beside the head
THINS = 0.0, 12.0  # mm within a hairline beside the face over which strands get more
STREAKS = 1.0  # of the photo's contrast that made-up strands have
LIT, GLOSS = 0.16, 0.28  # log brightness from below to above, and of the ring of gloss
DIMMED = 0.1  # log brightness that it loses beside the ring
RING = 42.0, 15.0  # degrees above the horizon that hair faces where the gloss is, and its width
INNER_SIDE = 0.35  # how much of the photo shows on hair that it sees from within, in the dark
SLANT = (0.15, 0.4)  # cosine to the camera: the photo is not shown up to it, and all from it on
OBSERVED, INFERRED = 1, 3


@dataclass(frozen=True, eq=False)
class Layout:
    """Where each card lies in the atlas: texels [n] each."""

    left: np.ndarray
    top: np.ndarray
    width: np.ndarray
    height: np.ndarray


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


class Painter:
    """Colours of places on the hair of one portrait."""

    def __init__(
        self,
        portrait: Portrait,
        shell: Shell,
        flow: np.ndarray,
        curls: Curls | None = None,
    ) -> None:
        """
        Args:
            flow: [ROWS, COLUMNS, 3] from root to tip.
            curls: None is straight hair.
        """
        self.portrait, self.shell, self.flow = portrait, shell, flow
        self.curls = curls
        self.nearest = self._nearest()
        self.normals = charts.smooth(frame(shell)[:, :, 2], 5.0)
        self.tone = self._tone()
        self.energy = self._energy()
        self.carving = self._carving()
        self.full = self._full()
        self.aside = np.broadcast_to(aside_of(shell, portrait), (ROWS, COLUMNS))

    def _nearest(self):
        """Depth [H, W] of the first surface: head or shell."""
        portrait, shell = self.portrait, self.shell
        column, row = np.meshgrid(np.arange(COLUMNS + 1), np.arange(ROWS + 1))
        cells = np.stack([column, row], -1).astype(float)
        points = shell.surface(cells, 1.0)
        pixels, depth = portrait.pixels(points)
        there = shell.chart.take(shell.there, cells) > 0.5
        index = np.arange(there.size).reshape(there.shape)
        a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]
        faces = np.stack([np.stack([a, d, c], -1), np.stack([a, c, b], -1)], -2).reshape(-1, 3)
        faces = faces[there.ravel()[faces].all(1)]
        found = rasterize(pixels.reshape(-1, 2), depth.ravel(), faces, portrait.depth.shape)
        return np.minimum(np.where(np.isfinite(found.depth), found.depth, NOTHING), portrait.depth)

    def _tone(self):
        """Log colour [ROWS, COLUMNS, 3] of the hair in each cell, continued to what is unseen."""
        portrait, shell = self.portrait, self.shell
        dark = np.log(np.maximum(portrait.color, 2e-3))
        dark = cv2.GaussianBlur(dark, (0, 0), 4 * portrait.scale)
        pixels, _ = portrait.pixels(shell.surface(charts.grid(), 1.0))
        weight = (shell.seen * shell.there * (bilinear(portrait.hair, pixels) > 0.5)).astype(
            np.float32
        )
        values = bilinear(dark, pixels)
        # A side that is hardly seen has the other one's colours.
        weight = np.minimum(OWN * weight, 1)
        other = weight[:, ::-1] * (1 - np.clip(weight, 0, 1))
        both = weight + other
        values = (values * weight[..., None] + values[:, ::-1] * other[..., None]) / np.maximum(
            both, 1e-6
        )[..., None]
        weight = both
        wide, stretch = COLUMNS // 2, 3  # colours go on around the head rather than up and down
        padded, known = (
            np.repeat(
                np.pad(p, ((0, 0), (wide, wide)) + ((0, 0),) * (p.ndim - 2), "wrap"), stretch, 0
            )
            for p in (values, weight)
        )
        on = diffuse(padded, known)[stretch // 2 :: stretch, wide:-wide]
        if (weight > 0.5).any():
            rows, columns = np.nonzero(weight > 0.5)
            beside = (rows > DOME // 2) & (np.cos(charts.azimuth()[columns]) < BESIDE)
            middle = self._middle(values[rows, columns], beside)
            # The shaded rim of a side, spread over all of it, would be hair of another colour.
            on = held(on, middle, DIFFERS)
            far = 1 - smoothstep(0.0, 0.2, charts.smooth(weight.astype(float), 50.0))[..., None]
            on = on + UNSEEN * far * (middle - on)
        return charts.smooth(on.astype(float), 6.0)

    def _middle(self, values, sides):
        """The middle of log colours [n, 3]: of a bald top's, of those alone that are of `sides` [n]."""
        middle = np.median(values, 0)
        skin = self.portrait.linear[self.portrait.skin]
        if not (len(skin) and sides.any()):
            return middle
        bare = to_encoded(np.median(skin, 0))
        beside = np.median(values[sides], 0)
        whole, aside = to_encoded(np.exp(middle)), to_encoded(np.exp(beside))
        shines = np.linalg.norm(whole - bare) < np.linalg.norm(whole - aside)
        return beside if shines and np.linalg.norm(aside - bare) > UNLIKE else middle

    def _energy(self):
        """Standard deviation of the log brightness of single wisps."""
        gray = np.log(np.maximum(self.portrait.color @ LUMA.astype(np.float32), 2e-3))
        fine = gray - cv2.GaussianBlur(gray, (0, 0), 2.0 * self.portrait.scale)
        inner = self.portrait.hair > 0.95
        return float(np.clip(np.std(fine[inner]), 0.05, 0.4)) if inner.sum() > 50 else 0.15

    def curled(self, points, cells):
        """Log brightness [n] of curls at places; None of straight hair."""
        if self.curls is None:
            return None
        normal = self.shell.chart.take(self.normals, cells)
        length = np.maximum(np.linalg.norm(normal, axis=-1, keepdims=True), 1e-6)
        return self.curls.at(points, normal / length)

    def color(self, points, cells, streak, curl=None, skin=False):
        """What places look like.

        Args:
            points: [n, 3] mm; cells: [n, 2] of the chart.
            streak: [n] noise of unit variance, along strands.
            curl: [n] log brightness, see `curled`; None has no curls.
            skin: before the face show the photo where it shows skin too, that nothing is seen of where
                hair ends.

        Returns:
            colours [n, 3] linear, share [n] that the photo shows, and alpha [n] that it leaves.
        """
        portrait, shell = self.portrait, self.shell
        pixels, depth = portrait.pixels(points)
        air, on_skin = shell.chart.take(self.carving, cells).T
        picture, shown = self._shown(points, cells, skin)
        tone = shell.chart.take(self.tone, cells)
        light = self._light(cells)
        detail = STREAKS * self.energy * streak
        if curl is not None:
            detail = detail + self.curls.share * (curl - detail)
        level = light + (1 + light) * detail
        made = np.exp(tone + np.log(SHADE) + level[:, None])
        # A side that is hardly seen looks as the other one does, in its own tone.
        there = charts.mirrored(cells)
        other, known = self._shown(shell.chart.mirrored(points), there)
        off = np.clip(tone - shell.chart.take(self.tone, there), -DIFFERS, DIFFERS)
        made += known[:, None] * (other * np.exp(off) - made)
        color = made + shown[:, None] * (picture - made)
        before = smoothstep(6.0, 1.0, depth - body_depth(portrait, shell, pixels))
        before = before * portrait.inside(pixels)
        before = before * np.where(at(portrait.depth, pixels) < NOTHING, on_skin, air)
        return color, shown, 1 - before * (1 - bilinear(portrait.hair, pixels))

    def _shown(self, points, cells, skin=False):
        """What the photo shows of places [n, 3]: colours [n, 3] linear, and how surely [n]."""
        portrait, shell = self.portrait, self.shell
        pixels, depth = portrait.pixels(points)
        thick = shell.chart.take(shell.radius - shell.base, cells)
        first = depth < at(self.nearest, pixels) + 9 + 0.4 * thick
        slant = self._cosine(points, cells)
        shown = portrait.inside(pixels) * first * smoothstep(*SLANT, np.abs(slant))
        shown = shown * np.where(slant < 0, INNER_SIDE, 1.0)
        shown = shown * shell.chart.take(self.carving[..., 1], cells)
        hair = bilinear(portrait.hair, pixels)
        picture = bilinear(portrait.color, pixels)
        sure = smoothstep(0.1, 0.5, hair)
        if skin:
            bare = smoothstep(0.7, 0.3, hair) * at(portrait.skin, pixels)
            bare = bare * (1 - shell.chart.take(self.aside, cells))
            picture = picture + bare[:, None] * (bilinear(portrait.linear, pixels) - picture)
            sure = np.maximum(sure, bare)
        return picture, shown * sure

    def _carving(self):
        """How far the photo may cut hair off before backdrop, and before skin: [ROWS, COLUMNS, 2] 0..1.

        Nothing where the skull itself is before the backdrop, for it is fitted too wide; and of hair that
        grows there, not what the photo does not tell (`presence`).
        """
        portrait, shell = self.portrait, self.shell
        pixels, _ = portrait.pixels(shell.surface(charts.grid(), 0.0))
        fits = ~(portrait.inside(pixels) & at(portrait.behind, pixels))
        both = np.stack([fits, told(shell)], -1).astype(float)
        return np.clip(charts.smooth(both, 4.0), 0, 1)

    def _full(self):
        """How many of the strands there are [ROWS, COLUMNS] 0..1: beside the face a hairline thins out."""
        inside = charts.smooth(charts.distance_inside(self.shell.there > 0.5), 3.0)
        thin = beside_face(self.shell, self.portrait)
        return 1 - thin * (1 - smoothstep(*THINS, inside))

    def _light(self, cells):
        """Log brightness [n] of hair that nobody photographed, by which way it faces: from above, soft."""
        normal = self.shell.chart.take(self.normals, cells)
        up = normal[:, 1] / np.maximum(np.linalg.norm(normal, axis=-1), 1e-6)
        off = (np.degrees(np.arcsin(np.clip(up, -1, 1))) - RING[0]) / RING[1]
        return LIT * up + GLOSS * np.exp(-(off**2)) - DIMMED

    def _cosine(self, points, cells):
        """Between the shell's normal and the line of sight, [n]."""
        normal = self.shell.chart.take(self.normals, cells)
        return cameras.facing(points, normal, self.portrait.camera)


def paint_cards(painter, layout, edges, cells, solid, length, texture, direction, along, source):
    """Paint all cards into the atlas.

    Args:
        edges: [n, KNOTS, 2, 3] mm; cells: [n, KNOTS, 2, 2] of the chart.
        solid: [n] 0..1: cards with no cap below them, which have fewer gaps.
    """
    count = layout.width * layout.height
    card = np.repeat(np.arange(len(count)), count)
    number = np.arange(len(card)) - np.repeat(np.cumsum(count) - count, count)
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
    across = s * (layout.width[card] / layout.height[card] * length[card]) / STRAND
    streak, ragged = streaks(card, across, t)
    curl = painter.curled(points, place)
    color, shown, left = painter.color(points, place, streak, curl)
    alpha = strand_alpha(card, s, across, t, ragged, solid[card], length[card])
    if curl is not None:
        alpha += painter.curls.share * (curl_alpha(s, t, curl) - alpha)
    alpha *= left
    there = painter.shell.chart.take(painter.shell.there, place)
    alpha *= smoothstep(0.3, 0.7, there + 0.25 * (ragged - 0.5))
    full = painter.shell.chart.take(painter.full, place)
    alpha *= smoothstep(0.0, 0.4, full - 0.6 * ragged)
    row, column = layout.top[card] + y, layout.left[card] + x
    texture[row, column, :3] = color * alpha[:, None]
    texture[row, column, 3] = alpha
    direction[row, column] = [0, 1]
    along[row, column] = t
    source[row, column] = np.where(shown > 0.5, OBSERVED, INFERRED)


def paint_cap(painter, surface, size, rows, texture, direction, source):
    """Paint the cap's part of the atlas; `rows` of the chart are on it."""
    tall = int(CAP_PART * size)
    y, x = np.mgrid[:tall, :size]
    cells = np.stack([(x + 0.5) / size * COLUMNS, (y + 0.5) / tall * rows], -1).reshape(-1, 2)
    shell = painter.shell
    points = shell.chart.place(cells, shell.chart.take(surface, cells))
    flow = shell.chart.take(painter.flow, cells)
    ahead, _ = shell.chart.cell(points + flow)
    step = (ahead - cells + COLUMNS / 2) % COLUMNS - COLUMNS / 2
    step[:, 1] = (ahead - cells)[:, 1]
    step = step * [size / COLUMNS, tall / rows]  # texels a mm
    noise = _drawn_out(step.reshape(tall, size, 2).astype(np.float32))
    curl = painter.curled(points, cells)
    color, shown, _ = painter.color(points, cells, noise.reshape(-1), curl, skin=True)
    made = color * (0.85 + 0.15 * shown[:, None])
    texture[:tall, :, :3] = made.reshape(tall, size, 3)
    texture[:tall, :, 3] = 1
    unit = step / np.maximum(np.linalg.norm(step, axis=1, keepdims=True), 1e-6)
    direction[:tall] = unit.reshape(tall, size, 2)
    source[:tall] = np.where(shown > 0.5, OBSERVED, INFERRED).reshape(tall, size)


def _drawn_out(step, length=16):
    """Noise [h, w] drawn out along steps [h, w, 2] texels (line integral convolution).

    References:
        Cabral and Leedom, "Imaging vector fields using line integral convolution", SIGGRAPH 1993.
    """
    tall, wide = step.shape[:2]
    noise = np.random.default_rng(11).normal(size=(tall, wide)).astype(np.float32)
    noise = cv2.GaussianBlur(noise, (0, 0), 0.6)
    grid = np.stack(np.meshgrid(np.arange(wide), np.arange(tall)), -1).astype(np.float32)
    total = noise.copy()
    for sign in (1, -1):
        place = grid.copy()
        for _ in range(length):
            move = cv2.remap(step, place % np.float32([wide, 1e9]), None, cv2.INTER_LINEAR)
            place = place + sign * np.clip(move, -3, 3)
            total += cv2.remap(noise, place % np.float32([wide, 1e9]), None, cv2.INTER_LINEAR)
    total -= cv2.GaussianBlur(total, (0, 0), 12)
    return total / max(float(total.std()), 1e-6)
