"""Footage that a face is put into: its frames, whose head stands where in each, and what hides it."""

from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np

from bakery.bake.fitting import own_head
from bakery.formats.stills import Stills
from bakery.formats.video import Clip
from bakery.geometry import camera as cameras
from bakery.geometry.fill import smoothstep
from bakery.heads.base import HeadModel
from bakery.landmarks import FACE, face_size
from bakery.motion.fits import ClipFit
from bakery.motion.gaps import gaps_of
from bakery.motion.track import steady
from bakery.perform.patch import Patch
from bakery.perform.performance import Performance, Shot
from bakery.perform.transfer import Frames, light_in, resting_frames
from bakery.runtime.avatar import Avatar
from bakery.stages.segment import (
    BACKGROUND,
    BROWS,
    CLOTHES,
    EYES,
    GLASSES,
    HAIR,
    HAT,
    LIPS,
    MOUTH,
    THING,
    SegmentOptions,
    segment,
)
from bakery.types import Camera

BEFORE = (
    BACKGROUND,
    HAIR,
    CLOTHES,
    GLASSES,
    HAT,
    THING,
)  # labels of what stays in front of the face
FEATURES = (BROWS, EYES, LIPS, MOUTH)  # of the footage's own face: a second mouth must not show
MARGIN = 0.05  # eye distances, around them
LIT = 3  # frames of a shot whose mean light is taken for the shot's
NEAR = 1.2  # frames, sigma of the smoothing of poses
TURN, PLACE = np.radians(0.7), 0.012  # sigmas in value: radians; eye distances, and shares of depth
LOST = (6.0, 12.0)  # frames from the last seen face over which the replacement fades out
SOFT = 0.012  # of the eye distance, sigma by which the edge of what hides the face is softened


@dataclass(frozen=True, eq=False)
class Standing:
    """Where the footage's head stands in one shot of n frames, smoothed, and who that is."""

    shot: Shot
    fits: ClipFit
    head: HeadModel
    neutral: np.ndarray  # [V, 3] mm
    rotation: np.ndarray  # [n, 3]
    translation: np.ndarray  # [n, 3] mm
    expression: np.ndarray  # [n, E]
    share: np.ndarray  # [n] 0..1: 0 in frames far from any that show the face
    light: np.ndarray  # [9, 3] camera space

    def shape(self, number: int, patch: Patch) -> np.ndarray:
        """The patch's vertices [P, 3] mm in a frame of the shot, from 0."""
        moved = np.tensordot(self.expression[number], patch.at(self.head.expression_basis), 1)
        shape: np.ndarray = patch.at(self.neutral) + moved
        return shape


class Footage:
    """Frames in the size of the film that is made, and the Standing of each shot."""

    def __init__(
        self,
        performance: Performance,
        head: HeadModel,
        reopen: Callable[[], Clip | Stills],
        longest: int | None,
        options: SegmentOptions | None = None,
    ) -> None:
        """
        Args:
            performance: of the footage; head: that it was fitted with.
            reopen: opens it.
            longest: pixels of the longer side of the film; None keeps the footage's.
        """
        self.performance, self.options = performance, options or SegmentOptions()
        seconds = performance.seconds - performance.seconds[0]
        self.middles, self.seconds = (seconds[1:] + seconds[:-1]) / 2, float(seconds[-1])
        self.reopen = reopen
        self.ahead, self.behind = Frames(reopen), Frames(reopen)
        height, width = self.ahead.picture(0).shape[:2]
        self.scale = 1.0 if longest is None else longest / max(width, height)
        self.width, self.height = (max(round(n * self.scale) // 2 * 2, 2) for n in (width, height))
        self.standings = {shot: self._standing(shot, head) for shot in performance.shots}

    def shows(self, seconds: float) -> int:
        """The frame of the footage that is nearest to a time from its beginning."""
        return int(np.searchsorted(self.middles, seconds + 1e-9))

    def sized(self, picture: np.ndarray) -> np.ndarray:
        """A frame [H, W, 3] uint8 in the size of the film."""
        if self.scale != 1:
            how = cv2.INTER_AREA if self.scale < 1 else cv2.INTER_CUBIC
            picture = cv2.resize(picture, None, fx=self.scale, fy=self.scale, interpolation=how)
        right, below = self.width - picture.shape[1], self.height - picture.shape[0]
        if right > 0 or below > 0:
            picture = cv2.copyMakeBorder(
                picture, 0, max(below, 0), 0, max(right, 0), cv2.BORDER_REPLICATE
            )
        return np.ascontiguousarray(picture[: self.height, : self.width])

    def camera(self, fits: ClipFit, rotation: np.ndarray, translation: np.ndarray) -> Camera:
        """The camera of a pose in the size of the film."""
        width, height = (int(n) for n in fits.size)
        whole = Camera(fits.focal, fits.center, rotation, translation, width, height)
        return cameras.crop(whole, 0, 0, self.width, self.height, self.scale)

    def _standing(self, shot, head):
        fits = shot.fits
        if fits is None or not fits.found.any():
            return None
        resting = resting_frames(fits, LIT).tolist()
        own, neutral = own_head(head, fits.fit(resting[0], head))
        frames = Frames(self.reopen)
        lights = [
            light_in(fits.fit(number, head), head, frames.picture(shot.first + number))
            for number in resting
        ]
        rotation, translation = _steady_poses(fits, own, neutral)
        return Standing(
            shot, fits, own, neutral, rotation, translation,
            steady(fits.expression, NEAR, 0.06), _seen(fits.found), np.mean(lights, 0),
        )  # fmt: skip

    def parts(
        self, standing: Standing, number: int, picture: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """How far [H, W] float32 0..1 each pixel of a frame shows something before the face, and
        where [H, W] bool it shows brows, eyes or mouth, with MARGIN.

        Args:
            number: frame of the shot, from 0.
            picture: [H, W, 3] uint8 in the size of the film.
        """
        head, fits = standing.head, standing.fits
        shape = head.vertices(standing.neutral, fits.expression[number], fits.gaze[number])
        camera = self.camera(fits, fits.rotation[number], fits.translation[number])
        points = cameras.project(head.landmarks(shape).astype(np.float64), camera)
        found = segment(np.float32(picture) / 255, points, self.options)
        before = np.isin(found.labels, BEFORE).astype(np.float32)
        soft = cv2.GaussianBlur(before, (0, 0), max(SOFT * face_size(points), 0.6))
        features = np.isin(found.labels, FEATURES).astype(np.uint8)
        wide = 2 * round(MARGIN * face_size(points)) + 1
        return soft, cv2.dilate(features, np.ones((wide, wide), np.uint8)) > 0


def _seen(found):
    """How far [n] 0..1 a face may stand in each frame: not long after it was seen last."""
    away = np.zeros(len(found))
    for first, after in gaps_of(found):
        number = np.arange(first, after)
        before = number - first + 1.0 if first else np.full(len(number), np.inf)
        behind = after - number + 0.0 if after < len(found) else np.full(len(number), np.inf)
        away[first:after] = np.minimum(before, behind)
    return 1 - smoothstep(*LOST, away)


def _steady_poses(fits, head, neutral):
    """Rotations [n, 3] and translations [n, 3] of a shot without the tremble of its points."""
    pivot = head.landmarks(neutral)[:FACE].mean(0).astype(float)
    inside = np.array([
        cameras.to_camera(pivot, fits.camera(number)) for number in range(len(fits.seconds))
    ])  # fmt: skip
    eyes = float(np.median([
        face_size(cameras.project(head.landmarks(neutral).astype(float), fits.camera(number)))
        for number in np.unique(np.linspace(0, len(fits.seconds) - 1, 12).astype(int))
    ]))  # fmt: skip
    turns = steady(fits.rotation, NEAR, TURN)
    depth = -inside[:, 2:]
    places = np.column_stack([inside[:, :2] / depth * fits.focal / eyes, np.log(depth)])
    places = steady(places, NEAR, PLACE)
    depth = np.exp(places[:, 2:])
    inside = np.column_stack([places[:, :2] * depth * eyes / fits.focal, -depth])
    matrices = [cameras.rotation.matrix(turn) for turn in turns]
    return turns, inside - np.array([matrix @ pivot for matrix in matrices])


@dataclass(frozen=True)
class Place:
    """How an avatar stands in for the footage's head: its own space is scaled and moved."""

    scale: float
    move: np.ndarray  # [3] mm, after scaling

    def camera(self, camera: Camera) -> Camera:
        """The camera that shows the avatar where `camera` shows the footage's head."""
        turn = cameras.rotation.matrix(camera.rotation)
        where = (turn @ self.move + camera.translation) / self.scale
        return Camera(
            camera.focal, camera.center, camera.rotation, where, camera.width, camera.height
        )

    def inside(self, shape: np.ndarray) -> np.ndarray:
        """Vertices [P, 3] mm of the footage's head in the avatar's space."""
        moved: np.ndarray = (shape - self.move) / self.scale
        return moved


def place_of(standing: Standing, avatar: Avatar) -> Place:
    """The Place at which the avatar's resting face lies on the footage's (least squares)."""
    theirs = standing.head.landmarks(standing.neutral)[:FACE].astype(float)
    ours = avatar.head.landmarks(avatar.neutral)[:FACE].astype(float)
    apart, own = theirs - theirs.mean(0), ours - ours.mean(0)
    scale = float((apart * own).sum() / (own * own).sum())
    return Place(scale, theirs.mean(0) - scale * ours.mean(0))
