"""Training pairs of eyes and mouths from single photographs.

A photo that shows teeth or eyes is painted as it stands there, in its own fit, and is its own target. The
network is given what a bake gives it: the shaded geometry of teeth and eyes on the photo's own texture.
Some mouths are hidden from the bake, whose texture has likely teeth then. The loss counts between the lips and
in the eyes alone: skin is the photo's own there and would teach nothing.
"""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np

from bakery.bake.options import BuildOptions
from bakery.bake.subject import FittedSubject, Observation
from bakery.errors import BakeryError
from bakery.formats.image import read_photo
from bakery.formats.portraits import landmarks_of
from bakery.generators.interior import FRAME_SCALE, interior_shade
from bakery.generators.shade import is_part
from bakery.geometry.encode import decode, encode
from bakery.geometry.fill import normalized_blur
from bakery.heads.base import MOUTH, HeadModel
from bakery.landmarks import EYES, LIPS_INNER, LIPS_OUTER, open_mouth
from bakery.stages.face_frame import blotted, cut, face_frame
from bakery.stages.segment import occlusion
from bakery.synth.pairs import NAME, PaintedPair, write_shard
from bakery.train.real_pairs import pair_of

HIDDEN = 3  # of every so many open mouths one is hidden from the fit, as that of a person who shuts it is
EDGE = 2  # pixels that the loss counts beyond the inner lips and the lids, of a frame of 512
TONE = 1.2  # mm: what is finer than such a blur are edges of teeth, not their tone
DETAIL, DARK = (0.25, 3.0), 2e-3  # range of the edges' factor; linear
BARE = 0.02  # of the region of the eyes: so little may be called glasses


def with_edges(target: np.ndarray, pair: PaintedPair) -> np.ndarray:
    """A target [S, S, 3] uint8 whose mouth has the tone of the photo and the edges of the geometry.

    A person's teeth stand elsewhere than the head's. A network that minimises the error of pixels answers
    with their mean, a bar. So what is finer than TONE comes from the shaded geometry.
    """
    per_mm = FRAME_SCALE * pair.part.shape[0]
    inside = is_part(pair.part, *MOUTH)
    if not inside.any():
        return target
    shade = interior_shade(pair, per_mm)[..., None]
    shaded, truth = decode(pair.deformed) * shade, decode(target)
    known = inside.astype(np.float32)
    coarse, tone = (normalized_blur(light, known, TONE * per_mm) for light in (shaded, truth))
    detail = np.clip(shaded / np.maximum(coarse, DARK), *DETAIL)
    made = encode(np.clip(tone * detail, 0, 1))
    return np.where(inside[..., None], made, target)


def interior_pair(
    fitted: FittedSubject, seen: Observation, number: int, mouth: bool, eyes: bool
) -> PaintedPair:
    """A person as their own photo shows them, whose loss counts in mouth and eyes only.

    Args:
        fitted: of the photo, whose mouth may be hidden from it.
        seen: what the photo shows, in the frame of `fitted`.
        number: of the subject.
        mouth, eyes: which of them count.
    """
    pair, points = pair_of(fitted, seen, number), seen.points
    counts = np.zeros(pair.part.shape, np.uint8)
    rings = [LIPS_INNER] * mouth + [*EYES] * eyes
    for ring in rings:
        cv2.fillPoly(counts, [np.round(points[ring] * 16).astype(np.int32)], 255, shift=4)
    if mouth:  # the geometry's own mouth, where the fitted lips stand apart from the photo's
        lips = np.zeros_like(counts)
        cv2.fillPoly(lips, [np.round(points[LIPS_OUTER] * 16).astype(np.int32)], 255, shift=4)
        counts[(lips > 0) & is_part(pair.part, *MOUTH)] = 255
    counts = cv2.dilate(counts, np.ones((2 * EDGE + 1, 2 * EDGE + 1), np.uint8))
    counts = cv2.GaussianBlur(counts, (0, 0), EDGE / 2)
    return replace(
        pair,
        target=with_edges(pair.target, pair),
        face=np.minimum(counts, seen.face),
    )


def write_interiors(
    photos: Mapping[Path, np.ndarray],
    head: HeadModel,
    output: Path,
    options: BuildOptions | None = None,
) -> Iterator[tuple[Path, str | None]]:
    """Write one shard a photo: its mouth where lips stand apart, its eyes where no glasses cover them.

    A photo whose shard is there already is passed over, so an interrupted run goes on.

    Args:
        photos: path -> points [478, 2] pixels.
        head: HeadModel.
        output: folder of the shards.
        options: BuildOptions.

    Yields:
        path, and why the photo is left out or None.
    """
    for number, (path, points) in enumerate(photos.items()):
        shard = Path(output) / NAME.format(number)
        if shard.exists():
            continue
        mouth = open_mouth(points)
        hidden = mouth and number % HIDDEN == 0
        try:
            photo = read_photo(path)
            given = replace(photo, encoded=blotted(photo.encoded, points)) if hidden else photo
            fitted = FittedSubject(path, landmarks_of(points), head, options, photo=given)
        except BakeryError as error:
            yield path, str(error)
            continue
        eyes = occlusion(fitted.segmentation, points)["glasses"] < BARE
        if not (mouth or eyes):
            yield path, "glasses before the eyes, and lips closed"
            continue
        seen = fitted.neutral
        if hidden:
            affine = face_frame(seen.fit, points, fitted.size)[1]
            seen = replace(seen, picture=cut(photo.encoded, affine, fitted.size))
        pair = interior_pair(fitted, seen, number, mouth, eyes)
        write_shard(shard, [pair], {"person": path.stem})
        yield path, None
