"""A take played by an avatar: pictures in order, and the video they become."""

import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass, replace

import numpy as np

from bakery.errors import InputError
from bakery.formats import video
from bakery.formats.files import digest
from bakery.formats.livelink import format_take
from bakery.formats.work import key_of, work_folder
from bakery.geometry import camera as cameras
from bakery.geometry import rotation
from bakery.geometry.color import to_encoded
from bakery.heads.base import gaze_of
from bakery.runtime.player import Player
from bakery.runtime.render import in_photo, over_photo, portrait_at
from bakery.stages.condition import face_camera
from bakery.stages.fit.gaze import LIMIT

PART = 150  # frames that are encoded together, and lost together by an interruption
FACE_SHARE = 0.6  # of the picture's height that the face takes, as `bakery render` shows it


@dataclass(frozen=True)
class Show:
    """How a take is shown."""

    view: str | tuple[float, float] = "front"  # "photo", "front" or (yaw, pitch) degrees
    size: int = 512  # pixels of the longer side, even
    rate: float | None = None  # frames a second; None is the take's own
    first: int = 0  # frame that is shown first
    last: int | None = None  # one behind the last; None shows all
    dynamic: bool = True  # whether expressions change the texture
    hair: bool = True  # whether the hair layer is shown


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


class Stage:
    """An avatar and a take, ready to give any frame."""

    def __init__(self, avatar, take, show):
        """
        Raises:
            InputError: the range holds no frame, or the photo is wanted and not in the bundle.
        """
        if show.view == "photo" and avatar.photo is None:
            raise InputError("--view photo: the bundle keeps no photo; build it with --keep-photo")
        self.avatar, self.show = avatar, show
        self.rate = show.rate or take.rate
        whole = int(np.floor(take.seconds[-1] * self.rate + 1e-6)) + 1
        last = whole if show.last is None else min(show.last, whole)
        if show.first >= last:
            raise InputError(f"--frames: the take has {whole} frames; begin below that")
        self.count = last - show.first
        self.weights, self.head, eyes = take.at(np.arange(show.first, last) / self.rate)
        gaze = (
            np.array([gaze_of(weights).mean(0) for weights in self.weights])
            if eyes is None
            else eyes.mean(1)
        )
        self.gaze = np.clip(gaze, -LIMIT, LIMIT)
        self.player = Player(avatar, show.hair)
        self.camera = self._camera()
        self.background = None
        if show.view == "photo":
            self.portrait, self.background = portrait_at(avatar, self.camera)
            self.source = in_photo(self.portrait)

    def _camera(self):
        avatar, show = self.avatar, self.show
        size = show.size // 2 * 2
        if show.view != "photo":
            yaw, pitch = (0.0, 0.0) if show.view == "front" else show.view
            return face_camera(
                avatar.fit, avatar.head, avatar.neutral, yaw, pitch, size, FACE_SHARE
            )
        camera = avatar.fit.camera
        scale = size / max(camera.width, camera.height)
        width, height = (max(round(n * scale / 2) * 2, 2) for n in (camera.width, camera.height))
        return cameras.crop(camera, 0, 0, width, height, scale)

    def camera_of(self, index):
        """The camera of a frame: the head's motion is the camera's, seen from the head.

        The photo's own view stays as it is: its background cannot turn.
        """
        if self.show.view == "photo" or not self.head[index].any():
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

    def picture(self, work, index):
        """Frame `index` of those shown: [H, W, 3] uint8 sRGB."""
        expression, gaze = self.weights[index], self.gaze[index]
        camera, dynamic = self.camera_of(index), self.show.dynamic
        if self.background is None:
            return self.player.picture(work, camera, expression, gaze, dynamic)
        frame = self.player.frame(work, camera, expression, gaze, dynamic)
        vertices = self.avatar.neutral.copy()  # the hidden ones rest: nobody sees them
        vertices[self.player.used] = self.player.vertices(expression, gaze)
        over = over_photo(self.portrait, frame, vertices, self.background, self.source)
        picture = to_encoded(over)
        return (picture * 255 + 0.5).astype(np.uint8)

    def pictures(self, indices, threads=None):
        """Yield the pictures of some frames in order, drawn side by side by `threads` threads."""
        threads = threads or os.cpu_count() or 1
        free = [
            self.player.workspace(self.camera.width, self.camera.height) for _ in range(threads)
        ]

        def draw(index):
            work = free.pop()  # as many buffers as threads: there is always one
            try:
                return self.picture(work, index)
            finally:
                free.append(work)

        indices, waiting = iter(indices), []
        with ThreadPoolExecutor(threads) as pool:
            try:
                for index in indices:
                    waiting.append(pool.submit(draw, index))
                    if len(waiting) > 2 * threads:
                        yield waiting.pop(0).result()
                while waiting:
                    yield waiting.pop(0).result()
            finally:
                for task in waiting:
                    task.cancel()


def write_video(avatar, take, show, output, note, key, sound=None, progress=None, work=None):
    """Play a take into a video file; an interrupted one goes on where it stopped.

    Args:
        avatar: runtime.avatar.Avatar; take: formats.livelink.Take; show: Show.
        output: .mp4 or .webm; replaced when complete.
        note: formats.video.Note.
        key: what the bundle and the program are, for telling finished parts from stale ones.
        sound: clip whose sound is laid under it, or None.
        progress: called with (step, done, total).
        work: folder for finished parts, kept; None uses a hidden one and clears it.

    Raises:
        InputError: the ending, the range or the sound cannot be used.
    """
    kind = video.kind_of(output)
    heard = None if sound is None else video.read_sound(sound, kind)
    stage = Stage(avatar, take, show)
    key = key_of(key, digest(format_take(take)), asdict(show), kind)
    progress = progress or (lambda step, done, total: None)
    with work_folder(output, work) as kept:
        parts = []
        for first in range(0, stage.count, PART):
            indices = range(first, min(first + PART, stage.count))

            def counted(indices=indices):
                for index, picture in zip(indices, stage.pictures(indices)):
                    progress("animate", index, stage.count)
                    yield picture

            name = f"{first:08d}"
            kept.step(
                name, key, lambda: video.encode(counted(), kind, stage.rate), lambda data: None
            )
            parts.append(kept.folder / name)
            progress("animate", indices[-1] + 1, stage.count)
        size = (stage.camera.width, stage.camera.height)
        start = show.first / stage.rate
        video.join(output, parts, kind, stage.rate, size, note, heard, start)
    return stage
