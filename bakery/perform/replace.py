"""`--over CLIP2`: the face that plays a clip, put into other footage (Olszewski 2017, section 6).

    frame of the footage -> its head's pose -> the avatar drawn there, its rim on the footage's face
          -> light of the footage (SH) -> seam (`seam`, a window of frames at once)
          -> tone of the footage at the seam, faded out inwards -> laid over the frame

Windows overlap, and change into each other over what they share: memory does not grow with the clip, and
a frame does not depend on where the film begins.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import cv2
import numpy as np

from bakery.errors import InputError
from bakery.geometry import camera as cameras
from bakery.geometry import harmonics, rotation
from bakery.geometry.color import to_bytes, to_encoded, to_linear
from bakery.geometry.fill import diffuse, enclosed, soft_limit
from bakery.geometry.mesh import vertex_normals
from bakery.geometry.raster import rasterize
from bakery.geometry.sample import bilinear, interpolate
from bakery.motion.animate import AnimationPlayer
from bakery.parallel import side_by_side
from bakery.perform.footage import Footage, Place, Standing, place_of
from bakery.perform.patch import Patch, patch_of
from bakery.perform.performance import Shot
from bakery.perform.seam import Seen, seam
from bakery.runtime.relight import posed
from bakery.runtime.render import Frame
from bakery.types import Camera

WINDOW, SHARED = 48, 12  # frames that a cut decides, and that two windows change over
FACING = 0.25  # cosine to the camera below which skin is not replaced
KNOWN = 0.5  # of the drawn face, below which nobody knows what it looks like
BLEND = 4.5  # mm, over which the seam is blended
STEADY = 2.0  # frames, sigma by which seam and tone are smoothed in time
SMOOTH = 8.0  # mm, over which the change of light is evened out
LITTLE = 0.001  # of what the seam tells at most: where it tells less, tone fades out
FLOOR = 0.01  # linear, in ratios of colours
TONE, LIGHT = 0.7, 0.9  # natural logarithms of the strongest change of tone, and of light
DARK = 0.1  # of a light's mean, the least that it gives a surface


@dataclass(frozen=True, eq=False)
class Drawn:
    """A face drawn where it is to be laid, in a box of the frame."""

    box: tuple[slice, slice]  # rows and columns of the frame
    color: np.ndarray  # [h, w, 3] uint8 sRGB
    share: np.ndarray  # [h, w] uint8, 255 where it is drawn and nothing hides it
    pixels: np.ndarray  # [P, 2] of the patch, in the box
    depth: np.ndarray  # [P] mm
    light: np.ndarray  # [P, 3] what the footage's light makes of the photo's
    sight: np.ndarray  # [P] bool, see seam.Seen
    feature: np.ndarray  # [P] bool, see seam.Seen


@dataclass(frozen=True, eq=False)
class Window:
    """What was decided for frames [first, first + n)."""

    first: int
    face: np.ndarray  # [n, P] float16 0..1, share of the drawn face
    tone: np.ndarray  # [n, P, 3] float16, natural logarithm of the change of colour


@dataclass(frozen=True, eq=False)
class Span:
    """Frames of the film that one shot of the footage lies behind."""

    shot: Shot
    first: int
    last: int  # one behind the last


@dataclass(frozen=True, eq=False)
class Layers:
    """A frame of the film and what it is made of."""

    number: int
    source: np.ndarray  # [H, W, 3] uint8, the footage
    drawn: Drawn | None  # None: nothing is replaced in this frame
    values: np.ndarray | None  # [P, 4], see `laid`
    made: np.ndarray  # [H, W, 3] uint8


class Replacement:
    """Frames of footage with the face of an AnimationPlayer in them."""

    def __init__(
        self, player: AnimationPlayer, footage: Footage, first: int = 0, last: int | None = None
    ) -> None:
        """
        Args:
            player: of the whole performance, without hair, at the rate of the film.
            first, last: frames of the film that are shown; None: to the end of the shorter of both.

        Raises:
            InputError: there is no such frame.
        """
        self.player, self.footage, self.rate = player, footage, player.rate
        whole = min(player.count, int(np.floor(footage.seconds * self.rate + 1e-6)) + 1)
        end = whole if last is None else min(last, whole)
        if first >= end:
            raise InputError(
                f"--frames: the clip and what it is put into share {whole} frames; begin below that"
            )
        self.first, self.count = first, end - first
        self.size = footage.width, footage.height
        self.shows = [footage.shows(number / self.rate) for number in range(whole)]
        self.spans = self._spans()
        self.patch = patch_of(player.avatar.head)
        places = {
            shot: place_of(one, player.avatar) for shot, one in footage.standings.items() if one
        }
        self.stage = _Stage(self, places)
        self.used = np.searchsorted(player.player.used, self.patch.vertices)
        self.normals = self._photographed()
        player.enter(
            self.stage, next(n for n in range(whole) if self.standing_of(n)[0] is not None)
        )
        self.drawn: dict[int, Drawn] = {}
        self.windows: dict[tuple[int, int], Window] = {}

    def _spans(self):
        shots = [self.footage.performance.shot_of(number) for number in self.shows]
        edges = [0, *(n for n in range(1, len(shots)) if shots[n] is not shots[n - 1]), len(shots)]
        return [Span(shots[a], a, b) for a, b in zip(edges, edges[1:])]

    def _photographed(self):
        """Normals [P, 3] of the patch in the avatar's photo, camera space."""
        avatar = self.player.avatar
        turn = rotation.matrix(avatar.fit.camera.rotation)
        return self.patch.at(vertex_normals(posed(avatar), avatar.head.faces)) @ turn.T

    def notes(self, name: object) -> tuple[str, ...]:
        """What is told of the footage, which messages call `name`."""
        told = [f"{name}: {note}" for note in self.footage.performance.notes]
        theirs, ours = self.footage.seconds + 1 / self.rate, self.player.count / self.rate
        if abs(theirs - ours) > 1.5 / self.rate:
            told.append(
                f"lasts {ours:.1f} s and {name} {theirs:.1f} s: the film ends with the shorter one"
            )
        return tuple(told)

    def standing_of(self, number: int) -> tuple[Standing | None, int]:
        """Who stands in a frame of the film, None: nobody, and the frame of its shot."""
        shot = self.footage.performance.shot_of(self.shows[number])
        return self.footage.standings[shot], self.shows[number] - shot.first

    def pictures(self, indices: Iterable[int]) -> Iterator[np.ndarray]:
        """Yield the frames [H, W, 3] uint8 sRGB of some of those shown, rising."""
        return (layers.made for layers in self.layers(indices))

    def layers(self, indices: Iterable[int]) -> Iterator["Layers"]:
        """Yield the frames of some of those shown, rising, with what they are made of."""

        def laid_over(given):
            number, source, drawn, values = given
            made = source if drawn is None else laid(source, drawn, values, self.patch)
            return Layers(number, source, drawn, values, made)

        numbers = (self.first + index for index in indices)
        return side_by_side(laid_over, ((n, self.source(n), *self.layer(n)) for n in numbers))

    def source(self, number: int) -> np.ndarray:
        """The footage's own picture [H, W, 3] uint8 of a frame of the film."""
        return self.footage.sized(self.footage.behind.picture(self.shows[number]))

    def layer(self, number: int) -> tuple[Drawn | None, np.ndarray | None]:
        """The drawn face of a frame of the film, and share and colour factors [P, 4] of its patch."""
        standing, frame = self.standing_of(number)
        if standing is None or standing.share[frame] <= 0:
            return None, None
        place = next(n for n, span in enumerate(self.spans) if number < span.last)
        here = number - self.spans[place].first
        edge = round(here / WINDOW)
        away = here - edge * WINDOW + SHARED / 2
        parts = [(here // WINDOW, 1.0)]
        if edge and 0 <= away < SHARED and self._has(place, edge):
            late = (away + 0.5) / SHARED
            parts = [(edge - 1, 1 - late), (edge, late)]
        values = np.zeros((len(self.patch.vertices), 4), np.float32)
        for which, share in parts:
            window = self._window(place, which)
            row = number - window.first
            values[:, 0] += share * window.face[row]
            values[:, 1:] += share * window.tone[row]
        drawn = self.drawn[number]
        values[:, 0] *= standing.share[frame]
        values[:, 1:] = drawn.light * np.exp(values[:, 1:])
        return drawn, values

    def _has(self, place, which):
        span = self.spans[place]
        return span.first + which * WINDOW < span.last

    def _window(self, place, which):
        """Window `which` of a span, which also has its drawn frames at hand."""
        span = self.spans[place]
        first = max(span.first + which * WINDOW - SHARED // 2, span.first)
        last = min(span.first + (which + 1) * WINDOW + SHARED // 2, span.last)
        key = place, which
        if key not in self.windows:
            for number in [n for n in self.drawn if n < first]:
                del self.drawn[number]
            for old in [k for k in self.windows if k < (place, which - 1)]:
                del self.windows[old]
            self.windows[key] = self._decided(first, last)
        return self.windows[key]

    def _decided(self, first, last):
        """The Window of frames [first, last): seam and tone."""
        patch, count = self.patch, last - first
        shape = count, len(patch.vertices)
        seen = Seen(
            np.zeros((*shape, 3), np.float32), np.zeros((*shape, 3), np.float32),
            np.zeros(shape, bool), np.zeros(shape, np.float32), np.zeros(shape, bool),
        )  # fmt: skip
        todo = [n for n in range(first, last) if n not in self.drawn and self._stands(n)]
        fresh = zip(todo, self.player.rendered(todo))
        for row, number in enumerate(range(first, last)):
            if not self._stands(number):
                seen.hidden[row] = 1
                continue
            picture = self.footage.sized(self.footage.ahead.picture(self.shows[number]))
            if number not in self.drawn:
                _, frame = next(fresh)
                self.drawn[number] = self._put(number, frame, picture)
            self._look(number, picture, seen, row)
        labels = seam(patch, seen)
        face = np.empty(shape, np.float32)
        ones = np.ones(shape[1])
        for row in range(count):
            face[row] = patch.surface.relaxed(
                labels[row, :, None], ones, patch.inner | patch.outer, BLEND
            )[:, 0]
        face = np.clip(_smooth(face), 0, 1)
        tone = _smooth(np.array([self._tone(seen, face, row) for row in range(count)]))
        return Window(first, face.astype(np.float16), tone.astype(np.float16))

    def _stands(self, number):
        standing, frame = self.standing_of(number)
        return standing is not None and standing.share[frame] > 0

    def _tone(self, seen, face, row):
        """What [P, 3] the drawn face is changed by to be the footage's at the seam."""
        patch, rim = self.patch, self.patch.free
        source, target = (to_linear(x[row, rim]) + FLOOR for x in (seen.source, seen.target))
        trust = 4 * face[row, rim] * (1 - face[row, rim]) * seen.sight[row, rim]
        trust *= (1 - seen.hidden[row, rim]) * ~seen.feature[row, rim]
        told = np.column_stack([trust[:, None] * np.log(source / target), trust])
        mean = patch.near @ told.astype(np.float32)
        most = max(float(mean[:, 3].max()), 1e-6)
        return soft_limit(mean[:, :3] / (mean[:, 3:] + LITTLE * most), TONE)

    def _put(self, number: int, frame: Frame, picture: np.ndarray) -> Drawn:
        """A drawn frame as a Drawn; memory holds only the face."""
        camera, shape = self.stage.pose(number)
        points = cameras.to_camera(shape, camera)
        pixels, depth = cameras.project_camera(points, camera), -points[:, 2]
        low = np.clip(np.floor(pixels.min(0)).astype(int) - 2, 0, np.array(self.size) - 1)
        high = np.clip(np.ceil(pixels.max(0)).astype(int) + 2, low + 1, self.size)
        box = slice(low[1], high[1]), slice(low[0], high[0])
        standing, row = self.standing_of(number)
        before, features = self.footage.parts(standing, row, picture)
        shown, features = 1 - before[box], np.float32(features[box])
        alpha = frame.alpha[box]
        color = to_encoded(np.clip(frame.color[box] / np.maximum(alpha, 1e-3)[..., None], 0, 1))
        normals = vertex_normals(shape, self.patch.faces) @ rotation.matrix(camera.rotation).T
        known = bilinear(frame.face, pixels) > KNOWN
        toward = -points / np.linalg.norm(points, axis=1, keepdims=True)
        inside = ((pixels >= 1) & (pixels <= np.array(self.size) - 1)).all(1)
        sight = ((normals * toward).sum(1) > FACING) & known & inside
        return Drawn(
            box, to_bytes(color), to_bytes(alpha * shown), (pixels - low).astype(np.float32),
            depth.astype(np.float32), self._lit(normals, standing.light, sight), sight,
            bilinear(features, pixels - low) > 0.25,
        )  # fmt: skip

    def _lit(self, normals, light, sight):
        """What [P, 3] the light [9, 3] of the footage makes of skin in the light of the photo.

        It is evened out over the face: normals turn wildly on rims of lips and lids.
        """
        shine = []
        for one, at in ((light, normals), (self.player.avatar.fit.light, self.normals)):
            least = DARK * harmonics.C0 * np.abs(one[0])
            shine.append(np.maximum(harmonics.irradiance(at, one), least))
        ratio = soft_limit(np.log(shine[0] / shine[1]), LIGHT)
        fixed = np.zeros(len(sight), bool)
        return np.exp(self.patch.surface.relaxed(ratio, sight, fixed, SMOOTH))

    def _look(self, number, picture, seen, row):
        """Note what a frame shows at the patch's vertices."""
        drawn = self.drawn[number]
        around = np.float32(picture[drawn.box]) / 255
        seen.source[row] = bilinear(cv2.GaussianBlur(around, (0, 0), 0.8), drawn.pixels)
        face = bilinear(cv2.GaussianBlur(np.float32(drawn.color) / 255, (0, 0), 0.8), drawn.pixels)
        seen.target[row] = to_encoded(np.clip(to_linear(face) * drawn.light, 0, 1))
        seen.hidden[row] = 1 - bilinear(np.float32(drawn.share) / 255, drawn.pixels)
        seen.sight[row], seen.feature[row] = drawn.sight, drawn.feature


def laid(picture: np.ndarray, drawn: Drawn, values: np.ndarray, patch: Patch) -> np.ndarray:
    """A frame of footage with a drawn face over it.

    Args:
        picture: [H, W, 3] uint8.
        values: [P, 4] share of the face 0..1, and what its linear colours are multiplied by.

    Returns:
        [H, W, 3] uint8.
    """
    shape = drawn.share.shape
    found = rasterize(drawn.pixels, drawn.depth, patch.faces, shape, cull=True)
    planes = interpolate(found, values[patch.faces])
    skin = found.face >= 0
    holes = enclosed(~skin)  # eyes and mouth
    gains = planes[..., 1:]
    if holes.any():
        gains = np.where(holes[..., None], diffuse(gains, skin.astype(np.float32)), gains)
    share = np.where(holes, 1, planes[..., 0]) * (drawn.share / np.float32(255))
    face = to_encoded(np.clip(to_linear(drawn.color / np.float32(255)) * gains, 0, 1))
    out = picture.copy()
    under = np.float32(picture[drawn.box]) / 255
    out[drawn.box] = to_bytes(under + share[..., None] * (face - under))
    return out


class _Stage:
    """Where the avatar stands in each frame of the film: a motion.animate.Stage."""

    def __init__(self, film: Replacement, places: dict[Shot, Place]) -> None:
        self.film, self.places = film, places

    def camera_of(self, number: int) -> Camera:
        standing, frame = self.film.standing_of(number)
        camera = self.film.footage.camera(
            standing.fits, standing.rotation[frame], standing.translation[frame]
        )
        return self.places[standing.shot].camera(camera)

    def shape_of(self, number: int) -> np.ndarray:
        film, player = self.film, self.film.player
        shape = player.player.vertices(player.weights[number], player.gaze[number])
        standing, frame = film.standing_of(number)
        theirs = self.places[standing.shot].inside(standing.shape(frame, film.patch))
        shape[film.used] += (1 - film.patch.own) * (theirs - shape[film.used])
        return shape

    def pose(self, number: int) -> tuple[Camera, np.ndarray]:
        """The camera of a frame, and the patch's vertices [P, 3] mm in it."""
        return self.camera_of(number), self.shape_of(number)[self.film.used]


def _smooth(values):
    """Values [n, ...] smoothed in time; at both ends they hold."""
    reach = int(np.ceil(3 * STEADY))
    kernel = np.exp(-0.5 * (np.arange(-reach, reach + 1) / STEADY) ** 2)
    flat = values.reshape(len(values), -1)
    padded = np.pad(flat, ((reach, reach), (0, 0)), mode="edge")
    out = np.zeros_like(flat)
    for offset, weight in enumerate(kernel / kernel.sum()):
        out += np.float32(weight) * padded[offset : offset + len(flat)]
    return out.reshape(values.shape)
