"""Conditioning channels: conditions as small integers, what a network sees in training and in use.

Training shards hold these channels (`bakery.synth.pairs`), and a trained generator makes its input
with the same functions, so that the two cannot differ.
"""

from dataclasses import dataclass

import cv2
import numpy as np

from bakery.generators.expected_folds import fold_channels
from bakery.generators.strain import landmark_fragments, strain_channels
from bakery.geometry import harmonics
from bakery.geometry.camera import project, to_camera
from bakery.geometry.encode import encode
from bakery.geometry.fill import smoothstep
from bakery.geometry.sample import interpolate
from bakery.heads.base import PARTS, HeadModel, once_a_mean
from bakery.memo import once_per_object
from bakery.types import Conditions

NONE = 255  # code of `part` where nothing is drawn
BLOT = np.uint8([89, 48, 48])  # sRGB, what hides a mouth: that of a dark one
# mm between the eyes' middle (the origin of head space) and what depth 255 and depth 1 mean.
NEAR, FAR = 80.0, -160.0
FACE_REACH = (15.0, 30.0)  # mm from the nearest landmark, mean head: the face is whole, and ended


@dataclass(frozen=True)
class Channels:
    """One target as integers."""

    deformed: np.ndarray  # [H, W, 3] uint8 sRGB-encoded: the deformed neutral; 0 where nothing is
    normals: np.ndarray  # [H, W, 3] int8: camera-space unit normal * 127; 0 where nothing is
    depth: np.ndarray  # [H, W] uint8: 255 NEAR .. 1 FAR, linear in mm; 0 where nothing is
    gaze: np.ndarray  # [H, W, 2] uint8: visible iris and sclera * 255
    part: np.ndarray  # [H, W] uint8 into heads.base.PARTS, NONE for none
    face: np.ndarray  # [H, W] uint8: 255 on the face, feathered towards scalp, ears and throat


def condition_channels(head: HeadModel, conditions: Conditions) -> Channels:
    """Encode Conditions of a head model.

    Returns:
        Channels.
    """
    seen = conditions.part != NONE
    return Channels(
        deformed=encode(conditions.deformed_neutral) * seen[..., None],
        normals=np.round(conditions.normals * 127).astype(np.int8),
        depth=depth_code(conditions),
        gaze=np.round(conditions.gaze_mask * 255).astype(np.uint8),
        part=conditions.part,
        face=face_mask(head, conditions),
    )


def depth_code(conditions: Conditions) -> np.ndarray:
    """`Channels.depth` [H, W] of Conditions."""
    seen = conditions.part != NONE
    origin = -to_camera(np.zeros(3), conditions.camera)[2]
    ahead = np.where(seen, origin - conditions.depth, 0)  # mm towards the camera
    depth = np.clip(1 + 254 * (ahead - FAR) / (NEAR - FAR), 1, 255)
    coded: np.ndarray = (np.round(depth) * seen).astype(np.uint8)
    return coded


def shrunk_channels(channels: Channels, size: int) -> Channels:
    """Channels drawn at several times the pixels [h, w] as channels of `size` pixels a side."""

    def area(channel: np.ndarray) -> np.ndarray:
        small = cv2.resize(channel.astype(np.float32), (size, size), interpolation=cv2.INTER_AREA)
        return np.round(small).astype(channel.dtype)

    part = cv2.resize(channels.part, (size, size), interpolation=cv2.INTER_NEAREST)
    others = {name: area(channel) for name, channel in vars(channels).items() if name != "part"}
    return Channels(part=part, **others)


def expression_channels(subject, conditions, camera=None, wanted=("strain", "folds")):
    """What an expression does to the skin: strain, and folds to expect.

    Args:
        subject: generators.base.Subject.
        conditions: Conditions.
        camera: Camera of the channels; None: that of the conditions.
        wanted: names of channels; others are passed over.

    Returns:
        {name: [H, W, 2] uint8}.
    """
    channels = {}
    if not {"strain", "folds"} & set(wanted):
        return channels
    head, expression, camera = subject.head, conditions.expression, camera or conditions.camera
    pixels = project(head.landmarks(conditions.vertices), camera)
    found = landmark_fragments(head, pixels, (camera.height, camera.width))
    if "strain" in wanted:
        channels["strain"] = strain_channels(head, expression, pixels, found)
    if "folds" in wanted:
        channels["folds"] = fold_channels(head, expression, _light_of(subject), found)
    return channels


@once_per_object
def _light_of(subject):
    """A subject's light [9, 3] in head space."""
    return harmonics.turned(subject.light, subject.light_rotation.T)


def face_mask(head, conditions):
    """Where the face is [H, W] uint8, feathered (paGAN sec. 7 masks its photographs so).

    Eyes and the mouth's interior belong to it; the scalp, the ears and the throat do not.
    """
    share = face_share(head)
    inside = interpolate(conditions.fragments, share[head.faces][..., None])[..., 0]
    inner = (conditions.part != NONE) & (conditions.part != PARTS.index("skin"))
    return np.round(np.where(inner, 1, inside) * 255).astype(np.uint8)


@once_a_mean
def face_share(head):
    """How far each vertex [V] belongs to the face, 0..1."""
    marks = head.landmarks(head.mean)[:468]
    distance = np.full(len(head.mean), np.inf)
    axes = np.ascontiguousarray(head.mean.T)  # one axis after the other: six times as fast
    for mark in marks:
        x, y, z = ((axis - at) ** 2 for axis, at in zip(axes, mark))
        distance = np.minimum(distance, x + y + z)
    return smoothstep(FACE_REACH[1], FACE_REACH[0], np.sqrt(distance)).astype(np.float32)
