"""`--by network`: the generator's own picture of each frame (paGAN section 4), on the avatar's head.

    pose of the frame -> condition -> generate -> steady -> laid over the face of the player's frame

The generator knows a face in a square; hair, ears and neck are the avatar's.
"""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace

import cv2
import numpy as np

from bakery.bake.faces import one_face
from bakery.bake.options import BuildOptions
from bakery.bake.subject import FittedSubject
from bakery.errors import InputError
from bakery.formats.livelink import Take
from bakery.generators.base import Generator
from bakery.generators.channels import face_mask
from bakery.generators.steady import SteadyGenerator
from bakery.geometry import camera as cameras
from bakery.geometry.fill import enclosed
from bakery.heads.base import HeadModel
from bakery.landmarks import FACE
from bakery.motion.animate import AnimationPlayer, RenderSettings
from bakery.parallel import side_by_side
from bakery.runtime.avatar import Avatar
from bakery.runtime.cards import lay_picture
from bakery.runtime.render import Frame
from bakery.show.synthesis import haired
from bakery.stages.condition import FACE_RATIO, SIZE, condition, finer, shrunk
from bakery.types import Camera, Conditions, Generated, Photo


class NetworkPlayer(AnimationPlayer):
    """Draws the frames of a take; the face is what a generator paints of each."""

    def __init__(
        self,
        avatar: Avatar,
        take: Take,
        settings: RenderSettings,
        head: HeadModel,
        painter: Generator,
        named: str,
    ) -> None:
        """
        Args:
            avatar: its photo is kept.
            head: model that is fitted to the photo.
            painter: the generator.
            named: what messages call the portrait.

        Raises:
            BakeryError: the bundle keeps no photo, or its face is not found again.
        """
        super().__init__(avatar, take, settings)
        if avatar.photo is None:
            raise InputError(
                f"{named}: keeps no photo, which --by network paints from; give the portrait itself, or "
                "build the bundle with --keep-photo"
            )
        photo = Photo(np.ascontiguousarray(avatar.photo, np.float32), "")
        _, face = one_face(named, photo=photo)
        self.fitted = FittedSubject(named, face, head, BuildOptions(), photo=photo)
        self.painter, self.steady = painter, SteadyGenerator(painter)

    def square(self, index: int) -> tuple[Camera, float, np.ndarray]:
        """The camera of the generator's picture of a frame, and its scale and corner [2] in the frame's."""
        camera, neutral = self.camera_of(index), self.fitted.subject.neutral
        places = cameras.project(self.fitted.head.landmarks(neutral)[:FACE], camera)
        low, high = places.min(0), places.max(0)
        side = (high[1] - low[1]) / FACE_RATIO
        corner, scale = (low + high - side) / 2, SIZE / side
        return cameras.crop(camera, *corner, SIZE, SIZE, scale), scale, corner

    def generated(self, index: int) -> tuple[int, Conditions, Generated]:
        """What the generator paints of a frame."""
        fitted, (camera, _, _) = self.fitted, self.square(index)
        seen = condition(
            fitted.head, fitted.subject.neutral, fitted.subject.texture, self.weights[index],
            self.gaze[index], finer(camera),
        )  # fmt: skip
        return index, seen, self.painter.generate(fitted.subject, seen)

    def laid(self, work: object, index: int, image: np.ndarray, seen: Conditions) -> Frame:
        """A frame whose face is `image` [h, w, 3] linear, of the conditions `seen`."""
        camera, scale, corner = self.square(index)
        face = face_mask(self.fitted.head, seen).astype(np.float32) / 255
        face[enclosed(face < 1)] = 1
        both = shrunk(np.dstack([image, face]).astype(np.float32), camera)
        # Pixel centres lie at +0.5 in both pictures.
        start = (0.5 - corner) * scale - 0.5
        matrix = np.array([[scale, 0, start[0]], [0, scale, start[1]]])
        whole = self.camera
        soft = both if scale <= 1 else cv2.GaussianBlur(both, (0, 0), 0.4 * scale)
        placed = cv2.warpAffine(
            soft, matrix, (whole.width, whole.height), flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
        )
        pose = self.camera_of(index), self.weights[index], self.gaze[index]
        shape = None if self.stage is None else self.stage.shape_of(index)
        frame = self.player.frame(work, *pose, apart=True, shape=shape)
        share = (placed[..., 3] * frame.face)[..., None]
        color = frame.color * (1 - share) + placed[..., :3] * share
        alpha, over = frame.alpha.copy(), frame.hair
        if self.background is None and over is not None:
            lay_picture(color, alpha, over)
            over = None
        return replace(frame, color=color, alpha=alpha, hair=over)

    def pictures(
        self, indices: Iterable[int], finish: Callable = lambda picture: picture
    ) -> Iterator:
        """As AnimationPlayer's."""
        for index, frame in self._laid(indices):
            yield finish(self.shown(index, frame))

    def rendered(self, indices: Iterable[int]) -> Iterator[Frame]:
        """As AnimationPlayer's."""
        return (frame for _, frame in self._laid(indices))

    def _laid(self, indices):
        work = self.player.workspace(self.camera.width, self.camera.height)
        fitted = self.fitted
        for index, seen, made in side_by_side(self.generated, indices):
            image = self.steady.follow(fitted.head, seen, made).image
            if self.settings.hair:
                image = haired(fitted, seen, image)
            yield index, self.laid(work, index, image, seen)
