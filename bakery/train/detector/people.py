"""Painted people for the detector's networks, with where their points are.

Photographs show people at rest or smiling. Painted people do everything faces do, and where their
points are is known; there are as many dark skins as light ones. Two painters take turns: the quick one,
whose skins mix photographed ones, and the careful one, who grows brows, beards and hair.
"""

from dataclasses import replace

import numpy as np

from bakery.geometry import camera as cameras
from bakery.geometry import rotation
from bakery.geometry.color import LUMA
from bakery.heads.base import PARTS, look
from bakery.stages.condition import face_camera
from bakery.stages.texture.mouth import smiling, talking
from bakery.synth import film, quick
from bakery.synth.expressions import draw_view, feeling
from bakery.synth.pairs.painter import PairOptions, draw_figure
from bakery.synth.render import dress, paint
from bakery.synth.scene import portrait_camera, random_scene
from bakery.synth.subject import random_subject
from bakery.synth.training import TrainingOptions
from bakery.types import EXPRESSION_INDEX, EXPRESSIONS, Fit

SIZE = (200, 360)  # pixels of a painted frame's side, least and most
CAREFUL = TrainingOptions(size=288)
PAIRED = [name for name in EXPRESSIONS if name.endswith("Left") and not name.startswith("eyeLook")]
# What shut lips do: what parts them by a millimetre or hides their red is hardest to see.
SHUT = (
    "mouthPressLeft", "mouthRollLower", "mouthRollUpper", "mouthShrugLower", "mouthShrugUpper",
    "mouthPucker", "mouthFrownLeft", "mouthStretchLeft", "mouthDimpleLeft", "mouthSmileLeft",
)  # fmt: skip


def random_face(rng):
    """Expression [E] and gaze [2] degrees: whole expressions, single shapes, lids, brows, shut lips."""
    kind = rng.random()
    pose = np.zeros(len(EXPRESSIONS), np.float32)
    if kind < 0.25:
        pose = talking(rng)
    elif kind < 0.4:
        pose = smiling(rng)
    elif kind < 0.7:
        pose = feeling(rng)
    pose = np.array(pose, np.float32)

    def add(name, amount, both=0.8):
        pose[EXPRESSION_INDEX[name]] += amount
        if name.endswith("Left") and rng.random() < both:
            twin = name[:-4] + "Right"
            pose[EXPRESSION_INDEX[twin]] += amount * rng.uniform(0.8, 1)

    if 0.7 <= kind < 0.9:
        for name in SHUT:
            if rng.random() < 0.25:
                add(name, rng.uniform(0, 0.9))
        opened = rng.choice([0.0, rng.uniform(0, 0.08), rng.uniform(0, 0.4)])
        add("jawOpen", opened)
        add("mouthClose", opened * (rng.random() < 0.6))
    if rng.random() < 0.45:
        add("eyeBlinkLeft", rng.choice([rng.uniform(0, 1), rng.uniform(0.85, 1)]), 0.9)
    elif rng.random() < 0.25:
        add("eyeWideLeft", rng.uniform(0, 1))
    for name in ("eyeSquintLeft", "browDownLeft", "browOuterUpLeft", "browInnerUp", "jawOpen"):
        if rng.random() < 0.2:
            add(name, rng.uniform(0, 1))
    for name in rng.choice(PAIRED, 2, replace=False):
        if rng.random() < 0.4:
            add(str(name), rng.uniform(0, 0.8))
    gaze = np.clip(rng.normal(size=2) * [12, 8], -30, 30)
    return look(np.clip(pose, 0, 1), gaze), gaze


def random_view(rng):
    """Yaw, pitch and roll in degrees: mostly towards the camera, all of +-40 at times."""
    yaw, pitch = rng.normal(size=2) * [16, 9] if rng.random() < 0.6 else draw_view(rng)
    return tuple(np.clip([yaw, pitch, rng.normal() * 10], -42, 42).tolist())


def quick_frames(rng, stage, skins, count):
    """Yield pictures of one invented person by the quick painter, with where its points are.

    Args:
        rng: numpy Generator.
        stage: quick.Stage.
        skins: lists of skins, one a tone (`synth.skins.by_tone`), or an empty list.
        count: pictures.

    Yields:
        [S, S, 3] uint8 sRGB, [478, 2] pixels.
    """
    paths = skins[int(rng.integers(len(skins)))] if skins else []
    figure, lens, balance = draw_figure(rng, stage, paths, PairOptions(painted=0.25))
    fit = Fit(
        stage.head.name, lens, figure.traits.identity, np.zeros(len(EXPRESSIONS), np.float32),
        np.zeros(2), np.zeros((9, 3)), np.zeros(0), np.zeros((468, 3)), None,
    )  # fmt: skip
    for _ in range(count):
        size = int(rng.integers(*SIZE)) // 2 * 2
        expression, gaze = random_face(rng)
        yaw, pitch, roll = random_view(rng)
        share = float(rng.uniform(0.5, 0.85))
        camera = face_camera(fit, figure.head, figure.neutral, yaw, pitch, size, share)
        turn = rotation.matrix([0, 0, np.radians(roll)])
        camera = replace(
            camera,
            rotation=rotation.vector(turn @ rotation.matrix(camera.rotation)),
            translation=turn @ camera.translation,
        )
        linear, kind = quick.paint(figure, expression, gaze, camera)
        skin = np.median(linear[kind == PARTS.index("skin")] @ LUMA)
        # Well lit, or too dark: what cameras make of dark skin in dim light.
        bright = np.exp(rng.uniform(np.log(0.03), np.log(0.45)))
        base = np.exp(rng.normal(size=3) * 0.3) * np.exp(rng.uniform(np.log(0.02), np.log(0.9)))
        behind = film.background(rng, str(rng.choice(["studio", "room"])), size, size, base)
        linear = np.where(
            kind[..., None] >= 0, linear * (bright / max(skin, 1e-4) * balance), behind
        )
        encoded = film.develop(
            linear, rng, rng.uniform(0.3, 2), rng.uniform(0.3, 1.0), rng.integers(60, 97)
        )
        posed = figure.head.vertices(figure.neutral, expression, gaze)
        points = cameras.project(figure.head.landmarks(posed), camera)
        yield np.round(encoded * 255).astype(np.uint8), points


def careful_frames(rng, head, count, options=CAREFUL):
    """Yield pictures of one invented person by the careful painter; see `quick_frames`."""
    subject = random_subject(rng, head, options.spread)
    scene = random_scene(rng, options.size, options.size)
    wardrobe = dress(head, subject, options.detail, options.share)
    distance = float(rng.uniform(500, 2400))
    for index in range(count):
        expression, gaze = random_face(rng)
        camera = portrait_camera(
            options.size, options.size, *random_view(rng),
            filling=float(rng.uniform(0.55, 0.95)), distance=distance,
        )  # fmt: skip
        one = replace(
            scene, camera=camera, expression=expression, gaze=gaze, seed=scene.seed + index,
            quality=int(rng.integers(40, 97)),
        )  # fmt: skip
        picture = paint(wardrobe, one, options.supersample, options.quality)
        yield np.round(picture.encoded * 255).astype(np.uint8), picture.landmarks
