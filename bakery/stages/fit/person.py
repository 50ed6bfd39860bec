"""One person in several photos: what they share, identity and warp, from all at once.

    points of each photo -> identity (poses and expressions eliminated)
                         -> warp (what every photo leaves, as far as it can tell) -> a fit of each

References:
    Thies et al., "Face2Face", CVPR 2016, section 4: one identity for several frames.
    Triggs et al., "Bundle Adjustment - A Modern Synthesis", 1999, section 6.1: block elimination.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bakery import landmarks as marks
from bakery.geometry import camera as cameras
from bakery.geometry import rotation
from bakery.stages.fit import expressions as groups
from bakery.stages.fit.landmarks import (
    LandmarkModel,
    Shape,
    Weights,
    fit_points,
    landmark_terms,
    prior_terms,
    see,
    start_camera,
)
from bakery.types import EXPRESSIONS, Camera

# The warp believes a landmark less the farther the photo's expression moved it: a standard deviation
# of 0.5 mm at rest, and a quarter of the move, which blendshapes miss. In depth, of which one photo
# says nothing and photos from nearly one side little, the linear model is off by about 1 mm.
AT_REST, OF_MOVE, DEPTH = 0.5, 0.25, 1.0


@dataclass(frozen=True, eq=False)
class Shot:
    """The points of one photo, and the lens that they were seen through."""

    points: np.ndarray  # [L, 2] pixels
    confidence: np.ndarray  # [L] 0..1
    focal: float  # pixels
    width: int
    height: int

    def start(self, model: "LandmarkModel | Person") -> Camera:
        """Where the camera is, by the head at rest; see `landmarks.start_camera`."""
        return start_camera(
            model, self.points, self.confidence, self.focal, self.width, self.height
        )


class Person:
    """A LandmarkModel of one identity: only the expression is left to solve for."""

    modes = 0

    def __init__(
        self, model: LandmarkModel, identity: np.ndarray, offsets: np.ndarray | float = 0.0
    ) -> None:
        """
        Args:
            identity: [I].
            offsets: [468, 3] mm, where this person's landmarks lie besides.
        """
        moved = identity[: model.modes] @ model.identity
        self.rest, self.opens, self.twin = model.rest, model.opens[:, :0], model.twin
        self.mean = model.mean + moved.reshape(-1, 3) + offsets
        self.columns = np.ascontiguousarray(model.columns[:, :, model.modes :])
        self.expression = model.expression

    def points(self, shape: Shape) -> np.ndarray:
        """Landmarks [468, 3] mm; see `LandmarkModel.points`."""
        moved: np.ndarray = self.mean + (shape.expression @ self.expression).reshape(-1, 3)
        return moved


def solve_identity(
    model: LandmarkModel,
    shots: Sequence[Shot],
    weights: Weights,
    rounds: int = 6,
    rivals: Sequence[tuple[int, int]] = groups.RIVALS,
) -> np.ndarray:
    """The identity [I] of the one person who is in several photos.

    Each photo's pose and expression are eliminated from the step of the identity, so that what an
    open mouth explains is not taken for a long face. Photos count alike, as one would alone.

    Args:
        rounds: Gauss-Newton steps of the identity.
        rivals: see `landmarks.fit_points`.

    Raises:
        FitError: a photo's points fit no head.
    """
    first = 6
    modes = slice(first, first + model.modes)
    total = model.modes + first
    shapes, placed = [], []
    rest = Shape(np.zeros(len(model.identity)), np.zeros(len(EXPRESSIONS)))
    for shot in shots:
        camera, shape = fit_points(
            model, shot.start(model), rest, shot.points, shot.confidence, weights, 6, rivals
        )
        placed.append(camera)
        shapes.append(shape)
    identity = np.mean([shape.identity for shape in shapes], 0)
    for _ in range(rounds):
        person = Person(model, identity)
        hessian = weights.prior * (
            weights.identity * np.eye(model.modes)
            + weights.rest / len(model.opens) * model.opens.T @ model.opens
        )
        gradient = hessian @ identity[: model.modes]
        for k, shot in enumerate(shots):
            alone = Shape(np.zeros(0), shapes[k].expression)
            placed[k], alone = fit_points(
                person, placed[k], alone, shot.points, shot.confidence, weights, 4, rivals
            )
            shapes[k] = Shape(identity, alone.expression)
            seen = see(model, shot.points, shot.confidence, weights)
            g, h, _ = landmark_terms(model, placed[k], shapes[k], seen, weights)
            prior_g, prior_h, _ = prior_terms(model, shapes[k], weights)
            g[total:] += prior_g[total:]
            h[total:, total:] += prior_h[total:, total:]
            active = np.flatnonzero(shapes[k].expression[groups.FITTED] > 1e-6)
            free = np.concatenate([np.arange(first), total + active])
            across = h[np.ix_(free, np.arange(first, total))]
            solved = np.linalg.solve(h[np.ix_(free, free)], np.column_stack([across, g[free]]))
            hessian += (h[modes, modes] - across.T @ solved[:, :-1]) / len(shots)
            gradient += (g[modes] - across.T @ solved[:, -1]) / len(shots)
        identity = identity.copy()
        identity[: model.modes] -= np.linalg.solve(hessian, gradient)
    return identity


def misses(points: np.ndarray, seen: np.ndarray, camera: Camera) -> tuple[np.ndarray, np.ndarray]:
    """How landmarks would have to move to where they are seen, parallel to the image plane.

    Args:
        points: [468, 3] mm, head space; seen: [468, 2] pixels.

    Returns:
        [468, 3] mm, head space; [468, 2] pixels.
    """
    inside = cameras.to_camera(points, camera)
    miss = seen - cameras.project_camera(inside, camera)
    wanted = np.zeros_like(inside)
    wanted[:, :2] = miss * (-inside[:, 2:] / camera.focal) * [1, -1]
    return wanted @ rotation.matrix(camera.rotation), miss


def shared_moves(
    wanted: Sequence[np.ndarray],
    moved: Sequence[np.ndarray],
    confidence: Sequence[np.ndarray],
    placed: Sequence[Camera],
) -> np.ndarray:
    """The displacement of each landmark that explains all photos best: [468, 3] mm.

    Each photo tells of two directions, those across its line of sight; photos from two sides tell of
    depth too.

    Args:
        wanted: [468, 3] mm of each photo, of `misses`.
        moved: [468] mm of each, how far its expression moves a landmark.
        confidence: [L] of each, 0..1.
        placed: the camera of each.
    """
    left, right = np.zeros((marks.FACE, 3, 3)), np.zeros((marks.FACE, 3))
    for miss, move, sure, camera in zip(wanted, moved, confidence, placed):
        trust = sure[: marks.FACE] ** 2 / (AT_REST**2 + (OF_MOVE * move) ** 2)
        sight = rotation.matrix(camera.rotation)[2]
        across = np.eye(3) - np.outer(sight, sight)
        left += trust[:, None, None] * across
        right += trust[:, None] * (miss @ across)
    mean = np.mean([rotation.matrix(camera.rotation)[2] for camera in placed], 0)
    left += np.outer(mean, mean) / DEPTH**2 / (mean @ mean) + 1e-9 * np.eye(3)
    found: np.ndarray = np.linalg.solve(left, right[:, :, None])[:, :, 0]
    return found
