"""What `bakery generate` paints: the generator's own picture of a portrait (paGAN section 4)."""

from dataclasses import dataclass, replace

import cv2
import numpy as np

from bakery import __version__
from bakery.bake.faces import landmarks_file, one_face
from bakery.bake.subject import FittedSubject
from bakery.errors import InputError
from bakery.formats import video
from bakery.formats.mark import IPTC
from bakery.formats.place import scratch
from bakery.generators.channels import NONE, face_mask
from bakery.generators.shade import is_part
from bakery.generators.steady import SteadyGenerator
from bakery.geometry import camera as cameras
from bakery.geometry import rotation
from bakery.geometry.color import to_encoded
from bakery.geometry.fill import enclosed
from bakery.geometry.sample import bilinear, interpolate
from bakery.heads.base import gaze_of
from bakery.heads.file import load_head
from bakery.landmarks import FACE
from bakery.parallel import side_by_side
from bakery.runtime.blend import lay_hair
from bakery.show import frame as frames
from bakery.stages.condition import condition, face_camera, finer, shrunk
from bakery.stages.face_frame import face_frame

BACKGROUND = 0.5  # sRGB-encoded gray where the head is not
FILM_RATIO = 0.6  # of the height of a video that the face takes, as `bakery animate` shows it
STEEPEST = 60.0  # degrees of yaw and pitch that are painted


@dataclass(frozen=True)
class Target:
    """What is wanted."""

    expression: np.ndarray  # [E] weights
    gaze: np.ndarray  # [2] degrees, yaw and pitch
    fit: object = None  # Fit of another photo, in whose camera the picture is painted
    view: tuple[float, float] = (0.0, 0.0)  # degrees, yaw and pitch, without a fit


def parse(weights="", fitted=None, gaze=None, yaw=None, pitch=None):
    """The options of the command as a Target.

    Raises:
        InputError: one cannot be understood, or a view is given beside a fit.
    """
    if fitted and (yaw is not None or pitch is not None):
        raise InputError("--fit brings its own view; leave out --yaw and --pitch, or --fit")
    asked = frames.parse(weights, fitted, gaze)
    direction = asked["gaze"]
    if direction is None:
        direction = gaze_of(asked["expression"]).mean(0)
    view = (yaw or 0.0, pitch or 0.0)
    if max(map(abs, view)) > STEEPEST:
        raise InputError(f"--yaw and --pitch: {view}; at most {STEEPEST:g} degrees are painted")
    return Target(asked["expression"], direction, asked["fit"], view)


def fit_subject(photo, head, options, landmarks=None, face=None, frame=None):
    """Fit and unwrap the portrait: FittedSubject.

    Raises:
        BakeryError: it cannot be used.
    """
    image, found = one_face(photo, frame, landmarks_file(landmarks, photo), face)
    return FittedSubject(photo, found, load_head(head), options, photo=image)


def paint(fitted, target, generator, hair=True):
    """Paint a target.

    A target in another photo's camera is painted in a square around the face, as the generator
    knows it, and what it changes is laid over the deformed neutral at the photo's own resolution.

    Args:
        generator: generators.base.Generator.
        hair: whether the hair of the portrait is laid over.

    Returns:
        picture [H, W, 3] float32 sRGB-encoded, and the face [H, W] 0..1 as `channels.face_mask` has
        it. The hair layer is no part of that: it carries skin too, beside the hair.
    """
    own = fitted.neutral.fit
    neutral = frames.neutral_for(
        fitted.head, fitted.subject.neutral, own, target.fit, target.expression
    )
    if target.fit is None:
        frame = face_camera(own, fitted.head, neutral, *target.view)
        camera = finer(frame)
    else:
        camera, affine = face_frame(target.fit, target.fit.landmarks_projected)

    def drawn(camera):
        return condition(
            fitted.head, neutral, fitted.subject.texture, target.expression, target.gaze, camera
        )

    seen = drawn(camera)
    made = generator.generate(fitted.subject, seen)
    image = made.image
    if target.fit is not None:
        seen = drawn(target.fit.camera)
        layers = np.concatenate(
            [np.log(np.maximum(made.ratio, 1e-3)), made.color, made.alpha[..., None]], -1
        )
        image = _changed(seen.deformed_neutral, layers, affine)
    picture = _shown(fitted, seen, image, hair)
    face = face_mask(fitted.head, seen) / np.float32(255)
    face[enclosed(face < 1)] = 1  # cheeks lie far from the next landmark
    if target.fit is None:
        picture, face = shrunk(picture, frame), shrunk(face, frame)
    return picture, face


def _shown(fitted, seen, image, hair=True):
    """A generated picture [H, W, 3] linear with hair and background, encoded."""
    if hair:
        image = haired(fitted, seen, image)
    inside = seen.part != NONE
    picture = np.where(inside[..., None], to_encoded(np.clip(image, 0, 1)), BACKGROUND)
    return picture.astype(np.float32)


def haired(fitted, seen, image):
    """A generated picture [H, W, 3] linear of Conditions, with the portrait's hair layer on it."""
    uv = interpolate(seen.fragments, fitted.head.uv[fitted.head.uv_faces])
    skin = is_part(seen.part, "skin")[..., None]
    return lay_hair(image, bilinear(fitted.hair, uv * fitted.hair.shape[0]) * skin)


def _changed(deformed, layers, affine):
    """The deformed neutral [H, W, 3] with a change [S, S, 7] that was painted around the face."""
    height, width = deformed.shape[:2]
    matrix = affine.copy()
    matrix[:, 2] += 0.5 * matrix[:, :2].sum(1) - 0.5  # pixel centres lie at +0.5
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    parts = [
        cv2.warpAffine(np.ascontiguousarray(part), matrix, (width, height), flags=flags)
        for part in (layers[..., :3], layers[..., 3:6], layers[..., 6])
    ]
    alpha = parts[2][..., None]
    return deformed * np.exp(parts[0]) * (1 - alpha) + parts[1] * alpha


def film(fitted, take, generator, output, view=(0.0, 0.0), frames=None, progress=None):
    """Paint every frame of a take into a video.

    Each frame is painted from its own conditions; `generators.steady` keeps it near the last one.

    Args:
        take: formats.livelink.Take.
        generator: generators.base.Generator.
        output: .mp4 or .webm.
        view: degrees of yaw and pitch that the take's head motion is seen from.
        frames: range of frames, or None for all.
        progress: called with (step, done, total).

    Raises:
        InputError: neither .mp4 nor .webm.
    """
    kind = video.kind_of(output)
    count = int(np.floor(take.seconds[-1] * take.rate + 1e-6)) + 1
    chosen = range(count)[frames.start : frames.stop] if frames else range(count)
    if not len(chosen):
        raise InputError(f"--frames: the take has {count} frames; begin below that")
    still = face_camera(
        fitted.neutral.fit, fitted.head, fitted.subject.neutral, *view, ratio=FILM_RATIO
    )
    show = progress or (lambda step, done, total: None)
    subject, steady = fitted.subject, SteadyGenerator(generator)

    def painted(pose):
        weights, gaze, camera = pose
        seen = condition(
            fitted.head, subject.neutral, subject.texture, weights, gaze, finer(camera)
        )
        return seen, generator.generate(subject, seen)

    def pictures():
        for k, (seen, made) in enumerate(side_by_side(painted, poses(fitted, take, still, chosen))):
            image = steady.follow(fitted.head, seen, made).image
            picture = shrunk(_shown(fitted, seen, image), still)
            yield np.round(picture * 255).astype(np.uint8)
            show("generate", k + 1, len(chosen))

    note = video.Note(
        f"Synthetic media: a portrait animated by bakery {__version__}; not a recording of this "
        "person.",
        IPTC + generator.source_type,
    )
    with scratch() as folder:
        part = folder / "part"
        part.write_bytes(video.encode(pictures(), kind, take.rate, video.codec_of(kind)))
        video.join(output, [part], kind, take.rate, (still.width, still.height), note)


def poses(fitted, take, still, numbers):
    """Expression [E], gaze [2] degrees and Camera of the frames `numbers` of a take.

    Args:
        still: the camera of a head that is not turned.
    """
    weights, turns, eyes = take.at(np.array(numbers) / take.rate)
    gazes = [gaze_of(row).mean(0) for row in weights] if eyes is None else eyes.mean(1)
    for row, gaze, angles in zip(weights, gazes, turns):
        yield row, gaze, turned(fitted, still, angles)


def turned(fitted, camera, angles):
    """The camera of a head that is turned by angles [3]: yaw, pitch and roll in degrees."""
    yaw, pitch, roll = angles
    tilt = rotation.matrix([0, 0, -np.radians(roll)])
    turn = rotation.matrix(camera.rotation) @ rotation.yaw_pitch(yaw, pitch) @ tilt
    points = fitted.head.landmarks(fitted.subject.neutral)[:FACE]
    pivot = np.array([0.0, *points[:, 1:].mean(0)])
    where = cameras.to_camera(pivot, camera)
    return replace(camera, rotation=rotation.vector(turn), translation=where - turn @ pivot)
