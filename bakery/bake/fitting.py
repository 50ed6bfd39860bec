"""Segment and fit over a portrait, and the person that comes of it."""

import logging
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from bakery.bake.options import BuildOptions
from bakery.errors import FitError, InputError
from bakery.formats import record
from bakery.formats.work import key_of
from bakery.heads.base import HeadModel
from bakery.heads.lashes import with_lashes
from bakery.heads.outline import outline_offsets
from bakery.landmarks import face_size
from bakery.stages import assess
from bakery.stages.detect import detect_faces
from bakery.stages.fit import Face, fit, prepare
from bakery.stages.fit.lids import close_lids
from bakery.stages.fit.outline import Seen, fit_outline
from bakery.stages.fit.rest import (
    RestShape,
    at_rest,
    corner_moves,
    load_rest_shape,
    presence,
    rest_moves,
    resting_moves,
    resting_weights,
    with_resting,
)
from bakery.stages.fit.teeth import place_teeth, shown_mouth, teeth_offsets
from bakery.stages.fit.warp import residual_offsets
from bakery.stages.segment import Segmentation, segment
from bakery.stages.texture import TextureOptions
from bakery.stages.texture.tongue import seat_tongue
from bakery.types import Fit, Landmarks, Photo

log = logging.getLogger(__name__)


def segment_portrait(photo: Photo, landmarks: Landmarks, options: BuildOptions) -> Segmentation:
    """What each pixel of the photo shows."""
    return segment(photo.encoded, landmarks.points, options.segment)


def fit_portrait(
    path: Path | str,
    photo: Photo,
    landmarks: Landmarks,
    head: HeadModel,
    options: BuildOptions | None = None,
    segmentation: Segmentation | None = None,
) -> tuple[Fit, Segmentation]:
    """Segment the photo, unless that was done, and fit the head.

    Raises:
        FitError: see `stages.fit.fit`; ModelError: see `rested`.
    """
    options = options or BuildOptions()
    try:
        if segmentation is None:
            segmentation = segment_portrait(photo, landmarks, options)
        prepare(head, options.fit)  # what all fits of a head share is not the time of one
        found = fit(photo, landmarks, head, options.fit, segmentation.skin)
    except FitError as error:
        raise FitError(f"{path}: {error}") from error
    (found,) = rested(head, [replace(found, head_sha256=head.digest)], options.texture)
    face = Face(photo, landmarks, labels=segmentation.labels)
    fits = outlined(head, [found], [face], options)
    return toothed(head, fits, [face], options)[0], segmentation


def rested(head: HeadModel, fits: Sequence[Fit], options: TextureOptions) -> list[Fit]:
    """The fits of one person's photos, and how their neutral head comes to rest (`Fit.rest`, `Fit.resting`).

    Photos that share a neutral head share what is known of it: one that rests leaves nothing to
    take off. Nothing is known of other heads than the one that the basis was learned with.

    Raises:
        ModelError: the basis is missing or damaged.
    """
    if options.neutral == "keep":
        return list(fits)
    basis = load_rest_shape()
    if head.name != basis.head:
        return list(fits)
    moved = [presence(head, one.expression) for one in fits]
    kept = [
        resting_weights(head, fitted_neutral(head, one), one.expression, sure)
        for one, sure in zip(fits, moved)
    ]
    resting, sure = np.min(kept, axis=0), min(moved)
    return [
        with_resting(replace(one, rest=sure * _moves_to_rest(head, basis, one)), resting)
        for one in fits
    ]


def _moves_to_rest(head: HeadModel, basis: RestShape, fit: Fit) -> np.ndarray:
    """How the landmarks of a neutral head come to rest: [468, 3] mm."""
    moves = rest_moves(basis, fit.expression, fit.residual)
    points = head.landmarks(fitted_neutral(head, fit))[: len(moves)]
    out: np.ndarray = moves + corner_moves(points + moves)
    return out


def outlined(
    head: HeadModel, fits: Sequence[Fit], faces: Sequence[Face], options: BuildOptions
) -> list[Fit]:
    """The fits of one person's photos with one outline (`Fit.outline`), by the labels of the photos.

    Args:
        faces: of the photos; those without labels say nothing.
    """
    seen = [
        Seen(fit, _as_photographed(head, fit), face.labels, face.landmarks.points)
        for fit, face in zip(fits, faces)
        if face.labels is not None
    ]
    if not (options.fit.outline and seen):
        return list(fits)
    outline = fit_outline(head, seen)
    return [replace(fit, outline=outline) for fit in fits]


def toothed(
    head: HeadModel, fits: Sequence[Fit], faces: Sequence[Face], options: BuildOptions
) -> list[Fit]:
    """The fits of one person's photos with upper teeth where photos show them (`Fit.teeth`)."""
    if not options.fit.teeth:
        return list(fits)
    mouths = [
        shown_mouth(head, fitted_neutral(head, fit), fit, face.photo, face.landmarks.points)
        for fit, face in zip(fits, faces)
    ]
    teeth = place_teeth([mouth for mouth in mouths if mouth is not None])
    return [replace(fit, teeth=teeth) for fit in fits]


def _as_photographed(head: HeadModel, fit: Fit) -> np.ndarray:
    """The head [V, 3] mm with the photo's expression and gaze."""
    return head.vertices(fitted_neutral(head, fit), fit.expression, fit.gaze)


def fitted_neutral(head: HeadModel, fit: Fit) -> np.ndarray:
    """The neutral shape [V, 3] mm that was fitted, with all of its offsets, not yet at rest."""
    offsets = residual_offsets(head, fit.residual)
    if fit.resting.any():
        offsets = offsets + resting_moves(head, fit.resting)
    if fit.outline.any():
        offsets = offsets + outline_offsets(head, fit.outline)
    shape = head.neutral(fit.identity, offsets)
    return shape + teeth_offsets(head, shape, fit.teeth) if fit.teeth.any() else shape


def with_parts_of(fit: Fit, mine: Fit) -> Fit:
    """A fit of another photo, with outline and teeth of the person's own fit: one photo tells them, another may not."""
    return replace(fit, outline=mine.outline, teeth=mine.teeth)


def resting_head(head: HeadModel, fit: Fit) -> tuple[HeadModel, np.ndarray]:
    """The head whose lids close on this person's eyes, and its neutral shape [V, 3] mm, at rest."""
    head, neutral = at_rest(head, fitted_neutral(head, fit), fit)
    return close_lids(head, neutral), neutral


def own_head(head: HeadModel, fit: Fit) -> tuple[HeadModel, np.ndarray]:
    """The head as this person has it, and its neutral shape [V, 3], at rest.

    Its lids close on the eyes, its tongue makes room for itself, and lashes and tear lines stand
    behind the vertices of `head`.
    """
    head, neutral = resting_head(head, fit)
    return with_lashes(seat_tongue(head, neutral), neutral)


def check_head(where: Path | str, fit: Fit, head: HeadModel) -> None:
    """Refuse a fit of another head.

    Raises:
        InputError: the head's numbers are not those that were fitted.
    """
    same = fit.head_sha256 == head.digest if fit.head_sha256 else fit.head == head.name
    if not same:
        raise InputError(
            f"{where}: a fit of another head ('{fit.head}'), this one is '{head.name}' in another "
            "version or by another name; give its --head, or fit again"
        )


def check_same_face(where: Path | str, fit: Fit, landmarks: Landmarks) -> None:
    """Refuse a fit of another face of the same photo.

    Raises:
        InputError: the fit lies farther from the landmarks than the outer eye corners are apart;
            a poor fit of the same face is off by a tenth of that.
    """
    apart = np.linalg.norm(fit.landmarks_projected - landmarks.points, axis=1)
    if np.median(apart) > face_size(landmarks.points):
        raise InputError(
            f"{where}: a fit of another face than the one that is taken, {np.median(apart):.0f} "
            "pixels off; give the --face that was fitted, or fit again"
        )


def made_from(photo: Photo, landmarks: Landmarks, fit: Fit, head: HeadModel) -> str:
    """SHA-256 over what textures are painted from, besides options and generator."""
    table = record.fit_to_table(fit)
    parts = [table[name] for name in ("camera", "identity", "expression", "gaze", "light")]
    points = np.round(landmarks.points, 3).tolist()
    warps = [table["residual"], table.get("rest")]
    # As keys were before there were these.
    warps += [table[name] for name in ("outline", "resting", "teeth") if name in table]
    return key_of(photo.sha256, points, parts, *warps, head.digest)


def examine(
    path: Path | str,
    photo: Photo,
    landmarks: Landmarks,
    fit: Fit,
    segmentation: Segmentation,
    options: BuildOptions,
    strict: bool,
    given: bool = False,
) -> list[assess.Finding]:
    """Measure what may spoil the avatar, and say so; with `strict`, refuse it.

    Args:
        given: whether the landmarks came from a file; they are compared with detected ones.

    Raises:
        InputError: with `strict`, what was found.
    """
    seen = detect_faces(photo.encoded) if given else ()
    findings = assess.assess(photo, landmarks, fit, segmentation, options.assess, seen)
    lines = [
        f"{found.message} ({found.code} {found.value:g}, limit {found.limit:g})"
        for found in findings
    ]
    if strict and lines:
        raise InputError(
            f"{path}: {'; '.join(lines)}; give another portrait, or leave out --strict"
        )
    for line in lines:
        log.warning("%s: %s", path, line)
    return findings
