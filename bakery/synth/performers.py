"""Painted people who all show the same expressions: expression textures that are aligned, to learn from.

The paper hired actors and cut and warped their clips until the expressions agreed; painted people play the same
weights. Each is drawn by the quick painter under a light of his own and read off the picture by the
code that reads a frame (`stages.texture.expression`), on a shape that is as wrong as a fit's.
"""

import json
from dataclasses import dataclass

import numpy as np

from bakery.formats.files import write_bytes
from bakery.geometry import rotation
from bakery.heads.base import look
from bakery.stages.condition import face_camera
from bakery.stages.fit.lids import close_lids
from bakery.stages.texture.expression import read_texture
from bakery.stages.texture.mouth import smiling, talking
from bakery.synth import film, quick, skins
from bakery.synth.expressions import FEELINGS, both_sides, draw_expression
from bakery.synth.pairs.painter import (
    REST,
    PairOptions,
    draw_figure,
    mistaken_shape,
    photograph,
    registration,
)
from bakery.types import EXPRESSION_INDEX

# What the 21 expressions of FACS that the paper's actors played amount to: single actions and pairs.
ACTIONS = (
    {"browInnerUp": 1.0}, {"browInnerUp": 0.7, "browOuterUp": 1.0}, {"browDown": 1.0}, {"eyeWide": 1.0},
    {"eyeBlink": 1.0}, {"eyeSquint": 1.0, "cheekSquint": 0.8}, {"noseSneer": 1.0},
    {"mouthUpperUp": 0.9}, {"mouthSmile": 0.6, "cheekSquint": 0.5, "mouthUpperUp": 0.3}, {"mouthDimple": 1.0},
    {"mouthFrown": 0.9}, {"mouthLowerDown": 0.9}, {"mouthShrugLower": 0.9, "mouthShrugUpper": 0.5},
    {"mouthPucker": 1.0}, {"mouthStretch": 1.0}, {"mouthFunnel": 0.9}, {"mouthPress": 0.9},
    {"mouthRollLower": 0.8, "mouthRollUpper": 0.8}, {"jawOpen": 0.4}, {"jawOpen": 0.85},
    {"cheekPuff": 1.0},
)  # fmt: skip
NAME = "performer-{:05d}.safetensors"
SIDE = 512  # pixels of the pictures
CONSTANT = 20171  # seed of the expressions: they are the same whoever plays


@dataclass(frozen=True)
class Played:
    """What all performers play."""

    weights: np.ndarray  # [K, E]; the first is rest
    gaze: np.ndarray  # [K, 2] degrees


def played(count=48):
    """What performers play [K = count]: rest, the ACTIONS, feelings, talk, smiles, and random faces."""
    rng = np.random.default_rng(CONSTANT)
    faces = [(REST, np.zeros(2))]
    faces += [(both_sides(action), np.zeros(2)) for action in ACTIONS]
    while len(faces) < count:
        kind = len(faces) % 4
        if kind == 0:
            name = list(FEELINGS)[int(rng.integers(len(FEELINGS)))]
            faces.append((both_sides(FEELINGS[name]) * rng.uniform(0.4, 1.0), np.zeros(2)))
        elif kind == 3:
            faces.append(draw_expression(rng))
        else:
            face = (talking, smiling)[int(rng.random() < 0.3)](rng)
            face[EXPRESSION_INDEX["tongueOut"]] = 0
            gaze = np.clip(rng.normal(size=2) * [9, 5], -22, 22)
            faces.append((look(np.clip(face, 0, 1), gaze), gaze))
    weights, gaze = zip(*faces[:count])
    return Played(np.array(weights, np.float32), np.array(gaze))


def paint_person(stage, seed, what, error=1.0, paths=()):
    """The expression textures of one invented person.

    Args:
        stage: quick.Stage of the head model.
        seed: integer or (run's seed, number); the same gives the same textures.
        what: Played.
        error: scale of the fit's mistakes, see `PairOptions.error`; drawn from 0 to that a person.
        paths: skins to mix (`synth.skins.skins_of`); none paints them from pigments.

    Yields:
        texture [T, T, 3] uint8 sRGB and seen [T, T] uint8, for each expression.
    """
    rng = np.random.default_rng(seed)
    options = PairOptions(size=SIDE // 2, error=float(rng.uniform(0, error)))
    for picture, camera, head, vertices, light in photographed(rng, stage, what, options, paths):
        texture, seen = read_texture(picture, camera, head, vertices, light)
        yield np.round(texture * 255).astype(np.uint8), np.round(seen * 255).astype(np.uint8)


def photographed(rng, stage, what, options, paths=()):
    """Pictures of one invented person, and the head as it is believed to stand in each.

    Yields:
        picture [H, W, 3] float32 linear, Camera, HeadModel, vertices [V, 3] mm, light [9, 3].
    """
    figure, lens, balance = draw_figure(rng, stage, paths, options)
    _, _, exposure = photograph(rng, figure, lens, balance, SIDE // 2)
    neutral = mistaken_shape(rng, stage.head, figure.traits, figure.neutral, options.error)
    head = close_lids(stage.head, neutral)
    for number, (expression, gaze) in enumerate(zip(what.weights, what.gaze)):
        turn = np.clip(rng.normal(size=2) * [7, 4], -16, 16) * (number > 0)
        camera = face_camera(Lens(lens), figure.head, figure.neutral, *map(float, turn), SIDE)
        scene, _ = quick.paint(figure, expression, gaze, camera, 1.0)
        picture = film.tone(scene * (exposure * balance)).astype(np.float32)
        wrong = 1 + 0.05 * options.error * rng.normal(size=len(expression))
        believed = np.clip(expression * wrong, 0, 1).astype(np.float32)
        shape = neutral
        if options.error > 0:
            marks = figure.head.landmarks(figure.head.vertices(figure.neutral, expression, gaze))
            shape = neutral + registration(figure, head, neutral, marks, believed, gaze, camera)
        light = quick.turned(figure.environment, rotation.matrix(camera.rotation)).irradiance()
        yield picture, camera, head, head.vertices(shape, believed, gaze), light


@dataclass(frozen=True)
class Lens:
    """What `face_camera` asks of a fit."""

    camera: object


def write(stage, folder, people, seed=0, count=48, skin_folder=None):
    """Paint performers into a folder, a file each; an interrupted run goes on where it stopped.

    Args:
        folder: Path; made if missing.
        people: how many the folder shall hold.
        seed: person k depends on (seed, k) and the skins alone.
        count: expressions a person.
        skin_folder: Path of skins to mix; None paints skin from pigments.

    Yields:
        Path of each file once it is written.
    """
    from safetensors.numpy import save

    what = played(count)
    paths = skins.skins_of(skin_folder, stage.head) if skin_folder else ()
    folder.mkdir(parents=True, exist_ok=True)
    for number in range(people):
        path = folder / NAME.format(number)
        if path.exists():
            continue
        textures, seen = zip(*paint_person(stage, (seed, number), what, paths=paths))
        arrays = {"textures": np.array(textures), "seen": np.array(seen)}
        about = {"head": stage.head.name, "seed": [seed, number], "skins": bool(paths)}
        write_bytes(path, save(arrays, {"performer": json.dumps(about, sort_keys=True)}))
        yield path
