"""Mouth textures: the mouth proxy for each of the mouth poses (paGAN section 6)."""

from dataclasses import replace
from functools import cache

import cv2
import numpy as np

from bakery import landmarks as marks
from bakery.formats.targets import read_keys
from bakery.generators.base import Subject
from bakery.generators.interior import FRAME_SCALE
from bakery.generators.shade import is_part
from bakery.geometry import camera as cameras
from bakery.geometry.fill import diffuse, smoothstep
from bakery.geometry.sample import bilinear
from bakery.heads.base import MOUTH, HeadModel, weights
from bakery.heads.mouth import LIPS, around_mouth
from bakery.preset import find
from bakery.stages.condition import SIZE
from bakery.stages.texture.proxies import Proxy
from bakery.types import EXPRESSIONS, Camera, Conditions, Generated

SCALE = 1.25  # pixels of the mouth crop per pixel of the generator's 512 picture
REACH = 60.0  # mm around the mouth that the crops need


def mouth_landmarks(head: HeadModel, neutral: np.ndarray, vertices: np.ndarray) -> np.ndarray:
    """Lip landmarks [40, 2] of a shape: x right in the picture, y down, in mouth widths.

    They are fixed to the skull, centred on the neutral mouth: a pose is also where the lips stand
    before the upper teeth.

    Args:
        neutral, vertices: [V, 3] mm, at rest and deformed.
    """
    rest = head.landmarks(neutral)
    moved = head.landmarks(vertices)[LIPS]
    center = rest[LIPS].mean(0)
    width = np.linalg.norm(np.subtract(*rest[marks.MOUTH_CORNERS]))
    return ((moved - center)[:, :2] * [1, -1] / width).astype(np.float32)


def cut(subject: Subject, reach: float = REACH) -> Subject:
    """The subject with the faces around the mouth only: poses deform several times faster."""
    small = around_mouth(subject.head, subject.neutral, reach)
    return replace(subject, head=small, neutral=subject.neutral[small.whole_vertices])


def crop_camera(subject: Subject, camera: Camera) -> Camera:
    """Cut the mouth, as far as it opens, out of the face camera.

    Over 300 poses of five people the lips reach 0.72 mouth widths to each side of its middle, 0.33 up
    and 1.01 down; the network wants to see what is around them (cut 1.6 widths wide, a smile's lips
    lost 0.9 dB). At the scale that the network paints at, sides are a multiple of 32 pixels: what is
    beyond one is painted as the next.
    """
    lips = cameras.project(subject.head.landmarks(subject.neutral)[LIPS], camera)
    width = np.ptp(lips[:, 0])
    zoom = cameras.pixels_per_mm(camera) / (FRAME_SCALE * SIZE)
    side = 32 * np.ceil(1.85 * width / zoom / 32) * zoom
    corner = lips.mean(0) + [0, 0.28 * width] - side / 2
    return cameras.crop(
        camera, corner[0], corner[1], round(side * SCALE), round(side * SCALE), SCALE
    )


def mouth_texture(
    picture: tuple[Conditions, Generated], subject: Subject, sheet: Proxy, closed: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The mouth proxy in one pose, and where its lips stand.

    Args:
        picture: (Conditions, Generated) of the mouth crop.
        subject: what `cut` made.
        sheet: the sheet as `texture.proxies.make_proxy` unwraps it.
        closed: [h, w, 3] what a mouth shows whose lips hide all of the sheet.

    Returns:
        [h, w, 3] float16 linear, and the lip landmarks [40, 2] float32.
    """
    seen, made = picture
    pixels = cameras.project(sheet.at(seen.vertices), seen.camera)
    shown = cv2.GaussianBlur(is_part(seen.part, *MOUTH).astype(np.float32), (0, 0), 1.0)
    weight = sheet.paint(smoothstep(0.55, 0.95, bilinear(shown, pixels)).astype(np.float32))
    color = sheet.paint(bilinear(made.image, pixels))
    texture = np.maximum(diffuse(color, weight), 0) if weight.max() > 0 else closed
    landmarks = mouth_landmarks(subject.head, subject.neutral, seen.vertices)
    return texture.astype(np.float16), landmarks


def closed_mouth(subject: Subject, sheet: Proxy) -> np.ndarray:
    """What a closed mouth shows: its dark lining, [h, w, 3] float32 linear."""
    return np.full(sheet.shape + (3,), _lining(subject), np.float32)


def _lining(subject: Subject) -> np.ndarray:
    """Colour of the mouth's lining in the shade of closed lips."""
    head = subject.head
    uv = head.uv[head.uv_faces[head.part_faces("mouth_cavity")]].mean(1)
    return 0.2 * np.median(bilinear(subject.texture, uv * subject.texture.shape[0]), 0)


def spread(candidates, count):
    """Choose `count` of [N, D] spread evenly: each next one is farthest from those before.

    Args:
        candidates: [N, D]; the first is always chosen.

    Returns:
        [count] indices.

    References:
        Gonzalez, "Clustering to minimize the maximum intercluster distance", TCS 38, 1985.
    """
    chosen = [0]
    nearest = ((candidates - candidates[0]) ** 2).sum(1)
    for _ in range(count - 1):
        farthest = int(nearest.argmax())
        chosen.append(farthest)
        nearest = np.minimum(nearest, ((candidates - candidates[farthest]) ** 2).sum(1))
    return np.array(chosen)


RANGE = (  # what moves the lips besides speech
    "jawOpen jawLeft jawRight jawForward mouthSmileLeft mouthSmileRight mouthFrownLeft "
    "mouthFrownRight mouthStretchLeft mouthStretchRight mouthUpperUpLeft mouthUpperUpRight "
    "mouthLowerDownLeft mouthLowerDownRight mouthFunnel mouthPucker mouthLeft mouthRight "
    "mouthRollLower mouthRollUpper mouthShrugUpper mouthShrugLower tongueOut"
).split()
ONE_SIDED = ("jawLeft", "jawRight", "mouthLeft", "mouthRight")  # no mirrored twin at the same time


SMILES = (  # what real smiles are made of, each with its range
    ("mouthSmile", 0.2, 1.0), ("mouthUpperUp", 0.0, 0.8), ("mouthLowerDown", 0.0, 0.7),
    ("mouthDimple", 0.0, 0.5), ("mouthStretch", 0.0, 0.4), ("mouthPress", 0.0, 0.3),
)  # fmt: skip


@cache
def _visemes():
    """The mouth shapes of speech [n, E]."""
    return read_keys(find("expressions/visemes.toml"))[1]


def talking(rng):
    """A random mix of visemes [E], at times with a smile or a frown on it."""
    visemes = _visemes()
    a, b = rng.integers(len(visemes), size=2)
    pose = rng.uniform(0.4, 1.3) * visemes[a] + rng.uniform(0, 0.6) * visemes[b]
    if rng.random() < 0.5:
        pose = pose + rng.uniform(0, 0.6) * smiling(rng)
    return np.clip(pose, 0, 1)


def smiling(rng):
    """A random smile or laugh [E], nearly symmetric, from closed to wide open."""
    mix = {}
    for name, low, high in SMILES:
        amount = rng.uniform(low, high) * (rng.random() < 0.75)
        for side in ("Left", "Right"):
            mix[name + side] = amount * rng.uniform(0.85, 1.0)
    mix["jawOpen"] = rng.uniform(0, 0.45) * (rng.random() < 0.7)
    return weights(mix)


def ranging(rng):
    """A random pose [E] anywhere in what lips and jaw can do."""
    pose = 0.7 * talking(rng)
    for name in rng.choice(RANGE, rng.integers(1, 4), replace=False):
        amount = rng.uniform(0, 0.9)
        pose[EXPRESSIONS.index(name)] += amount
        twin = name.replace("Left", "Right") if "Left" in name else name.replace("Right", "Left")
        if twin in RANGE and name not in ONE_SIDED and rng.random() < 0.75:
            pose[EXPRESSIONS.index(twin)] += amount * rng.uniform(0.7, 1.0)
    return np.clip(pose, 0, 1)


def candidate_poses(rng, make, count):
    """Random poses [count, E] of one kind; the first is rest."""
    rest = np.zeros(len(EXPRESSIONS), np.float32)
    return np.stack([rest] + [make(rng) for _ in range(count - 1)]).astype(np.float32)
