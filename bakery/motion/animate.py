"""A take played by an avatar: pictures in order, and the video or the files they become."""

import os
from collections import deque
from dataclasses import asdict, dataclass, replace
from typing import Protocol

import numpy as np

from bakery.errors import InputError
from bakery.formats import video
from bakery.formats.files import digest, write_bytes
from bakery.formats.livelink import format_take
from bakery.formats.sequence import png
from bakery.formats.work import key_of, work_folder
from bakery.geometry import camera as cameras
from bakery.geometry import rotation
from bakery.geometry.color import to_encoded
from bakery.heads.base import gaze_of
from bakery.parallel import side_by_side
from bakery.runtime.framing import FRAMINGS, framed_camera
from bakery.runtime.player import Player
from bakery.runtime.render import in_photo, over_gray, over_photo, portrait_at
from bakery.stages.fit.gaze import LIMIT
from bakery.types import Camera

PART = 150  # frames that are encoded together, and lost together by an interruption


@dataclass(frozen=True)
class RenderSettings:
    """How a take is drawn."""

    view: str | tuple[float, float] = "front"  # "photo", "front" or (yaw, pitch) degrees
    framing: str = FRAMINGS[0]  # of views other than the photo's own
    size: int = 512  # pixels of the longer side
    rate: float | None = None  # frames a second; None is the take's own
    first: int = 0  # frame of the take that is shown first
    last: int | None = None  # one behind the last; None shows all
    dynamic: bool = True  # whether expressions change the texture
    hair: bool = True  # whether the hair layer is shown
    film: bool = True  # a video: sides are even; else single pictures with alpha
    codec: str = video.CODECS[0]  # of a video, of `video.CODECS`

    def __post_init__(self):
        if self.film and self.size % 2:
            raise InputError(
                f"--size {self.size}: videos have an even number of pixels; give {self.size - 1} or "
                f"{self.size + 1}, or write PNG frames"
            )


def parse_frames(text):
    """First frame and the one behind the last of "0:300", "100:" or ":50".

    Raises:
        InputError: not such a range.
    """
    first, colon, last = (text or ":").partition(":")
    try:
        first, last = int(first or 0), int(last) if last else None
    except ValueError:
        colon = ""
    if not colon or first < 0 or (last is not None and last <= first):
        raise InputError(f"--frames: '{text}'; give FIRST:LAST, counted from 0, as 0:300")
    return first, last


class Stage(Protocol):
    """Where a head stands that is put into other pictures."""

    def camera_of(self, index: int) -> Camera:
        """The camera of a frame; its size is that of all."""

    def shape_of(self, index: int) -> np.ndarray | None:
        """The vertices [v, 3] mm of a frame as `Player.vertices` orders them, or None for those that
        the weights make.
        """


class AnimationPlayer:
    """Draws any frame of a take with an avatar."""

    stage: Stage | None = None

    def __init__(self, avatar, take, settings):
        """
        Raises:
            InputError: the range holds no frame, or the photo is wanted and not in the bundle.
        """
        if settings.view == "photo" and avatar.photo is None:
            raise InputError("--view photo: the bundle keeps no photo; build it with --keep-photo")
        self.avatar, self.settings = avatar, settings
        self.rate = settings.rate or take.rate
        whole = int(np.floor(take.seconds[-1] * take.rate + 1e-6)) + 1
        last = whole if settings.last is None else min(settings.last, whole)
        if settings.first >= last:
            raise InputError(f"--frames: the take has {whole} frames; begin below that")
        # The same seconds whatever the rate: frames are those of the take, and lie on one grid.
        self.first, end = (
            int(np.ceil(frame * self.rate / take.rate - 1e-6)) for frame in (settings.first, last)
        )
        self.count = end - self.first
        if not self.count:
            raise InputError(
                f"--frames: too few for --fps {self.rate:g}; give more, or raise --fps"
            )
        self.weights, self.head, eyes = take.at(np.arange(self.first, end) / self.rate)
        gaze = (
            np.array([gaze_of(weights).mean(0) for weights in self.weights])
            if eyes is None
            else eyes.mean(1)
        )
        self.gaze = np.clip(gaze, -LIMIT, LIMIT)
        self.player = Player(avatar, settings.hair)
        self.camera = self._camera()
        self.background = None
        if settings.view == "photo":
            self.portrait, self.background = portrait_at(avatar, self.camera)
            self.source = in_photo(self.portrait)

    def _camera(self):
        avatar, settings, size = self.avatar, self.settings, self.settings.size
        if settings.view != "photo":
            yaw, pitch = (0.0, 0.0) if settings.view == "front" else settings.view
            return framed_camera(
                settings.framing, avatar.fit, avatar.head, avatar.neutral, yaw, pitch, size,
                avatar.textures.hair_mesh if settings.hair else None,
            )  # fmt: skip
        camera = avatar.fit.camera
        scale, step = size / max(camera.width, camera.height), 2 if settings.film else 1
        width, height = (
            max(round(n * scale / step) * step, step) for n in (camera.width, camera.height)
        )
        return cameras.crop(camera, 0, 0, width, height, scale)

    @property
    def size(self):
        """Width and height of the pictures, pixels."""
        return self.camera.width, self.camera.height

    def camera_of(self, index):
        """The camera of a frame: the head's motion is the camera's, seen from the head.

        The photo's own view stays as it is: its background cannot turn.
        """
        if self.stage is not None:
            return self.stage.camera_of(index)
        if self.settings.view == "photo" or not self.head[index].any():
            return self.camera
        turn = rotation.yaw_pitch_roll(*self.head[index])
        points = self.avatar.head.landmarks(self.avatar.neutral)[:468]
        pivot = np.array([0.0, *points[:, 1:].mean(0)])
        still = rotation.matrix(self.camera.rotation)
        where = cameras.to_camera(pivot, self.camera)
        turned = still @ turn
        return replace(
            self.camera, rotation=rotation.vector(turned), translation=where - turned @ pivot
        )

    def enter(self, stage, index=0):
        """Stand where a Stage says from now on; frame `index` of it says how large the pictures are."""
        self.stage, self.camera = stage, stage.camera_of(index)

    def frame(self, work, index, painted=None):
        """The render.Frame of a frame, hair with volume apart where something is behind the head."""
        pose = self.camera_of(index), self.weights[index], self.gaze[index], self.settings.dynamic
        shape = None if self.stage is None else self.stage.shape_of(index)
        return self.player.frame(work, *pose, self.background is not None, painted, shape)

    def picture(self, work, index, painted=None):
        """Frame `index` of those shown: [H, W, 3] uint8 sRGB; with alpha, [H, W, 4], where it is
        a single picture of the head alone. `painted` is a runtime.painted.Painted of that frame.
        """
        pose = self.camera_of(index), self.weights[index], self.gaze[index], self.settings.dynamic
        if self.background is None and self.settings.film:
            return self.player.picture(work, *pose, painted)
        return self.shown(index, self.frame(work, index, painted))

    def shown(self, index, frame):
        """A render.Frame of frame `index` as a picture, as `picture` gives it; over the photo its
        hair is apart.
        """
        if self.background is None:
            return _bytes(to_encoded(over_gray(frame))) if self.settings.film else cut_out(frame)
        vertices = self.avatar.neutral.copy()  # the hidden ones rest: nobody sees them
        vertices[self.player.used] = self.player.vertices(self.weights[index], self.gaze[index])
        over = over_photo(self.portrait, frame, vertices, self.background, self.source)
        return _bytes(to_encoded(over))

    def sources(self, indices):
        """Yield (index, what `painted` makes the frame from); textures that are baked need nothing."""
        return ((index, None) for index in indices)

    def painted(self, index, source):
        """What is painted for a frame alone: a runtime.painted.Painted, or None."""
        return None

    def pictures(self, indices, finish=lambda picture: picture):
        """Yield `finish` of the pictures of some frames in order, made side by side."""
        return self._drawn(lambda *what: finish(self.picture(*what)), indices)

    def rendered(self, indices):
        """Yield the render.Frame of some frames in order, made side by side."""
        return self._drawn(self.frame, indices)

    def _drawn(self, how, indices):
        """Yield `how` (a workspace, a frame's index and what is painted for it) of some frames."""
        free = deque()

        def draw(given):
            index, source = given
            try:
                work = free.pop()
            except IndexError:  # one for each thread, then no more
                work = self.player.workspace(self.camera.width, self.camera.height)
            try:
                return how(work, index, self.painted(index, source))
            finally:
                free.append(work)

        return side_by_side(draw, self.sources(indices))


def cut_out(frame):
    """A render.Frame without what is behind it: [H, W, 4] uint8 sRGB, not multiplied by alpha."""
    alpha = frame.alpha[..., None]
    straight = np.divide(frame.color, alpha, out=np.zeros_like(frame.color), where=alpha > 0)
    return _bytes(np.dstack([to_encoded(np.clip(straight, 0, 1)), np.clip(alpha, 0, 1)]))


def _bytes(picture):
    return (picture * 255 + 0.5).astype(np.uint8)


def write_video(avatar, take, settings, output, note, key, sound=None, progress=None, work=None):
    """Play a take into a video file; an interrupted one goes on where it stopped.

    Args:
        avatar: runtime.avatar.Avatar; take: formats.livelink.Take; settings: RenderSettings.
        output: .mp4, .webm or, with alpha, .mov; replaced when complete.
        note: formats.video.Note.
        key: what the bundle and the program are, for telling finished parts from stale ones.
        sound: clip whose sound is laid under it, or None.
        progress: called with (step, done, total).
        work: folder for finished parts, kept; None uses a hidden one and clears it.

    Raises:
        InputError: the ending, the range or the sound cannot be used.
    """
    kind = video.kind_of(output)
    settings = replace(settings, film=kind != video.ALPHA)
    player = AnimationPlayer(avatar, take, settings)
    key = key_of(key, digest(format_take(take)), asdict(settings))
    with work_folder(output, work) as kept:
        heard = None if sound is None else video.read_sound(sound, kind, kept.folder)
        film(player, output, note, key, kept, heard, progress, settings.codec)
    return player


def film(
    player, output, note, key, kept, heard=None, progress=None, asked=video.CODECS[0]
):  # fmt: skip
    """Write what a player draws into a video file, part after part.

    Args:
        player: with `count` frames, `rate` frames a second, `first` (frames of the sound before
            them), `size` (width, height) and `pictures(indices)`.
        output: .mp4 or .webm; note: formats.video.Note.
        key: what the pictures are made from.
        kept: formats.work.Work, which holds the finished parts.
        heard: sound from `video.read_sound`, or None.
        progress: called with (step, done, total).
        asked: how it is coded, of `video.CODECS`.
    """
    kind = video.kind_of(output)
    codec = video.codec_of(kind, asked)
    key = key_of(key, kind, codec)
    progress = progress or (lambda step, done, total: None)
    parts = []
    for first in range(0, player.count, PART):
        indices = range(first, min(first + PART, player.count))

        def counted(indices=indices):
            for index, picture in zip(indices, player.pictures(indices)):
                progress("animate", index, player.count)
                yield picture

        name = f"{first:08d}"
        kept.step(
            name,
            key,
            lambda: video.encode(counted(), kind, player.rate, codec),
            lambda data: None,
        )
        parts.append(kept.folder / name)
        progress("animate", indices[-1] + 1, player.count)
    start = player.first / player.rate
    video.join(output, parts, kind, player.rate, player.size, note, heard, start)


def write_frames(avatar, take, settings, sequence, note, key, progress=None, work=None):
    """Play a take into PNG files; an interrupted run goes on where it stopped.

    A frame has the number that it has in the whole take at this rate, from 0. They appear when all
    are drawn; frames of the same name that were there before are gone then.

    Args:
        sequence: formats.sequence.Sequence; the others as in `write_video`.

    Raises:
        InputError: the range cannot be used, or the disk is full.
    """
    settings = replace(settings, film=False)
    player = AnimationPlayer(avatar, take, settings)
    key = key_of(key, digest(format_take(take)), asdict(settings), asdict(note), "png")
    progress = progress or (lambda step, done, total: None)
    with work_folder(sequence.path(0), work) as kept:
        names = [f"{player.first + index:08d}.png" for index in range(player.count)]
        left = [index for index, name in enumerate(names) if kept.get(name, key) is None]
        pictures = player.pictures(left, lambda picture: png(picture, note))
        progress("animate", player.count - len(left), player.count)
        for done, (index, data) in enumerate(zip(left, pictures), player.count - len(left) + 1):
            kept.put(names[index], key, data)
            progress("animate", done, player.count)
        older = set(sequence.found())
        for index, name in enumerate(names):
            path = sequence.path(player.first + index)
            older.discard(path)
            if work is None:
                os.replace(kept.folder / name, path)
            else:
                write_bytes(path, (kept.folder / name).read_bytes())
        for path in older:
            path.unlink()
    return player
