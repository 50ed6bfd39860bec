"""A person photographed in neutral, ready to be painted as other photographs show them."""

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from bakery.bake.fitting import (
    fit_portrait,
    fitted_neutral,
    own_head,
    resting_head,
    with_parts_of,
)
from bakery.bake.options import BuildOptions
from bakery.formats.image import read_photo
from bakery.formats.portraits import landmarks_of
from bakery.generators.channels import NONE, Channels, condition_channels, shrunk_channels
from bakery.geometry.fill import smoothstep
from bakery.hair.base import Hair
from bakery.hair.layer import HairLayer
from bakery.heads.base import PARTS, HeadModel
from bakery.stages.condition import SIZE, condition, finer
from bakery.stages.face_frame import cut, face_frame
from bakery.stages.fit.rest import played_back, played_on
from bakery.stages.segment import HAIR, Segmentation
from bakery.stages.texture.hair import mattes_of
from bakery.stages.texture.hairline import beside_mesh
from bakery.stages.texture.neutral import SkinView, prepare, unwrap_skin
from bakery.stages.texture.rest import rest_of
from bakery.types import Camera, Conditions, Fit, Landmarks, Photo


@dataclass(frozen=True, eq=False)
class Observation:
    """One photo of a person, seen in the frame that pairs have."""

    # Of the photo's fit, with the texture of the neutral photo, drawn finer than the frame.
    conditions: Conditions
    camera: Camera  # of the frame
    channels: Channels
    picture: np.ndarray  # [S, S, 3] float32 sRGB-encoded: the photo itself
    face: np.ndarray  # [S, S] uint8: skin, eyes and mouth, no hair
    points: np.ndarray  # [L, 2] pixels
    fit: Fit

    @property
    def head_only(self) -> np.ndarray:
        """The photo where the head is drawn: [S, S, 3] uint8, 0 elsewhere."""
        return _bytes(self.picture * (self.channels.part != NONE)[..., None])


class FittedSubject:
    """A person photographed in neutral, ready to be paired with other photographs."""

    def __init__(
        self,
        path: Path,
        landmarks: Landmarks,
        head: HeadModel,
        options: BuildOptions | None = None,
        size: int = SIZE,
        photo: Photo | None = None,
        hair: Hair | None = None,
    ) -> None:
        """Fit and unwrap the neutral photo.

        Args:
            path: the neutral photo.
            landmarks: its Landmarks.
            head: HeadModel.
            options: BuildOptions.
            size: pixels a side of the frames.
            photo: the Photo, if it was read already.
            hair: what makes the hair; None makes the layer on the skin alone, which trains networks.

        Raises:
            FitError, InputError: the photo cannot be used.
        """
        hair = hair or HairLayer()
        self.options, self.size, self.model = options or BuildOptions(), size, head
        photo = photo or read_photo(path)
        fit, segmentation = fit_portrait(path, photo, landmarks, head, self.options)
        self.segmentation = segmentation
        self.head, neutral = resting_head(head, fit)  # no generator draws lashes
        mattes = mattes_of(photo.encoded, segmentation, landmarks.points)
        resolution = self.options.texture.resolution
        prepared = prepare(
            photo, landmarks, fit, neutral, self.head, mattes, resolution, hair.layer,
            rest=rest_of(self.options.texture), method=self.options.texture.complete,
        )  # fmt: skip
        self.subject = prepared.subject
        self.hair_mesh = hair.mesh(photo, segmentation, fit, self.head, neutral)
        self.hair = beside_mesh(prepared.hair, self.hair_mesh, self.head, neutral, fit.camera)
        self.shape = neutral
        self.neutral = self._observation(photo, landmarks.points, fit, segmentation, neutral)

    def observe(self, path: Path, landmarks: Landmarks) -> Observation:
        """Another photo of this person: Observation."""
        return self.observe_both(path, landmarks)[1]

    def observe_both(self, path: Path, landmarks: Landmarks) -> tuple[Observation, Observation]:
        """Another photo of this person, with two heads moved by its weights.

        Returns:
            Observation with the head of the neutral photo, as an avatar is driven, and with the
            photo's own head, whose warp carries what the weights cannot say.
        """
        photo = read_photo(path)
        fit, segmentation = fit_portrait(path, photo, landmarks, self.model, self.options)
        played = played_on(fit, self.neutral.fit.resting)
        driven, own = (
            self._observation(photo, landmarks.points, seen, segmentation, neutral)
            for seen, neutral in ((played, self.shape), (fit, self.own_shape(fit)))
        )
        return driven, own

    def own_shape(self, fit: Fit) -> np.ndarray:
        """The neutral shape [V, 3] mm that this person's expressions bring to another fit's shape."""
        mine = self.neutral.fit
        back = played_back(self.model, fitted_neutral(self.model, mine), mine, fit.expression)
        other = with_parts_of(fit, mine)
        theirs: np.ndarray = fitted_neutral(self.model, other) + back
        return theirs

    def _observation(
        self,
        photo: Photo,
        points: np.ndarray,
        fit: Fit,
        segmentation: Segmentation,
        neutral: np.ndarray,
    ) -> Observation:
        camera, affine = face_frame(fit, points, self.size)
        drawn = condition(
            self.head, neutral, self.subject.texture, fit.expression, fit.gaze, finer(camera)
        )
        channels = shrunk_channels(condition_channels(self.head, drawn), self.size)
        hair = cut(np.asarray(segmentation.regions == HAIR, np.float32), affine, self.size)
        skin = cut(segmentation.skin.astype(np.float32), affine, self.size)
        inner = (channels.part != NONE) & (channels.part != PARTS.index("skin"))
        clear = np.where(inner, 1, smoothstep(0.3, 0.9, skin)) * (1 - hair)
        # The border of hair and of the photo's own outline is not trusted either.
        clear = cv2.erode(clear.astype(np.float32), np.ones((5, 5)))
        return Observation(
            drawn,
            camera,
            channels,
            cut(photo.encoded, affine, self.size),
            _bytes(channels.face / 255 * clear),
            points @ affine[:, :2].T + affine[:, 2],
            fit,
        )


def photographed_skin(
    path: Path, points: np.ndarray, head: HeadModel, resolution: int
) -> tuple[HeadModel, SkinView]:
    """The skin that a photo shows, by its points [478, 2], and the head as this person has it.

    Raises:
        FitError, InputError: the photo cannot be used.
    """
    photo, landmarks = read_photo(path), landmarks_of(points)
    fit, segmentation = fit_portrait(path, photo, landmarks, head)
    own, neutral = own_head(head, fit)
    mattes = mattes_of(photo.encoded, segmentation, landmarks.points)
    return own, unwrap_skin(photo, landmarks, fit, neutral, own, mattes, resolution)


def _bytes(values: np.ndarray) -> np.ndarray:
    scaled: np.ndarray = np.round(np.clip(values, 0, 1) * 255)
    return scaled.astype(np.uint8)
