"""The generators against each other and against simple baselines, on people nothing was trained on.

Each person's smiling photo is painted from the neutral one: shape and colour of the neutral photo,
moved by the weights, gaze and camera of the smiling photo's fit, as a user drives an avatar. Beside it
stands the kinder figure with the target's own geometry: identity and warp of the smiling photo's fit,
which carry what the weights cannot say. The same picture is scored as `evaluate avatar` does.
"""

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from bakery.bake.subject import FittedSubject
from bakery.evaluate.avatar import CROP, compare, mean_score, polygon_mask
from bakery.evaluate.generator import motion as generator_motion
from bakery.evaluate.metrics import face_crop, piecewise_affine, psnr, warp_pixels
from bakery.evaluate.report import pairs
from bakery.formats.image import read_photo, write_image
from bakery.formats.livelink import read_take
from bakery.formats.mark import MIXED
from bakery.formats.portraits import landmarks_of
from bakery.generators.channels import NONE
from bakery.generators.identity import features_of
from bakery.generators.shade import is_part
from bakery.generators.steady import SteadyGenerator
from bakery.geometry.color import to_encoded
from bakery.geometry.fill import diffuse
from bakery.geometry.sample import bilinear, interpolate
from bakery.hair.cards import CardHair
from bakery.landmarks import EYES, FACE
from bakery.runtime.blend import lay_hair
from bakery.runtime.hair_cards import over_picture
from bakery.runtime.render import GRAY
from bakery.stages.condition import shrunk
from bakery.train.subjects import TRAINING

DELTA_TEXELS = 256  # side of the map that carries another person's change
LOOKALIKE = 48  # pixels a side of the pictures that people are told alike by


@dataclass(frozen=True)
class Result:
    """One person, painted in several ways."""

    name: str
    teeth: bool
    scores: dict  # way -> avatar.Score
    own_geometry: dict  # the same with the target's own geometry
    eyes: dict  # way -> dB inside both lids
    pictures: dict  # way -> [CROP, CROP, 3] sRGB-encoded, "photo" and "truth" among them
    face: np.ndarray  # [CROP, CROP] 0..1, skin, eyes and mouth in the truth


def measure(pair, head, painters, delta=None):
    """Paint one person's smile in every way and score it.

    Args:
        pair: avatar_pairs.Pair.
        head: HeadModel.
        painters: {name: Generator}.
        delta: another person's change on the atlas (`smile_delta`), or None.

    Returns:
        Result; beside the painters there are `static`, the deformed neutral as it is, `warp`, the
        neutral photo warped by the true landmarks, and `delta`.
    """
    points = landmarks_of(pair.neutral_points)
    fitted = FittedSubject(pair.neutral, points, head, size=CROP, hair=CardHair())
    driven, target = fitted.observe_both(pair.smiling, landmarks_of(pair.smiling_points))
    made = paint_all(fitted, driven, painters, head, delta)
    face, truth, points = target.face / 255, target.picture, target.points
    lids = eye_mask(points)

    def scored(pictures):
        return {name: compare(one, truth, points, face) for name, one in pictures.items()}

    return Result(
        pair.name,
        pair.teeth,
        scored(made),
        scored(paint_all(fitted, target, painters, head, delta)),
        {name: psnr(picture, truth, lids) for name, picture in made.items()},
        {"photo": fitted.neutral.picture} | made | {"truth": truth},
        face,
    )


def paint_all(fitted, observation, painters, head, delta=None):
    """One person's smile in every way of `measure`: {way: [CROP, CROP, 3] sRGB-encoded}.

    Args:
        fitted: FittedSubject; observation: Observation, with the head that is to be drawn.
    """
    conditions, neutral = observation.conditions, fitted.neutral
    linear = {
        name: painter.generate(fitted.subject, conditions).image
        for name, painter in painters.items()
    }
    linear["static"] = conditions.deformed_neutral
    seen = (conditions.part != NONE)[..., None]
    uv = interpolate(conditions.fragments, head.uv[head.uv_faces])
    hair = (
        bilinear(fitted.hair, uv * fitted.hair.shape[0])
        * is_part(conditions.part, "skin")[..., None]
    )

    def with_hair(picture):
        bare = np.where(seen, lay_hair(picture, hair), GRAY)
        return over_picture(bare, conditions.depth, conditions.camera, fitted.hair_mesh)

    fine = {name: to_encoded(np.clip(with_hair(picture), 0, 1)) for name, picture in linear.items()}
    made = {name: shrunk(picture, observation.camera) for name, picture in fine.items()}
    made["warp"] = piecewise_affine(
        neutral.picture, neutral.points[:FACE], observation.points[:FACE]
    )
    if delta is not None:
        change = shrunk(bilinear(delta, uv * DELTA_TEXELS) * seen, observation.camera)
        made["delta"] = np.clip(made["static"] + change, 0, 1)
    return made


def eye_mask(points):
    """Boolean [CROP, CROP]: inside the lids of landmarks [L, 2]."""
    return np.maximum(*(polygon_mask(points[ring]) for ring in EYES))


def smile_delta(pair, head):
    """How a person's colours change from the neutral to the smiling photo, on the atlas.

    References:
        Olszewski et al. 2017, table 1: direct transfer of the difference from another subject.

    Returns:
        [DELTA_TEXELS, DELTA_TEXELS, 3] float32, sRGB-encoded difference, smoothly continued where
        the photos did not show the atlas.
    """
    fitted = FittedSubject(pair.neutral, landmarks_of(pair.neutral_points), head, size=CROP)
    observation = fitted.observe(pair.smiling, landmarks_of(pair.smiling_points))
    conditions = observation.conditions
    size = conditions.part.shape[::-1]  # finer than the photo's frame
    use = cv2.resize(observation.face, size) > 128
    difference = (cv2.resize(observation.picture, size) - to_encoded(conditions.deformed_neutral))[
        use
    ]
    uv = interpolate(conditions.fragments, head.uv[head.uv_faces])[use]
    texel = np.clip((uv * DELTA_TEXELS).astype(int), 0, DELTA_TEXELS - 1)
    flat = texel[:, 1] * DELTA_TEXELS + texel[:, 0]
    count = np.bincount(flat, minlength=DELTA_TEXELS**2).astype(np.float32)
    total = np.stack(
        [np.bincount(flat, difference[:, k], DELTA_TEXELS**2) for k in range(3)], -1
    ).astype(np.float32)
    mean = total / np.maximum(count, 1)[:, None]
    shape = (DELTA_TEXELS, DELTA_TEXELS)
    return diffuse(mean.reshape(*shape, 3), (count.reshape(shape) > 0).astype(np.float32))


def likeness(pair):
    """A small picture of a neutral face [LOOKALIKE, LOOKALIKE, 3], for telling who looks alike."""
    affine = face_crop(pair.neutral_points, LOOKALIKE, 1.0)
    return warp_pixels(read_photo(pair.neutral).encoded, affine, LOOKALIKE)


def everybody(portraits, head, painters, pictures=None, only=None):
    """Measure every person of london/val; the change that `delta` lends comes from london/train.

    Args:
        portraits: folder of portraits, see `report.pairs`.
        painters: {name: Generator}.
        pictures: folder for side-by-side PNGs, or None.
        only: names of the people, or None for all.

    Yields:
        Result.
    """
    others = pairs(portraits, TRAINING)
    looks = [likeness(pair) for pair in others]
    lent = {}
    for pair in pairs(portraits):
        if only and pair.name not in only:
            continue
        own = likeness(pair)
        nearest = int(np.argmin([((own - look) ** 2).mean() for look in looks]))
        if nearest not in lent:
            lent[nearest] = smile_delta(others[nearest], head)
        result = measure(pair, head, painters, lent[nearest])
        if pictures is not None:
            row = np.concatenate(list(result.pictures.values()), 1)
            write_image(Path(pictures) / f"{pair.name}.png", np.clip(row, 0, 1), mark=MIXED)
        yield result


def flicker(portraits, head, take, painters, only=None, first=60, count=48):
    """Flicker of a take painted from the first person's photo, as `bakery generate` shows it.

    Args:
        painters: {name: Generator}.

    Returns:
        {name: what `generator_motion.flicker` found}.
    """
    chosen = [pair for pair in pairs(portraits) if not only or pair.name in only][0]
    fitted = FittedSubject(chosen.neutral, landmarks_of(chosen.neutral_points), head)
    played = read_take(take)
    return {
        name: generator_motion.flicker(fitted, played, SteadyGenerator(painter), first, count)
        for name, painter in painters.items()
    }


def summary(results):
    """Means over all people and over those who show teeth: {group: {way: figures}}.

    `own_geometry` of a group is the kinder figure, drawn with the target's own geometry.
    """
    out = {}
    groups = {"all": results, "teeth": [result for result in results if result.teeth]}
    for name, group in groups.items():
        ways = [] if not group else list(group[0].scores)
        out[name] = {
            way: vars(mean_score([result.scores[way] for result in group]))
            | {"eyes_psnr": float(np.mean([result.eyes[way] for result in group]))}
            for way in ways
        }
        out[name]["own_geometry"] = {
            way: vars(mean_score([result.own_geometry[way] for result in group])) for way in ways
        }
    return out


def identity(results, network):
    """Cosine of identity features between a painted smile and the true one, and against others'.

    Args:
        network: generators.identity.IdentityNet.

    Returns:
        {way: {"same", "other": mean cosines, "other_most", "nearest": share of the painted smiles
        whose nearest true smile is the person's own}}.
    """

    def features(way):
        faces = [result.pictures[way] * result.face[..., None] for result in results]
        return features_of(network, np.round(np.clip(faces, 0, 1) * 255).astype(np.uint8))

    truth, out = features("truth"), {}
    for way in results[0].scores:
        cosine = features(way) @ truth.T
        other = cosine[~np.eye(len(results), dtype=bool)]
        out[way] = {
            "same": float(np.diag(cosine).mean()),
            "other": float(other.mean()) if len(other) else 0.0,
            "other_most": float(other.max()) if len(other) else 0.0,
            "nearest": float((cosine.argmax(1) == np.arange(len(results))).mean()),
        }
    return out
