"""Frames of a video that follow each other calmly, whatever generator paints them.

A generator sees one picture at a time and answers a little differently to the same piece of skin when
it lies a part of a pixel further. So what it changed in the last frame is carried along the surface
to where that surface lies now, and stays as far as it is near what was painted now. A change that is
not near is an expression that comes or goes: it is shown in its own frame, but for REACH. On skin
tone alone is carried; lines come and go with their frame.

References:
    Temporal accumulation along motion, the history clamped to the new frame: Karis, High-Quality
    Temporal Supersampling, SIGGRAPH 2014 courses. Here motion is known from the mesh, and the
    change of the texture alone is carried, so that no detail of the texture is resampled.
"""

from dataclasses import replace

import cv2
import numpy as np

from bakery.generators.channels import NONE
from bakery.generators.shade import EYES, is_part
from bakery.geometry import camera as cameras
from bakery.geometry.sample import bilinear, interpolate
from bakery.heads.base import MOUTH

# Log of linear light by which a frame may differ from its own picture: 5 levels of 255 on skin, 16 on
# teeth, whose tone the generator knows least. More was not looked at; it would lag.
REACH, MOUTH_REACH = 0.09, 0.3
KEEP = 0.93  # share of that difference in the next frame: half is gone in 10 frames
TONE = 0.75  # mm, over which it is taken on skin: lines are the frame's own and come at once
BLACK = 0.004  # linear light; shares of what is much darker say nothing
SAME = 0.005  # of the atlas: two pixels further apart show different places of the face


class SteadyGenerator:
    """A generator (generators.base.Generator) for the frames of one video, in their order."""

    def __init__(self, generator):
        self.generator = generator
        self._before = None  # conditions of the last frame, and its change [H, W, 3] as shown

    @property
    def name(self):
        return self.generator.name

    @property
    def source_type(self):
        return self.generator.source_type

    def generate(self, subject, conditions, interior_only=False):
        """Paint the next frame of a subject (generators.base.Generator)."""
        made = self.generator.generate(subject, conditions, interior_only)
        return self.follow(subject.head, conditions, made)

    def follow(self, head, conditions, made):
        """The next frame as it is shown.

        Args:
            made: what the generator painted of these conditions, elsewhere perhaps.

        Returns:
            Generated.
        """
        change = change_of(made.image, conditions.deformed_neutral)
        shift = np.zeros_like(change)
        if self._before is not None:
            shift = shift_towards(*self._before, head, conditions, change)
        self._before = conditions, change + shift
        factor = np.exp(shift)
        return replace(
            made, image=made.image * factor, ratio=made.ratio * factor, color=made.color * factor
        )


def change_of(image, deformed):
    """Log [H, W, 3] of a picture over the deformed neutral, both [H, W, 3] linear."""
    return np.log((np.maximum(image, 0) + BLACK) / (deformed + BLACK)).astype(np.float32)


def shift_towards(before, shown, head, conditions, change):
    """What [H, W, 3] is added to a frame's change so that it stays near that of the last frame.

    Args:
        before: Conditions of the last frame; shown: its change [H, W, 3].
        conditions: of this frame; change: [H, W, 3] as it was painted.
    """
    there, same = followed(head, conditions, before)
    # Highlights stay where they are while the eyeball turns.
    same &= ~is_part(conditions.part, *EYES)
    apart = (bilinear(shown, there) - change) * same[..., None]
    reach = np.where(is_part(conditions.part, *MOUTH), MOUTH_REACH, REACH)[..., None]
    shift = np.clip(KEEP * apart, -reach, reach).astype(np.float32)
    known = (same & is_part(conditions.part, "skin")).astype(np.float32)[..., None]
    camera = conditions.camera
    radius = TONE * cameras.pixels_per_mm(camera)
    tone = _blurred(shift * known, radius) / np.maximum(_blurred(known, radius), 1e-3)
    return np.where(known > 0, tone, shift)


def _blurred(picture, radius):
    return cv2.GaussianBlur(picture, (0, 0), radius).reshape(picture.shape)


def followed(head, here, other):
    """Where the surface that each pixel shows lies in another frame.

    Args:
        here, other: Conditions of one subject.

    Returns:
        pixels [H, W, 2] float32 of the other frame, and where that shows the same place [H, W] bool.
    """
    points = cameras.to_camera(other.vertices, other.camera)
    place = interpolate(here.fragments, points[head.faces])
    drawn = here.part != NONE
    place[~drawn] = [0, 0, -1]  # anywhere in front of the camera
    there = cameras.project_camera(place, other.camera).astype(np.float32)
    uv, other_uv = (interpolate(c.fragments, head.uv[head.uv_faces]) for c in (here, other))
    apart = np.abs(bilinear(other_uv, there) - uv)
    return there, drawn & (apart[..., 0] < SAME) & (apart[..., 1] < SAME)
