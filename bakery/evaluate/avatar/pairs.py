"""Bake people and render them back: the quality table of the avatars.

`smile` is the avatar as a user drives it: its own head, moved by the weights, gaze and camera of the
smiling photo's fit. `own_geometry` is kinder: drawn with the target's own geometry, as far as the two
fits look like one person (`show.frame.neutral_for`), whose warp carries what the weights cannot say.
"""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from bakery.bake.fitting import fit_portrait, own_head
from bakery.bake.mask import draw_masks
from bakery.bake.textures import paint
from bakery.evaluate.avatar import CROP, compare, mean_score, plain_warp
from bakery.evaluate.metrics import face_crop, hull_mask, psnr, warp_pixels
from bakery.formats.image import read_photo, write_image
from bakery.formats.mark import MIXED
from bakery.formats.portraits import landmarks_of
from bakery.geometry.color import to_encoded
from bakery.hair.cards import CardHair
from bakery.runtime.avatar import Avatar
from bakery.runtime.render import draw, over_gray
from bakery.show import frame as frames


@dataclass(frozen=True)
class Pair:
    """A neutral and a smiling photo of one person."""

    name: str
    neutral: Path
    smiling: Path
    neutral_points: np.ndarray  # [L, 2] pixels
    smiling_points: np.ndarray
    teeth: bool  # whether the smile shows teeth


@dataclass(frozen=True)
class Result:
    """What was measured of one person."""

    name: str
    teeth: bool
    back: float  # dB, neutral avatar in its own photo, inside its face mask
    smile: object  # Score
    own_geometry: object  # Score, with the target's own geometry
    warp: object  # Score of the plain warp


def bake(path, points, head, generator, options, hair=None):
    """An avatar in memory, its hair as `bakery build` makes it unless told: Avatar, Photo, Segmentation."""
    photo = read_photo(path)
    landmarks = landmarks_of(points)
    fit, segmentation = fit_portrait(path, photo, landmarks, head, options)
    textures = paint(
        photo, landmarks, fit, segmentation, head, generator, hair or CardHair(), options
    )
    own, neutral = own_head(head, fit)
    return Avatar(own, neutral, fit, textures, draw_masks(head, options)), photo, segmentation


def measure(pair, head, generator, options, pictures=None):
    """Bake one person from the neutral photo; compare it with both photos.

    Args:
        pictures: folder for side-by-side pictures, or None.

    Returns:
        Result.
    """
    avatar, photo, _ = bake(pair.neutral, pair.neutral_points, head, generator, options)
    fit = avatar.fit
    vertices = avatar.head.vertices(avatar.neutral, fit.expression, fit.gaze)
    # The photo is T_0 itself, whatever its expression: nothing is blended over it.
    frame = draw(avatar, vertices, fit.camera, fit.expression, fit.gaze, dynamic=False)
    inside = np.minimum(frame.alpha, frame.face) > 0.99
    inside &= hull_mask(pair.neutral_points, *photo.encoded.shape[:2])
    own = to_encoded(over_gray(frame))
    back = psnr(own, photo.encoded, inside)

    smiling = read_photo(pair.smiling)
    other, _ = fit_portrait(pair.smiling, smiling, landmarks_of(pair.smiling_points), head, options)
    scene = frames.Scene(other.expression, other.gaze, other, "front", None, True)
    kinder, face = frames.render(avatar, scene)
    driven = avatar.head.vertices(avatar.neutral, other.expression, other.gaze)
    shown = draw(avatar, driven, other.camera, other.expression, other.gaze)
    made = to_encoded(over_gray(shown))
    if pictures is not None:
        row = [
            warp_pixels(np.asarray(picture, np.float32), face_crop(points), CROP)
            for picture, points in (
                (photo.encoded, pair.neutral_points),
                (own, pair.neutral_points),
                (made, pair.smiling_points),
                (smiling.encoded, pair.smiling_points),
            )
        ]
        write_image(Path(pictures) / f"{pair.name}.png", np.concatenate(row, 1), mark=MIXED)
    return Result(
        pair.name,
        pair.teeth,
        back,
        compare(made, smiling.encoded, pair.smiling_points, face),
        compare(kinder, smiling.encoded, pair.smiling_points, face),
        plain_warp(photo.encoded, pair.neutral_points, smiling.encoded, pair.smiling_points, face),
    )


def summary(results):
    """The table's figures: groups "all" and "teeth", avatar and plain warp."""
    out = {"back_psnr": float(np.mean([result.back for result in results]))}
    groups = {"all": results, "teeth": [result for result in results if result.teeth]}
    for name, group in groups.items():
        if group:
            out[name] = {
                "people": len(group),
                "avatar": vars(mean_score([result.smile for result in group])),
                "own_geometry": vars(mean_score([result.own_geometry for result in group])),
                "plain_warp": vars(mean_score([result.warp for result in group])),
            }
    return out


def quick(options, mouths):
    """The options with fewer mouths, for a look in between."""
    return replace(options, texture=replace(options.texture, mouths=mouths))
