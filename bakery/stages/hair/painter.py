"""What hair looks like: as the photo shows it, and what continues that."""

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
from bakery.stages.hair.locks import FINER, lock_contrast, make_locks
from bakery.stages.hair.mesh import aside_of, at_nape, beside_bald, beside_face, body_depth
from bakery.stages.hair.portrait import NOTHING, Portrait, at
from bakery.stages.hair.shell import Shell, told

SHADE = 0.95  # of what unseen hair is as bright as the hair around it
# Of the way from the nearest colour to the middle one that hair far from the seen has.
UNSEEN = 0.85
UNLIKE = 0.3  # distance of sRGB colours of skin and of hair that is surely no bald top's
EVEN = 3.5, 35.0  # mm over which a patch, and the hair around it, has its tone
# Cosine to the camera: patches are left as they are from the first on, and evened up to the second.
EVENED = 0.9, 0.5
PATCHY = 0.2, 0.03  # log brightness, and tint, by which they differ from what is around then
FADES = 8.0  # mm over which the photo fades out where it ends to show hair
# Of what is around that it shows: none of it is taken up to the first, all from the second on.
FADED = 0.35, 0.85
OWN = 4.0  # times its own weight that the colour of a side counts, before the other one's
# Log brightness, and tint, by which made-up hair differs from the middle of the seen.
DIFFERS = 0.5, 0.06
# Log brightness by which hair may be darker than that: the rest is shade, of which so much is taken at most.
SHADED, LIFTED = 0.2, 0.6
BESIDE = 0.6  # cosine of the azimuth from which hair is beside the head
THINS = 0.0, 12.0  # mm within a hairline beside the face over which strands get more
SPARSE = 4.0, 40.0  # the same within hair that ends at bald scalp
SHORT = 0.0, 34.0  # the same above a nape
STREAKS = 1.0  # of the photo's contrast that made-up strands have
LIT, GLOSS = 0.16, 0.28  # log brightness from below to above, and of the ring of gloss
DIMMED = 0.1  # log brightness that it loses beside the ring
BROKEN = 30.0  # degrees that the ring is higher or lower on a lock, by its log brightness
RING = 42.0, 15.0  # degrees above the horizon that hair faces where the gloss is, and its width
INNER_SIDE = 0.35  # how much of the photo shows on hair that it sees from within, in the dark
SLANT = (0.25, 0.5)  # cosine to the camera: the photo is not shown up to it, and all from it on
FIRST = 9.0  # mm behind the first surface up to which the photo may show hair
UNTOLD = 0.25  # added to both where the photo does not tell the shape, as on a side turned away
CURLED = 0.12  # added to both for curls, too: drawn out they are no curls
# The same of strands over the photo: at a slant it is drawn out to a smear. Beside the border of hair, where
# its colours are continued, there are none of its own.
DRAWN = (0.8, 0.45)
BARE = (0.3, 0.55)  # the same for skin


class Painter:
    """Colours of places on the hair of one portrait."""

    def __init__(
        self,
        portrait: Portrait,
        shell: Shell,
        flow: np.ndarray,
        curls: Curls | None = None,
        longest: float = 100.0,
    ) -> None:
        """
        Args:
            flow: [ROWS, COLUMNS, 3] from root to tip.
            curls: None is straight hair.
            longest: mm of wisps.
        """
        self.portrait, self.shell, self.flow = portrait, shell, flow
        self.curls = curls
        self.nearest = self._nearest()
        self.normals = charts.smooth(frame(shell)[:, :, 2], 5.0)
        self.cosine = self._cosine(shell.surface(charts.grid(), 1.0), charts.grid())
        self.look = self._look()
        self.near = charts.smooth(self.look[1].astype(float), EVEN[0])
        self.unseen = 1 - np.clip(self.near, 0, 1)  # what is seen has its light in its tone
        self.middle = self._middle()
        self.even = self._even()
        self.tone = self._tone()
        self.energy = self._energy()
        contrast = lock_contrast(portrait, shell, self.cosine)
        contrast *= 1 - curls.share if curls else 1.0  # the tile has that of curls
        self.locks = contrast * make_locks(shell, flow, longest)
        self.carving = self._carving()
        self.full = self._full()
        self.aside = np.broadcast_to(aside_of(shell, portrait), (ROWS, COLUMNS))
        # Nothing fades out yet: the next line asks what is shown.
        self.shows = np.ones((ROWS, COLUMNS))
        self.shows = self._shows()

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

    def _look(self):
        """Log colour [ROWS, COLUMNS, 3] that the photo shows in each cell, and how surely [ROWS, COLUMNS]."""
        portrait, shell = self.portrait, self.shell
        dark = np.log(np.maximum(portrait.color, 2e-3))
        dark = cv2.GaussianBlur(dark, (0, 0), 4 * portrait.scale)
        pixels, depth = portrait.pixels(shell.surface(charts.grid(), 1.0))
        # What the photo does not tell the shape of, as of a side turned away, it may still show the colour of.
        shown = portrait.inside(pixels) & (depth < at(self.nearest, pixels) + FIRST)
        squarely = smoothstep(SLANT[0] + UNTOLD, SLANT[1] + UNTOLD, self.cosine)
        shown = np.maximum(shell.seen, shown * squarely)
        weight = shown * shell.there * (bilinear(portrait.hair, pixels) > 0.5)
        return bilinear(dark, pixels), weight.astype(np.float32)

    def _middle(self):
        """The mean log colour [3] of the hair that the photo shows: of a bald top's, of its sides alone."""
        values, weight = self.look
        if not (weight > 0.5).any():
            return None
        rows, columns = np.nonzero(weight > 0.5)
        # What is seen at a slant is in the shade.
        square = np.clip(self.cosine[rows, columns], 0, 1) ** 2 + 1e-3
        colors = np.exp(values[rows, columns])

        def mean(some):
            share = (square * some)[:, None]
            return np.log((share * colors).sum(0) / share.sum()).astype(np.float32)

        whole = mean(np.ones(len(rows)))
        sides = (rows > DOME // 2) & (np.cos(charts.azimuth()[columns]) < BESIDE)
        skin = self.portrait.linear[self.portrait.skin]
        if not (len(skin) and sides.any()):
            return whole
        beside = mean(sides)
        bare, top, aside = (
            to_encoded(x) for x in (np.median(skin, 0), np.exp(whole), np.exp(beside))
        )
        shines = np.linalg.norm(top - bare) < np.linalg.norm(top - aside)
        return beside if shines and np.linalg.norm(aside - bare) > UNLIKE else whole

    def _lit(self, logs):
        """Log brightness [ROWS, COLUMNS] that log colours lack: what is darker than the middle is shade."""
        level = (logs - self.middle) @ LUMA.astype(logs.dtype)
        return np.clip(-SHADED - level, 0, LIFTED)[..., None]

    def _even(self):
        """Log [ROWS, COLUMNS, 3] that brings what the photo shows at a slant to the tone of the hair around."""
        values, weight = self.look
        slant = np.abs(self.cosine)
        square = weight * (np.clip(slant, 0, 1) ** 2 + 1e-3)

        def mean(share, mm):
            total = charts.smooth((values * share[..., None]).astype(float), mm)
            return total / np.maximum(charts.smooth(share.astype(float), mm), 1e-6)[..., None]

        near, around = mean(weight, EVEN[0]), mean(square, EVEN[1])
        share = smoothstep(*EVENED, slant) * smoothstep(0.0, 0.1, self.near)
        wanted = held(near, around, *PATCHY)
        if self.middle is not None:
            wanted = wanted + self._lit(wanted)
        return share[..., None] * (wanted - near)

    def _tone(self):
        """Log colour [ROWS, COLUMNS, 3] of the hair in each cell, continued to what is unseen."""
        values, weight = self.look
        values = values + self.even
        # A side that is hardly seen has the other one's colours.
        weight = np.minimum(OWN * weight, 1)
        other = weight[:, ::-1] * (1 - np.clip(weight, 0, 1))
        both = weight + other
        values = (values * weight[..., None] + values[:, ::-1] * other[..., None]) / np.maximum(
            both, 1e-6
        )[..., None]
        wide, stretch = COLUMNS // 2, 3  # colours go on around the head rather than up and down
        padded, known = (
            np.repeat(
                np.pad(p, ((0, 0), (wide, wide)) + ((0, 0),) * (p.ndim - 2), "wrap"), stretch, 0
            )
            for p in (values, both)
        )
        on = diffuse(padded, known)[stretch // 2 :: stretch, wide:-wide]
        if self.middle is not None:
            # The shaded rim of a side, spread over all of it, would be hair of another colour.
            on = held(on, self.middle, *DIFFERS)
            on = on + self._lit(on)
            far = 1 - smoothstep(0.0, 0.2, charts.smooth(both.astype(float), 50.0))[..., None]
            on = on + UNSEEN * far * (self.middle - on)
        return charts.smooth(on.astype(float), 6.0)

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
        picture, shown, cosine = self._shown(points, cells, skin)
        tone = shell.chart.take(self.tone, cells)
        unseen = shell.chart.take(self.unseen, cells)
        lock = shell.chart.take(self.locks, FINER * cells)
        light = unseen * self._light(cells, lock)
        detail = STREAKS * self.energy * streak
        if curl is not None:
            detail = detail + self.curls.share * (curl - detail)
        level = light + (1 + light) * detail + lock
        made = np.exp(tone + (np.log(SHADE) * unseen + level)[:, None])
        # A side that is hardly seen looks as the other one does, in its own tone.
        there = charts.mirrored(cells)
        other, known, _ = self._shown(shell.chart.mirrored(points), there)
        off = np.clip(tone - shell.chart.take(self.tone, there), -DIFFERS[0], DIFFERS[0])
        made += known[:, None] * (other * np.exp(off) - made)
        drawn = smoothstep(*DRAWN, np.abs(cosine))
        drawn = np.maximum(drawn, 1 - bilinear(portrait.sharp, pixels))
        picture = picture * np.exp(drawn * detail)[:, None]
        color = made + shown[:, None] * (picture - made)
        before = smoothstep(6.0, 1.0, depth - body_depth(portrait, shell, pixels))
        before = before * portrait.inside(pixels)
        before = before * np.where(at(portrait.depth, pixels) < NOTHING, on_skin, air)
        return color, shown, 1 - before * (1 - bilinear(portrait.hair, pixels))

    def _shown(self, points, cells, skin=False):
        """What the photo shows of places [n, 3]: colours [n, 3] linear, how surely [n], and from which cosine [n]."""
        portrait, shell = self.portrait, self.shell
        pixels, depth = portrait.pixels(points)
        thick = shell.chart.take(shell.radius - shell.base, cells)
        first = depth < at(self.nearest, pixels) + FIRST + 0.4 * thick
        slant = self._cosine(points, cells)
        shown = portrait.inside(pixels) * first * np.where(slant < 0, INNER_SIDE, 1.0)
        hair = bilinear(portrait.hair, pixels)
        picture = bilinear(portrait.color, pixels) * np.exp(shell.chart.take(self.even, cells))
        told = shell.chart.take(self.carving[..., 1], cells)
        more = UNTOLD * (1 - told)
        more += 0.0 if self.curls is None else CURLED * self.curls.share
        sure = smoothstep(0.1, 0.5, hair) * smoothstep(
            SLANT[0] + more, SLANT[1] + more, np.abs(slant)
        )
        sure = sure * shell.chart.take(self.shows, cells)
        if skin:
            bare = smoothstep(0.7, 0.3, hair) * at(portrait.skin, pixels)
            bare = bare * told * (1 - shell.chart.take(self.aside, cells))
            picture = picture + bare[:, None] * (bilinear(portrait.linear, pixels) - picture)
            sure = np.maximum(sure, bare * smoothstep(*BARE, np.abs(slant)))
        return picture, shown * sure, slant

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

    def _shows(self):
        """How much of what is around each cell the photo shows, hair or skin [ROWS, COLUMNS] 0..1.

        Where it ends to show any, it fades out, or the border would be seen.
        """
        portrait, shell = self.portrait, self.shell
        cells = charts.grid().reshape(-1, 2)
        points = shell.surface(cells, 1.0)
        _, shown, cosine = self._shown(points, cells)
        pixels, _ = portrait.pixels(points)
        beside = at(portrait.skin, pixels) & portrait.inside(pixels)
        beside = beside * smoothstep(*BARE, cosine)
        shown = np.maximum(shown, beside).reshape(ROWS, COLUMNS)
        return smoothstep(*FADED, charts.smooth(shown, FADES))

    def _full(self):
        """How many of the strands there are [ROWS, COLUMNS] 0..1: fewer beside face and bald scalp, and at a nape."""
        inside = charts.smooth(charts.distance_inside(self.shell.there > 0.5), 3.0)
        thin = beside_face(self.shell, self.portrait) * (1 - smoothstep(*THINS, inside))
        sparse = beside_bald(self.shell) * (1 - smoothstep(*SPARSE, inside))
        short = at_nape(self.shell) * (1 - smoothstep(*SHORT, inside))
        return 1 - np.max([thin, sparse, short], 0)

    def _light(self, cells, lock):
        """Log brightness [n] of hair that nobody photographed, by which way it faces: from above, soft.

        The ring of gloss breaks from lock [n] to lock.
        """
        normal = self.shell.chart.take(self.normals, cells)
        up = normal[:, 1] / np.maximum(np.linalg.norm(normal, axis=-1), 1e-6)
        off = (np.degrees(np.arcsin(np.clip(up, -1, 1))) - RING[0] + BROKEN * lock) / RING[1]
        return LIT * up + GLOSS * np.exp(-(off**2)) - DIMMED

    def _cosine(self, points, cells):
        """Between the shell's normal and the line of sight, [n]."""
        normal = self.shell.chart.take(self.normals, cells)
        return cameras.facing(points, normal, self.portrait.camera)
