"""What a second photo of a person adds: who they are by one photo, by the other, and by both.

By landmarks alone. Every third landmark is held out of a fit and compared afterwards: what a fit says
of places that it was not given.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bakery.bake.fitting import fitted_neutral
from bakery.evaluate.fitting import similarity
from bakery.geometry import camera as cameras
from bakery.heads.base import HeadModel
from bakery.landmarks import FACE, OVAL, face_size
from bakery.stages.fit import (
    Face,
    FitOptions,
    fit,
    fit_together,
    landmark_fit,
    landmark_model,
    shot_of,
)
from bakery.stages.fit.landmarks import Shape
from bakery.stages.fit.lips import seam_offsets
from bakery.stages.fit.person import Person
from bakery.types import EXPRESSIONS, Fit

BY_POINTS = FitOptions(photometric=False)
STEP = 3  # every so many landmarks one is held out
# The contour slides over the head, so no landmark of it says where it should lie.
HELD = np.setdiff1d(np.arange(1, FACE, STEP), OVAL)


def measure(first: Face, second: Face, head: HeadModel) -> dict:
    """Two photos of one person.

    Returns:
        rms over the skin in mm, after the best similarity, between the neutral heads of `alone` (one
        photo and the other), `first_both` and `second_both` (one photo and both together). Mean error of
        a photo's held-out landmarks in percent of the outer-eye-corner distance: `held_one`, the
        person is of the other photo alone, `held_both`, of that and of the rest of this one.
    """
    faces, hidden = [first, second], [without(first), without(second)]
    alone = [fit(face.photo, face.landmarks, head, BY_POINTS) for face in faces]
    both = fit_together(faces, head, BY_POINTS)[0]
    held_one, held_both = [], []
    for here, there in ((0, 1), (1, 0)):
        held_one.append(held_out(_posed(alone[there], hidden[here], head), faces[here]))
        seen = fit_together([faces[there], hidden[here]], head, BY_POINTS)[1]
        held_both.append(held_out(seen, faces[here]))
    return {
        "alone": apart(head, *alone),
        "first_both": apart(head, alone[0], both),
        "second_both": apart(head, alone[1], both),
        "held_one": float(np.mean(held_one)),
        "held_both": float(np.mean(held_both)),
    }


def _posed(found, face, head):
    """A person of another photo, with the camera and expression of this one."""
    shot, _ = shot_of(face)
    person = Person(landmark_model(head, BY_POINTS.modes), found.identity, found.residual)
    rest = Shape(found.identity, np.zeros(len(EXPRESSIONS)))
    camera, shape = landmark_fit(
        head, person, shot.start(person), rest, shot.points, shot.confidence, BY_POINTS
    )
    places = head.landmarks(head.vertices(fitted_neutral(head, found), shape.expression))
    places = places.astype(np.float64)
    places[:FACE] += seam_offsets(person.rest, shot.points)
    return replace(found, landmarks_projected=cameras.project(places, camera))


def without(face: Face) -> Face:
    """The face with the landmarks HELD trusted not at all."""
    sure = np.array(face.landmarks.confidence, np.float64)
    sure[HELD] = 0
    return replace(face, landmarks=replace(face.landmarks, confidence=sure))


def held_out(found: Fit, face: Face) -> float:
    """Mean error of the landmarks HELD, percent of the outer-eye-corner distance."""
    points = face.landmarks.points
    miss = np.linalg.norm(found.landmarks_projected[HELD] - points[HELD], axis=1)
    return float(100 * miss.mean() / face_size(points))


def apart(head: HeadModel, one: Fit, two: Fit) -> float:
    """Rms distance in mm of two neutral heads' skin, after the best similarity."""
    skin = head.part_vertices("skin")
    a, b = (fitted_neutral(head, found)[skin].astype(np.float64) for found in (one, two))
    scale, turn, shift = similarity(a, b)
    return float(np.sqrt(((scale * a @ turn.T + shift - b) ** 2).sum(1).mean()))


def summary(rows: Sequence[dict]) -> dict:
    """Means over people."""
    return {name: round(float(np.mean([row[name] for row in rows])), 3) for name in rows[0]}
