"""Several photos of one person: that they may be, the fits of all, and which of them leads."""

import logging
from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations
from pathlib import Path

import numpy as np

from bakery.bake.fitting import fitted_neutral, outlined, rested, toothed
from bakery.bake.options import BuildOptions
from bakery.errors import FitError, InputError
from bakery.formats.ingredient import note_of, says_ai
from bakery.heads.base import HeadModel
from bakery.landmarks import FACE, face_size
from bakery.stages.fit import Face, fit, fit_together, prepare
from bakery.types import Fit, Photo

log = logging.getLogger(__name__)
# Distance of the heads that two photos alone give, in outer-eye-corner distances. Neutral and smiling
# photos of one person: median 0.010, at most 0.023 (82 people); of two people: median 0.023.
UNLIKE = 0.03
# What leads away from the best photo by as much: degrees of turn, sum of weights, sharpness, pixels.
TURN, WEIGHTS, SHARP, SIZE = 15.0, 1.0, 0.05, 300.0
ENOUGH_SHARP, ENOUGH_LARGE = 0.1, 500.0


def check_photos(paths: Sequence[Path], photos: Sequence[Photo]) -> None:
    """Refuse a photo that is given twice.

    Raises:
        InputError: two files hold the same picture.
    """
    for (first, one), (second, two) in combinations(zip(paths, photos), 2):
        if one.sha256 and one.sha256 == two.sha256:
            raise InputError(f"{first} and {second}: the same photo twice; give each photo once")


def tell_marks(paths: Sequence[Path], photos: Sequence[Photo]) -> None:
    """Warn of photos that say that they are AI-made; their own marks go into the manifest."""
    for path, photo in zip(paths, photos):
        if says_ai(photo.ingredient):
            log.warning("%s: %s; the manifest keeps its mark", path, note_of(photo.ingredient))


def fit_person(
    paths: Sequence[Path], faces: Sequence[Face], head: HeadModel, options: BuildOptions
) -> list[Fit]:
    """The fits of several photos of one person, with one identity, warp and outline.

    Warns of two people.

    Args:
        paths: what messages call the photos.

    Raises:
        FitError: a photo cannot be fitted; InputError: a photo is given twice; ModelError: see
            `rested`.
    """
    check_photos(paths, [face.photo for face in faces])
    prepare(head, options.fit)
    alone = []
    for path, face in zip(paths, faces):
        try:
            by_points = replace(options.fit, photometric=False)
            alone.append(fit(face.photo, face.landmarks, head, by_points))
        except FitError as error:
            raise FitError(f"{path}: {error}") from error
    for (first, one), (second, two) in combinations(zip(paths, alone), 2):
        apart = distance(head, one, two)
        if apart > UNLIKE:
            log.warning(
                "%s and %s: their heads differ by %.3f of the eyes' distance, photos of one person "
                "by %.3f at most; if these are two people, bake each alone",
                first, second, apart, UNLIKE,
            )  # fmt: skip
    together = fit_together(faces, head, options.fit)
    known = [replace(found, head_sha256=head.digest) for found in together]
    fits = outlined(head, rested(head, known, options.texture), faces, options)
    return toothed(head, fits, faces, options)


def distance(head: HeadModel, one: Fit, two: Fit) -> float:
    """How far the neutral landmarks of two fits lie apart, outer-eye-corner distances."""
    first, second = (head.landmarks(fitted_neutral(head, fit))[:FACE] for fit in (one, two))
    apart = (first - first.mean(0)) - (second - second.mean(0))
    return float(np.sqrt((apart**2).sum(1).mean()) / face_size(first))


def leading(fits: Sequence[Fit]) -> int:
    """Which of the photos of one person to paint from: frontal, neutral, sharp, large."""

    def faults(found: Fit) -> float:
        about = found.diagnostics
        turn = float(np.hypot(about["yaw"], about["pitch"]))
        return (
            turn / TURN
            + about["expression_sum"] / WEIGHTS
            + max(0.0, ENOUGH_SHARP - about["sharpness"]) / SHARP
            + max(0.0, ENOUGH_LARGE - about["face_height"]) / SIZE
        )

    return int(np.argmin([faults(found) for found in fits]))
