"""All textures of an avatar from one fitted photo: T_0, the keys, gaze and mouths."""

import logging
from dataclasses import dataclass, fields, replace

import cv2
import numpy as np

from bakery.generators.base import Subject
from bakery.generators.shade import is_part
from bakery.geometry import camera as cameras
from bakery.geometry import rotation
from bakery.geometry.color import to_linear
from bakery.geometry.fill import diffuse
from bakery.geometry.sample import bilinear
from bakery.landmarks import FACE
from bakery.parallel import ahead, side_by_side
from bakery.stages.atlas import make_atlas, make_view, see
from bakery.stages.condition import condition, face_camera
from bakery.stages.face_frame import head_photo
from bakery.stages.texture.complete import PAINTED, complete_skin
from bakery.stages.texture.eyes import eye_maps, paint_eyes
from bakery.stages.texture.gaze import gaze_textures
from bakery.stages.texture.hair import Cover, hair_layer
from bakery.stages.texture.interior import paint_interior
from bakery.stages.texture.lashes import lay_lashes
from bakery.stages.texture.lids import lid_skin
from bakery.stages.texture.mouth import mouth_textures
from bakery.types import Textures

log = logging.getLogger(__name__)
VIEWS = (0.0, 40.0, -40.0)  # degrees of yaw that each key expression is painted from
RATIO_TEXELS = 512  # the change T_k / T_0 is no finer than the generator's picture


@dataclass(frozen=True)
class TextureOptions:
    """What to bake."""

    resolution: int = 1024  # T, texels on a side
    views: tuple[float, ...] = VIEWS
    mouths: int = 300  # at most as many poses


@dataclass(frozen=True)
class Targets:
    """The expressions, gazes and mouths that are baked; from presets/expressions."""

    key_names: tuple[str, ...]
    key_weights: np.ndarray  # [K, E]
    gaze: np.ndarray  # [20, 2] degrees
    mouths: np.ndarray  # [M, E]


@dataclass(frozen=True)
class Prepared:
    """One person before any expression is painted."""

    subject: Subject
    source: np.ndarray  # [T, T] uint8, codes of texture_complete
    facing: np.ndarray  # [T, T] float32 0..1
    hair: np.ndarray  # [T, T, 4] float32 linear, colour multiplied by alpha


def prepare(photo, landmarks, fit, neutral, head, cover, resolution):
    """Complete T_0, the eyes and the hair of one person.

    Args:
        photo: Photo.
        landmarks: Landmarks of the face in it.
        fit: Fit of the same photo.
        neutral: [V, 3] mm, the fitted neutral shape with its residual warp.
        cover: Cover of the photo.
        resolution: T.

    Returns:
        Prepared.
    """
    atlas = make_atlas(head, resolution)
    vertices = head.vertices(neutral, fit.expression, fit.gaze)
    image, cover, points, local = _cut_out(
        photo, cover, landmarks.points, fit, head, vertices, resolution
    )
    on_skin = atlas.take("skin")
    sight = see(on_skin, make_view(vertices, head, local.camera, edge=0.75))
    skin = complete_skin(image, cover, points, local, head, vertices, on_skin, sight)
    blank = np.zeros((8, 8, 3), np.float32)
    drawn = condition(head, neutral, blank, fit.expression, fit.gaze, local.camera)
    eyes = eye_maps(
        image, cover.before, points, local, head, vertices, drawn.part, drawn.depth, skin.tone
    )
    texture = skin.color.reshape(-1, 3)
    source = skin.source.reshape(-1)
    sclera = eyes.ball[:, 128, :].reshape(-1, 3)  # the horizontal meridian of both balls
    white = np.percentile(sclera, 75, axis=0)
    for rows, colors in (
        paint_eyes(eyes, head, neutral, atlas),
        paint_interior(head, neutral, atlas, white, skin.tone),
    ):
        texture[atlas.index[rows]] = colors
        source[atlas.index[rows]] = PAINTED
    texture = atlas.fill_gutter(texture.reshape(resolution, resolution, 3))
    lids = lid_skin(head, neutral, texture, atlas)
    turn = rotation.matrix(fit.camera.rotation)
    hair = atlas.fill_gutter(hair_layer(image, cover, head, on_skin, sight))
    return Prepared(
        Subject(
            head,
            neutral,
            texture,
            eyes,
            lids,
            fit.light,
            turn,
            head_photo(photo.encoded, landmarks.points, fit, head, neutral),
        ),
        source.reshape(resolution, resolution),
        skin.facing,
        lay_lashes(hair, texture, head, white),
    )


def _cut_out(photo, cover, points, fit, head, vertices, resolution):
    """The head out of the photo, no finer than the atlas can hold.

    Returns:
        linear image, its Cover, landmarks [L, 2] and Fit, all in its own pixels.
    """
    pixels = cameras.project(vertices[head.part_vertices("skin")], fit.camera)
    face = cameras.project(head.landmarks(vertices)[:FACE], fit.camera)
    low = np.maximum(np.floor(pixels.min(0)) - 8, 0)
    high = np.minimum(np.ceil(pixels.max(0)) + 8, [photo.encoded.shape[1], photo.encoded.shape[0]])
    # A face takes about half of the atlas's side; 1.2 pixels a texel lose nothing when sampled.
    scale = min(1.0, 1.2 * 0.55 * resolution / max(np.ptp(face[:, 1]), 1))
    x0, y0, x1, y1 = *low.astype(int), *high.astype(int)

    def shrink(part):
        # By the very scale of the camera: to whole pixels a side, the far end lies a pixel beside.
        area = cv2.INTER_AREA
        return cv2.resize(part, None, fx=scale, fy=scale, interpolation=area) if scale < 1 else part

    linear = shrink(to_linear(photo.encoded[y0:y1, x0:x1]))
    camera = cameras.crop(fit.camera, x0, y0, linear.shape[1], linear.shape[0], scale)
    layers = Cover(*(shrink(getattr(cover, f.name)[y0:y1, x0:x1]) for f in fields(Cover)))
    return linear, layers, (points - [x0, y0]) * scale, replace(fit, camera=camera)


def key_ratio(subject, generator, fit, expression, views, skin):
    """The change T_k / T_0 of one key expression on the skin, merged from several views.

    Args:
        expression: [E] weights of the key.
        views: degrees of yaw.
        skin: Atlas of the skin at the resolution of the ratio.

    Returns:
        log-ratio [T, T, 3], colour [T, T, 3] and alpha [T, T] float32.
    """
    total = np.zeros((len(skin.index), 7), np.float32)
    mass = np.zeros(len(skin.index), np.float32)
    for yaw in views:
        camera = face_camera(fit, subject.head, subject.neutral, yaw)
        seen = condition(
            subject.head, subject.neutral, subject.texture, expression, (0.0, 0.0), camera
        )
        made = generator.generate(subject, seen)
        view = make_view(seen.vertices, subject.head, camera)
        sight = see(skin, view)
        drawn = cv2.erode(is_part(seen.part, "skin").astype(np.float32), np.ones((3, 3)))
        weight = sight.weight() * bilinear(drawn, sight.pixels)
        packed = np.concatenate(
            [np.log(np.maximum(made.ratio, 1e-3)), made.color, made.alpha[..., None]], -1
        )
        total += weight[:, None] * sample_many(packed, sight.pixels)
        mass += weight
    known = np.minimum(mass, 1)
    merged = total / np.maximum(mass, 1e-6)[:, None]
    weight = skin.paint(known)
    # What no view sees did not change: a faint opinion held everywhere that diffusion respects.
    ratio = diffuse(skin.paint(merged[:, :3] * known[:, None]), np.maximum(weight, 0.01))
    return ratio, skin.paint(merged[:, 3:6]), skin.paint(merged[:, 6] * known)


def sample_many(image, points):
    """`bilinear` for more than four channels, which OpenCV's remap does not take."""
    return np.concatenate(
        [
            bilinear(np.ascontiguousarray(image[..., k : k + 4]), points).reshape(len(points), -1)
            for k in range(0, image.shape[2], 4)
        ],
        1,
    )


def key_textures(subject, generator, fit, targets, options):
    """Iterate over T_k [T, T, 3] float16 of the key expressions."""
    atlas = make_atlas(subject.head, min(options.resolution, RATIO_TEXELS)).take("skin")
    size = (options.resolution, options.resolution)

    def paint(weights):
        ratio, color, alpha = key_ratio(subject, generator, fit, weights, options.views, atlas)
        if options.resolution != atlas.size:
            ratio, color, alpha = (
                cv2.resize(layer, size, interpolation=cv2.INTER_LINEAR)
                for layer in (ratio, color, alpha)
            )
        alpha = alpha[..., None]
        return (subject.texture * np.exp(ratio) * (1 - alpha) + color * alpha).astype(np.float16)

    return side_by_side(paint, targets.key_weights)


def with_own_gaze(directions, gaze):
    """The directions [n, 2] with the nearest one moved to the photo's own gaze [2].

    So one texture shows the eyes just as they were photographed.
    """
    out = np.array(directions, float)
    out[((out - gaze) ** 2).sum(1).argmin()] = gaze
    return out


def _announced(painted, words, say):
    """The pictures of an iterator, each made after its word was said."""
    for word in words:
        say(word)
        yield next(painted)


def bake(photo, landmarks, fit, neutral, head, cover, generator, targets, options, progress=None):
    """Paint every texture of the avatar.

    Args:
        photo, landmarks, fit: the portrait and what was found in it.
        neutral: [V, 3] mm, fitted neutral shape with its residual warp.
        cover: Cover of the photo.
        generator: generators.base.Generator.
        targets: Targets.
        options: TextureOptions.
        progress: called with a word before each picture is made.

    Returns:
        Textures.
    """
    say = progress or (lambda word: None)
    say("neutral")
    if hasattr(generator, "get_ready"):
        ahead(generator.get_ready, head)
    prepared = prepare(photo, landmarks, fit, neutral, head, cover, options.resolution)
    subject = prepared.subject
    painted = key_textures(subject, generator, fit, targets, options)
    keys = list(_announced(painted, [f"key {name}" for name in targets.key_names], say))
    camera = face_camera(fit, head, neutral)
    directions = with_own_gaze(targets.gaze, fit.gaze)
    painted = gaze_textures(subject, generator, camera, directions, options.resolution)
    gaze = [x.astype(np.float16) for x in _announced(painted, ["gaze"] * len(directions), say)]
    poses = targets.mouths[: options.mouths]
    painted = mouth_textures(subject, generator, camera, poses, options.resolution)
    mouths, lips = [], []
    for texture, landmarks_of_pose in _announced(painted, ["mouth"] * len(poses), say):
        mouths.append(texture.astype(np.float16))
        lips.append(landmarks_of_pose)
    return Textures(
        neutral=subject.texture.astype(np.float16),
        keys=np.stack(keys),
        key_names=targets.key_names,
        key_weights=targets.key_weights,
        source=prepared.source,
        facing=prepared.facing.astype(np.float16),
        hair=prepared.hair.astype(np.float16),
        gaze=np.stack(gaze),
        gaze_directions=directions,
        mouths=np.stack(mouths),
        mouth_landmarks=np.stack(lips),
        mouth_weights=poses,
    )
