"""`--by transfer`: each frame's skin and mouth, carried from the performer's (Olszewski 2017, section 5).

    frame -> expression texture (its camera and shape, the light of the shot)
          -> skin: TextureTransfer, as a ratio to what it makes of the performer's rest
          -> mouth: the performer's, redrawn with the target's own (`mouths`)
          -> runtime.painted -> the player

The network's own mouth is not shown: it was 1 to 3 dB further from the truth (docs/log-perform.md). The eyes are
the avatar's own, turned as the performer's are.
"""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import partial

import cv2
import numpy as np

from bakery.bake.fitting import own_head
from bakery.errors import InputError
from bakery.formats.stills import Stills
from bakery.formats.video import Clip
from bakery.generators.transfer import TextureTransfer
from bakery.geometry.color import to_encoded, to_linear
from bakery.heads.base import PARTS, HeadModel
from bakery.motion.animate import AnimationPlayer, RenderSettings
from bakery.motion.fits import ClipFit
from bakery.perform.mouths import DARK, refined
from bakery.perform.performance import Performance, Shot
from bakery.runtime.avatar import Avatar
from bakery.runtime.mouth import neighbours, weighted_median
from bakery.runtime.painted import Painted
from bakery.runtime.player import Player
from bakery.runtime.render import over_gray
from bakery.stages.condition import face_camera
from bakery.stages.fit import FitOptions, landmark_model
from bakery.stages.fit.albedo import load_albedo
from bakery.stages.fit.landmarks import Shape
from bakery.stages.fit.photometric import light_of
from bakery.stages.texture.expression import (
    PLACES,
    SIZE,
    SKIN_HEIGHT,
    expression_atlas,
    read_texture,
    skin_window,
)
from bakery.types import EXPRESSIONS, Fit, Photo

OPEN = 6  # frames of a shot whose mouths say how light and red the performer's are
RESTS = 5  # frames of a shot that say how the performer rests
TURN = 0.02  # of weight that a degree of the head's turn counts as, among frames to choose from
FLOOR = 0.01  # linear, in ratios
STRONGEST = 3.0  # ratio of skin to skin at rest
EDGE = 0.03  # of the texture's side over which its skin fades into the avatar's own
BRIDGE = 3.0  # frames: over as many the transfer fades where the face is hidden
DRAWN = 768  # pixels of the picture of the target that its resting texture is read from
COMPANY = 8  # baked mouths that the target's own mouth is the median of
_OPENS = [
    EXPRESSIONS.index(name) for name in ("jawOpen", "mouthLowerDownLeft", "mouthLowerDownRight")
]
_EYES = [number for number, name in enumerate(EXPRESSIONS) if name.startswith("eyeLook")]


class Frames:
    """The pictures of a clip by number, in rising order; it is opened again for an earlier one."""

    def __init__(self, reopen: Callable[[], Clip | Stills]) -> None:
        self._reopen, self._next = reopen, 0
        self._left: Iterator[np.ndarray] = iter(())

    def picture(self, number: int) -> np.ndarray:
        """[H, W, 3] uint8 sRGB."""
        if number < self._next or not self._next:
            self._left = (picture for _, picture in self._reopen().frames())
            self._next = 0
        for _ in range(number - self._next):
            next(self._left)
        self._next = number + 1
        return next(self._left)


@dataclass(frozen=True, eq=False)
class Performer:
    """Who plays in one shot, and how this person rests."""

    shot: Shot
    fits: ClipFit
    head: HeadModel
    neutral: np.ndarray  # [V, 3] mm
    light: np.ndarray  # [9, 3], camera space
    sure: np.ndarray  # [n] 0..1, how far each frame of the shot is believed
    rest: np.ndarray  # [SIZE, SIZE, 3] sRGB-encoded 0..1
    # Frames of the shot with open mouths, from 0, and their textures.
    talk: tuple[tuple[int, np.ndarray], ...]

    def texture(self, number: int, picture: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """What a frame of the clip shows, as `read_texture` gives it."""
        return _read(
            self.head, self.neutral, self.fits, number - self.shot.first, picture, self.light
        )


def resting_frames(fits: ClipFit, count: int = RESTS) -> np.ndarray:
    """The frames of a shot, from 0 and rising, in which the performer rests most and looks ahead."""
    effort = np.delete(fits.expression, _EYES, 1).sum(1)
    turned = np.degrees(np.linalg.norm(fits.rotation - np.median(fits.rotation, 0), axis=1))
    effort = np.where(fits.found, effort + TURN * turned, np.inf)
    return np.sort(np.argsort(effort, kind="stable")[: min(count, int(fits.found.sum()))])


def open_frames(fits: ClipFit, count: int = OPEN) -> np.ndarray:
    """Frames of a shot, from 0 and rising, that show the mouth from open to half open."""
    opening = np.where(fits.found, fits.expression[:, _OPENS].sum(1), -np.inf)
    order = np.argsort(-opening, kind="stable")[: max(int(fits.found.sum()) // 2, 1)]
    return np.sort(order[np.unique(np.linspace(0, len(order) - 1, count).astype(int))])


def light_in(fit: Fit, head: HeadModel, picture: np.ndarray) -> np.ndarray:
    """The light [9, 3], camera space, of a frame [H, W, 3] uint8 whose face has this fit."""
    options, photo = FitOptions(), Photo(np.float32(picture) / 255, "")
    found: np.ndarray = light_of(
        head, landmark_model(head, options.modes), fit.camera, Shape(fit.identity, fit.expression),
        photo, fit.landmarks_projected, load_albedo(), options,
    )  # fmt: skip
    return found


def performer_of(shot: Shot, head: HeadModel, frames: Frames) -> Performer | None:
    """The Performer of a shot; None where no face is seen.

    Args:
        head: that the clip was fitted with.
    """
    fits = shot.fits
    if fits is None or not fits.found.any():
        return None
    resting, talking = resting_frames(fits).tolist(), open_frames(fits).tolist()
    pictures = {n: frames.picture(shot.first + n) for n in sorted({*resting, *talking})}
    fit = fits.fit(resting[0], head)
    own, neutral = own_head(head, fit)
    light = light_in(fit, head, pictures[resting[0]])
    seen = {n: _read(own, neutral, fits, n, picture, light)[0] for n, picture in pictures.items()}
    sure = cv2.erode(fits.found.astype(np.float32), np.ones((3, 1)))
    sure = np.minimum(sure, cv2.GaussianBlur(sure, (1, 0), sigmaX=0, sigmaY=BRIDGE)).ravel()
    rest = np.mean([seen[n] for n in resting], 0)
    talk = tuple((n, seen[n]) for n in talking)
    return Performer(shot, fits, own, neutral, light, sure, rest, talk)


def _read(head, neutral, fits, number, picture, light):
    shape = head.vertices(neutral, fits.expression[number], fits.gaze[number])
    linear = to_linear(np.float32(picture) / 255).astype(np.float32)
    return read_texture(linear, fits.camera(number), head, shape, light)


@dataclass(frozen=True, eq=False)
class Target:
    """Who is shown: the resting expression texture, and where it fades into the avatar's own."""

    player: Player
    bald: Player  # the same without hair
    rest: np.ndarray  # [SIZE, SIZE, 3] sRGB-encoded 0..1
    seen: np.ndarray  # [SIZE, SIZE] 0..1
    inner: np.ndarray  # [rows, SIZE] 0..1: 0 at the edge of the skin

    def own_mouth(self, expression: np.ndarray) -> np.ndarray:
        """The picture [h, w, 3] linear of the mouth proxy that the avatar itself shows."""
        textures = self.player.avatar.textures
        order, weights = neighbours(textures.mouth_landmarks, self.player.lips(expression), COMPANY)
        return weighted_median(textures.mouths[order], weights)

    def tone(self, performer: Performer) -> np.ndarray:
        """What [3] a performer's mouth is multiplied by, sRGB-encoded, to be as light and red as the
        target's: of the means over the same poses, whatever each shows.
        """
        own = [self.own_mouth(performer.fits.expression[number]) for number, _ in performer.talk]
        acted = [_sheet(texture, one.shape[:2]) for (_, texture), one in zip(performer.talk, own)]
        ours, theirs = (
            np.mean([picture.mean((0, 1)) for picture in pictures], 0) + DARK
            for pictures in ([to_encoded(np.clip(one, 0, 1)) for one in own], acted)
        )
        return np.asarray(ours / theirs, np.float32)

    def mouth(self, expression: np.ndarray, acted: np.ndarray, tone: np.ndarray) -> np.ndarray:
        """The picture [h, w, 3] linear of the mouth proxy, for the performer's texture of a frame."""
        own = self.own_mouth(expression)
        return refined(np.clip(_sheet(acted, own.shape[:2]) * tone, 0, 1), own)

    def texture(
        self, expression: np.ndarray, gaze: np.ndarray, painted: Painted | None = None
    ) -> np.ndarray:
        """The expression texture [SIZE, SIZE, 3] of the target as it is drawn."""
        return _shown(self.bald, expression, gaze, painted)[0]


def target_of(player: Player) -> Target:
    """The Target of an avatar that is played."""
    head, bald = player.avatar.head, Player(player.avatar, hair=False)
    rest, seen = _shown(bald, np.zeros(len(EXPRESSIONS), np.float32), np.zeros(2))
    atlas = expression_atlas(head, SIZE)
    skin = atlas.paint((atlas.part == PARTS.index("skin")).astype(np.uint8))
    skin = skin[: round(SKIN_HEIGHT * SIZE)]
    # Eyes and mouth are holes in the skin, and no edge of the face.
    outline, _ = cv2.findContours(skin, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    whole = cv2.drawContours(np.zeros_like(skin), outline, -1, 1, cv2.FILLED)
    away = cv2.distanceTransform(cv2.copyMakeBorder(whole, 1, 1, 1, 1, 0), cv2.DIST_L2, 5)
    inner = np.clip(away[1:-1, 1:-1] / (EDGE * SIZE) - 0.3, 0, 1).astype(np.float32)
    return Target(player, bald, rest, seen, inner)


def _shown(player, expression, gaze, painted=None):
    """The expression texture of an avatar as a player draws it from ahead, and what is seen."""
    avatar = player.avatar
    camera = face_camera(avatar.fit, avatar.head, avatar.neutral, 0.0, 0.0, DRAWN, 0.8)
    work = player.workspace(DRAWN, DRAWN)
    frame = player.frame(work, camera, expression, gaze, painted=painted)
    shape = avatar.head.vertices(avatar.neutral, expression, gaze)
    return read_texture(over_gray(frame), camera, avatar.head, shape, avatar.fit.light)


@dataclass(frozen=True, eq=False)
class Role:
    """A performer of one shot, as the target plays this person."""

    performer: Performer
    rest: np.ndarray  # [SIZE, SIZE, 3] sRGB-encoded: what the network makes of the performer's rest
    tone: np.ndarray  # [3], see Target.tone


class TransferPlayer(AnimationPlayer):
    """Draws the frames of a performance with an avatar, skin and mouth carried over."""

    def __init__(
        self,
        avatar: Avatar,
        take: object,
        settings: RenderSettings,
        performance: Performance,
        head: HeadModel,
        reopen: Callable[[], Clip | Stills],
        transfer: TextureTransfer,
    ) -> None:
        """
        Args:
            take: of the performance, as it is to be played.
            head: that the clip was fitted with.
            reopen: opens the clip.

        Raises:
            InputError: the avatar is of another head model than the performer.
        """
        super().__init__(avatar, take, settings)
        if not np.allclose(head.landmark_uv(), avatar.head.landmark_uv(), atol=1e-4):
            raise InputError(
                f"--by transfer: the bundle's head is {avatar.fit.head}, the clip is fitted with "
                f"{head.name}; give --head {avatar.fit.head}"
            )
        self.performance, self.transfer = performance, transfer
        self.frames = Frames(reopen)
        self.target = target_of(self.player)
        self.roles = {shot: self._role(shot, head) for shot in performance.shots}
        seconds = performance.seconds - performance.seconds[0]
        middles = (seconds[1:] + seconds[:-1]) / 2
        shown = (self.first + np.arange(self.count)) / self.rate
        self.shows = np.searchsorted(middles, shown + 1e-9)  # [count] nearest frame of the clip

    def _role(self, shot, head):
        performer = performer_of(shot, head, self.frames)
        if performer is None:
            return None
        made = self._carried(performer, performer.rest, None)
        return Role(performer, made, self.target.tone(performer))

    def _carried(self, performer, texture, seen):
        target = self.target
        return self.transfer(texture, performer.rest, target.rest, seen, target.seen)

    def role_of(self, number: int) -> Role | None:
        """Who plays in a frame of the clip; None where no face is seen in its shot."""
        return self.roles[self.performance.shot_of(number)]

    def carried(
        self, performer: Performer, number: int, picture: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The performer's texture [SIZE, SIZE, 3] in a frame of the clip, what of it is seen
        [SIZE, SIZE], and the texture that the network makes of it for the target.
        """
        texture, seen = performer.texture(number, picture)
        return texture, seen, self._carried(performer, texture, seen)

    def sources(self, indices: Iterable[int]) -> Iterator[tuple[int, np.ndarray]]:
        """As AnimationPlayer's: frames of the clip, [H, W, 3] uint8."""
        return ((index, self.frames.picture(int(self.shows[index]))) for index in indices)

    def painted(self, index: int, source: np.ndarray) -> Painted | None:
        """As AnimationPlayer's: skin and mouth of a frame."""
        number = int(self.shows[index])
        role = self.role_of(number)
        if role is None:
            return None
        performer = role.performer
        sure = performer.sure[number - performer.shot.first]
        if sure < 1e-3:
            return None
        texture, seen, made = self.carried(performer, number, source)
        rows = len(self.target.inner)
        skin, rest = (to_linear(x[:rows]) + FLOOR for x in (made, role.rest))
        ratio = np.clip(skin / rest, 1 / STRONGEST, STRONGEST).astype(np.float32)
        share = (self.target.inner * seen[:rows] * sure).astype(np.float32)
        mouth = self.target.mouth(self.weights[index], texture, role.tone)
        return Painted(ratio, share, skin_window(self.avatar.head), mouth)


def _sheet(texture: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    """The mouth sheet of an expression texture as a picture of the mouth proxy [h, w, 3]."""
    left, top, width, height = (SIZE * share for share in PLACES["mouth_sheet"])
    scale = np.array([width / shape[1], height / shape[0]])
    start = np.array([left, top]) + 0.5 * scale - 0.5
    matrix = np.array([[scale[0], 0, start[0]], [0, scale[1], start[1]]])
    resize = partial(cv2.warpAffine, flags=cv2.INTER_CUBIC | cv2.WARP_INVERSE_MAP)
    found: np.ndarray = resize(texture, matrix, shape[::-1], borderMode=cv2.BORDER_REPLICATE)
    return found
