"""Invents a person, photographs it in neutral, and paints it in other expressions and views.

The conditions of each target are made by the code that inference uses: the painted photo is
unwrapped by `stages.texture.neutral.prepare` and drawn by `stages.condition`, on a shape that is as wrong as
a fit's (`PairOptions.error`).
"""

from dataclasses import dataclass, replace
from functools import partial

import cv2
import numpy as np

from bakery.formats.targets import read_keys
from bakery.generators.channels import (
    condition_channels,
    expression_channels,
    face_mask,
    shrunk_channels,
)
from bakery.generators.folds import make_folds
from bakery.geometry import camera as cameras
from bakery.geometry import rotation
from bakery.geometry.color import LUMA, to_encoded
from bakery.geometry.fill import smoothstep
from bakery.geometry.noise import value_noise
from bakery.geometry.sample import bilinear
from bakery.heads.base import PARTS
from bakery.landmarks import FACE, LIPS_INNER, LIPS_OUTER
from bakery.preset import find
from bakery.stages.condition import condition, face_camera, finer
from bakery.stages.fit.lids import close_lids
from bakery.stages.fit.warp import residual_offsets
from bakery.stages.texture import VIEWS
from bakery.stages.texture.hair import Mattes
from bakery.stages.texture.lids import lid_skin
from bakery.stages.texture.neutral import prepare
from bakery.synth import facial, film, quick, skins
from bakery.synth.expressions import draw_expression, draw_view
from bakery.synth.noise import cells
from bakery.synth.painted_skin import painted
from bakery.synth.pairs import PaintedPair
from bakery.synth.scene import portrait_camera, studio_light
from bakery.synth.skin import MELANIN
from bakery.synth.subject import random_subject
from bakery.types import EXPRESSIONS, Fit, Landmarks, Photo

REST = np.zeros(len(EXPRESSIONS), np.float32)
LID = np.array([0.92, 0.87, 0.85], np.float32)  # thin skin of the lids over the skin around them
PHOTO_SIZE = 2  # the photo has so many times the pixels of a target on a side


@dataclass(frozen=True)
class PairOptions:
    """How pairs are painted."""

    size: int = 256  # S, pixels on a side
    targets: int = 16  # pictures of one subject
    keys: bool = False  # what avatars are baked from in place of that: each key from each view
    spread: float = 0.8  # standard deviations of the identities
    painted: float = 0.15  # share of subjects whose skin is painted though there are skins
    # Size of the fit's mistakes, 1 as the fit has them: 0.25 standard deviations of identity, with the
    # landmarks mended but for 0.5 mm in the picture and half of the mistake in depth; 5% of each
    # expression weight, before the target is registered; 0 gives the conditions the truth.
    error: float = 1.0

    @property
    def count(self):
        """Pictures of one subject."""
        return len(_key_poses()) if self.keys else self.targets


def _key_poses():
    """Expression [E], gaze [2], yaw and pitch of each key expression from each of its views."""
    _, keys = read_keys(find("expressions/keys.toml"))
    return [(weights, np.zeros(2), yaw, 0.0) for weights in keys for yaw in VIEWS]


def draw_figure(rng, stage, paths, options):
    """Invent a person under some light.

    Args:
        rng: numpy Generator.
        stage: quick.Stage.
        paths: skins to mix (`skins.skins_of`), or an empty list to paint the skin.
        options: PairOptions.

    Returns:
        quick.Figure, its photo's Camera, exposure (a factor) and white balance [3].
    """
    head, atlas = stage.head, stage.atlas
    traits = random_subject(rng, head, options.spread)
    neutral = head.neutral(traits.identity)
    own = close_lids(head, neutral)
    camera = _photo_camera(rng, own, neutral, options.size * PHOTO_SIZE)
    light = draw_light(rng)
    environment = quick.turned(light, rotation.matrix(camera.rotation).T)
    if len(paths) and rng.random() >= options.painted:
        albedo = marked(rng, stage, skins.mixed(rng, paths, stage.rest))
        traits = alike(rng, stage, traits, albedo)
        rough, resting = bare_surface(rng, stage, neutral, traits.age)
    else:
        albedo, rough, resting = painted(stage, traits)
    points = atlas.at(neutral)[stage.skin_rows]
    dome, openness = quick.bake_dome(own, neutral, environment)
    lids = lid_skin(own, neutral, albedo, atlas)
    figure = quick.Figure(
        stage=stage,
        head=own,
        traits=traits,
        neutral=neutral,
        albedo=albedo,
        rough=rough,
        height=resting,
        folds=make_folds(own, neutral, points, rng, traits.age),
        lids=replace(lids, color=lids.color * LID),
        teeth=draw_teeth(rng),
        lashes=partial(facial.lashes, own, traits, share=0.6),
        environment=environment,
        dome=dome,
        openness=openness,
    )
    balance = np.exp(rng.normal(size=3) * [0.035, 0.0, 0.045])
    return figure, camera, balance


def draw_light(rng):
    """The light of a portrait [Environment], camera space: mostly soft, at times hard."""
    hard = rng.random() < 0.2
    key = float(rng.uniform(0.3, 1.0))
    return studio_light(
        azimuth=float(np.clip(rng.normal() * 38, -85, 85)),
        elevation=float(rng.uniform(0, 60)),
        radius=float(rng.uniform(3, 8) if hard else rng.uniform(10, 30)),
        key=key,
        fill=float(rng.uniform(0, 0.8)) * key,
        rim=float(rng.uniform(0, 0.7)) * (rng.random() < 0.25),
        ambient=float(rng.uniform(0.2, 0.6)),
        warm=float(rng.normal()),
        seed=int(rng.integers(2**31)),
    )


def draw_teeth(rng):
    """Reflectance [3] of each part of the mouth: teeth from white to yellow, gums and tongue."""
    yellow = rng.uniform(0, 2)
    white = np.array([0.74, 0.70, 0.63]) * [1, 1 - 0.04 * yellow, 1 - 0.11 * yellow]
    white = white * rng.uniform(0.72, 1.08)
    gums = np.array([0.48, 0.20, 0.18]) * np.exp(rng.normal(size=3) * 0.08 + rng.normal() * 0.2)
    tongue = np.array([0.43, 0.165, 0.15]) * np.exp(rng.normal(size=3) * 0.06 + rng.normal() * 0.15)
    return {
        "teeth_upper": white,
        "teeth_lower": white * rng.uniform(0.86, 0.98),
        "gums_upper": gums,
        "gums_lower": gums,
        "tongue": tongue,
    }


def alike(rng, stage, traits, albedo):
    """The traits with the melanin and, of dark skin, the iris that go with the skin's colour."""
    places = stage.head.landmark_uv()[:468] * len(albedo)
    level = float(np.median(bilinear(albedo, places) @ LUMA))
    melanin = float(np.clip(np.log(0.5 / max(level, 0.02)) / 0.7, 0.1, 3))
    iris = traits.iris if melanin < 0.7 else str(rng.choice(["dark brown", "dark brown", "brown"]))
    return replace(traits, melanin=melanin, iris=iris)


def marked(rng, stage, albedo):
    """A skin with what its photograph did not have: lipstick, freckles, moles [T, T, 3]."""
    head, texels = stage.head, stage.atlas.size
    out = albedo.copy()
    if rng.random() < 0.12:
        outer, inner = (
            np.round(head.landmark_uv()[ring] * texels * 16).astype(np.int32)
            for ring in (LIPS_OUTER, LIPS_INNER)
        )
        lips = np.zeros((texels, texels), np.float32)
        cv2.fillPoly(lips, [outer], 1.0, cv2.LINE_AA, 4)
        cv2.fillPoly(lips, [inner], 0.6, cv2.LINE_AA, 4)
        lips = cv2.GaussianBlur(lips, (0, 0), 0.8)[..., None] * rng.uniform(0.25, 0.85)
        color = np.array([0.42, 0.06, 0.08]) * np.exp(rng.normal(size=3) * [0.3, 0.5, 0.5])
        out = out * (1 - lips) + np.clip(color, 0.01, 0.7) * (0.5 + out / out.mean()) / 1.5 * lips
    places = stage.rest.reshape(-1, 3)
    if rng.random() < 0.12:
        near, own = cells(places, 2.3, int(rng.integers(2**31)))
        spots = smoothstep(0.30 + 0.7 * own, 0.1 + 0.4 * own, near) * (own > 0.45)
        spots = spots.reshape(texels, texels, 1) * rng.uniform(0.2, 0.6)
        out = out * np.exp(-MELANIN * 0.6 * spots)
    near, own = cells(places, 17.0, int(rng.integers(2**31)))
    moles = smoothstep(1.6 * own, 0.7 * own, near) * (own > 1 - rng.uniform(0, 0.25))
    out = out * np.exp(-MELANIN * 1.4 * moles.reshape(texels, texels, 1))
    return out.astype(np.float32)


def bare_surface(rng, stage, neutral, age):
    """Roughness [T, T] and resting relief [N] mm of skin whose colour was photographed."""
    atlas = stage.atlas
    points = atlas.at(neutral)[stage.skin_rows]
    old = np.clip((age - 20) / 55, 0, 1)
    fine = value_noise(points, 1.3, int(rng.integers(2**31)))
    broad = value_noise(points, 4.5, int(rng.integers(2**31)))
    height = (0.028 + 0.015 * old) * fine + (0.03 + 0.05 * old) * broad
    rough = np.zeros(len(atlas.index), np.float32) + 0.5
    rough[stage.skin_rows] = rng.uniform(0.40, 0.60) + 0.05 * broad
    return atlas.fill_gutter(atlas.paint(rough)), height.astype(np.float32)


def _photo_camera(rng, head, neutral, size):
    """A frontal, upright camera, the face filling the picture as the generator's do."""
    lens = portrait_camera(
        size, size, distance=float(np.exp(rng.uniform(np.log(550), np.log(2200))))
    )
    yaw, pitch = np.clip(rng.normal(size=2) * [3.5, 3.0], -9, 9)
    return face_camera(_Lens(lens), head, neutral, yaw, pitch, size)


@dataclass(frozen=True)
class _Lens:
    """What `face_camera` asks of a fit."""

    camera: object


def mistaken_shape(rng, head, traits, neutral, error):
    """The neutral shape [V, 3] as a fit would have it."""
    if error <= 0:
        return neutral
    identity = traits.identity + 0.25 * error * rng.normal(size=len(traits.identity))
    linear = head.neutral(identity)
    true, found = head.landmarks(neutral)[:468], head.landmarks(linear)[:468]
    residual = (true - found) * [1, 1, 0.5]
    jitter = np.stack([value_noise(true, 12.0, int(rng.integers(2**31))) for _ in range(2)], 1)
    residual[:, :2] += 0.5 * error * jitter
    return linear + residual_offsets(head, residual)


def photograph(rng, figure, camera, balance, size):
    """The portrait of a figure at rest.

    Returns:
        Photo, what it shows [H, W] (part or -1), and the exposure, a factor.
    """
    linear, kind = quick.paint(figure, REST, np.zeros(2), camera, 1)
    skin = kind == PARTS.index("skin")
    level = float(np.median(linear[skin] @ LUMA))
    uv = figure.head.landmark_uv()
    # Cameras meter on the whole picture: dark skin comes out darker than light skin, but not by all.
    typical = float(np.median(bilinear(figure.albedo, uv[:468] * len(figure.albedo)) @ LUMA))
    wanted = 0.30 * (typical / 0.30) ** 0.6 * np.exp(rng.normal() * 0.18)
    exposure = wanted / max(level, 1e-3)
    shown = quick.develop(linear, exposure, balance)
    noise = rng.normal(size=shown.shape).astype(np.float32)
    noisy = shown + 0.3 * rng.random() * np.sqrt(np.maximum(shown, 0) * 1.2e-4) * noise
    encoded = to_encoded(noisy * (kind >= 0)[..., None])
    return Photo(encoded.astype(np.float32), "painted"), kind, exposure


def paint_subject(stage, paths, seed, options=PairOptions()):
    """All pairs of one subject.

    Args:
        stage: quick.Stage of the head model.
        paths: skins to mix, or an empty list.
        seed: (run's seed, number of the subject); the same gives the same pictures.

    Yields:
        PaintedPair, `options.count` times.
    """
    rng = np.random.default_rng(seed)
    figure, camera, balance = draw_figure(rng, stage, paths, options)
    size, true_head = options.size, figure.head
    photo, kind, exposure = photograph(rng, figure, camera, balance, size)

    neutral = mistaken_shape(rng, stage.head, figure.traits, figure.neutral, options.error)
    head = close_lids(stage.head, neutral)
    marks = cameras.project(true_head.landmarks(figure.neutral), camera)
    light = quick.turned(figure.environment, rotation.matrix(camera.rotation)).irradiance()
    fit = Fit(
        stage.head.name, camera, figure.traits.identity, REST, np.zeros(2), light * exposure,
        np.zeros(0), np.zeros((468, 3)), marks,
    )  # fmt: skip
    low, high = marks.min(0), marks.max(0)
    found = Landmarks(np.concatenate([low, high - low]), 1.0, marks, np.ones(len(marks)))
    bald = np.zeros(kind.shape, np.float32)
    mattes = Mattes((kind == PARTS.index("skin")).astype(np.float32), *[bald] * 6)
    prepared = prepare(photo, found, fit, neutral, head, mattes, size * PHOTO_SIZE, method="mirror")
    subject = prepared.subject

    small = cv2.resize(photo.encoded, (size, size), interpolation=cv2.INTER_AREA)
    frontal = replace(
        cameras.crop(camera, 0, 0, size, size, 1 / PHOTO_SIZE), rotation=camera.rotation
    )
    drawn = condition(head, neutral, subject.texture, REST, np.zeros(2), frontal)
    shared = {
        "photo": np.round(small * 255).astype(np.uint8),
        "photo_face": face_mask(head, drawn),
        "subject": int(np.atleast_1d(seed)[-1]),
        "head": stage.head.name,
    }
    poses = _key_poses() if options.keys else [None] * options.targets
    gain = exposure * balance
    for pose in poses:
        pose = pose or (*draw_expression(rng), *draw_view(rng))
        yield _target(rng, figure, subject, fit, head, neutral, gain, shared, options, pose)


def _target(rng, figure, subject, fit, head, neutral, gain, shared, options, pose):
    expression, gaze, yaw, pitch = pose
    camera = face_camera(fit, head, neutral, yaw, pitch, options.size)
    believed = expression * (1 + 0.05 * options.error * rng.normal(size=len(expression)))
    believed = np.clip(believed, 0, 1).astype(np.float32)
    posed = figure.head.vertices(figure.neutral, expression, gaze)
    marks = figure.head.landmarks(posed)
    if options.error > 0:
        neutral = neutral + registration(figure, head, neutral, marks, believed, gaze, camera)
    drawn = condition(head, neutral, subject.texture, believed, gaze, finer(camera))
    linear, kind = quick.paint(figure, expression, gaze, camera)
    truth = to_encoded(film.tone(linear * gain)) * 255
    return PaintedPair(
        target=np.round(truth).astype(np.uint8),
        landmarks=cameras.project(marks, camera).astype(np.float32),
        expression=expression,
        **expression_channels(subject, drawn, camera),
        gaze_angles=gaze.astype(np.float32),
        yaw=yaw,
        pitch=pitch,
        **vars(shrunk_channels(condition_channels(head, drawn), options.size)),
        **shared,
    )


def registration(figure, head, neutral, marks, expression, gaze, camera):
    """Offsets [V, 3] mm that register the mistaken shape with a target, as the fit of a photo does.

    The warp of a fit moves landmarks in the picture's plane to where that photo shows them. Here
    they keep the mistake that they have on the neutral photo: a detector errs alike on one face.

    Args:
        neutral: [V, 3] mm, mistaken.
        marks: [L, 3] mm, true landmarks of the target.
        expression, gaze, camera: of the target, as they are believed.
    """
    kept = head.landmarks(neutral) - figure.head.landmarks(figure.neutral)
    posed = head.landmarks(head.vertices(neutral, expression, gaze))
    missing = (marks + kept * [1, 1, 0] - posed)[:FACE]
    turn = rotation.matrix(camera.rotation)
    # Of the stage's head: lids that close on other eyes change no weight of the warp, and those of
    # one head are found once.
    return residual_offsets(figure.stage.head, (missing @ turn.T * [1, 1, 0]) @ turn)
