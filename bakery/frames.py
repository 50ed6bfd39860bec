"""What `bakery render` draws: options to a scene, a scene to pictures."""

from dataclasses import dataclass

import numpy as np

from bakery import steps
from bakery.errors import InputError, ModelError
from bakery.formats import record
from bakery.formats.targets import weight_rows
from bakery.geometry import camera as cameras
from bakery.geometry.color import to_encoded
from bakery.geometry.fill import smoothstep
from bakery.heads.base import gaze_of, look
from bakery.heads.file import load_head
from bakery.heads.lashes import carried, own_vertices
from bakery.landmarks import face_size
from bakery.runtime.blend import face_texture
from bakery.runtime.render import draw, over_gray, over_photo, portrait_at
from bakery.stages.condition import face_camera
from bakery.types import EXPRESSIONS, Fit

SIZE = 512  # pixels
FACE_SHARE = 0.6  # of the picture's height that the face takes
VIEWS = ("photo", "front")
# Distance of two fitted heads, in outer-eye-corner distances. Neutral and smiling photos of one
# person of london/train: 0.014 to 0.052; of two people: 0.030 (5%), 0.045 (median).
ALIKE = (0.055, 0.035)


@dataclass(frozen=True)
class Scene:
    """One frame."""

    expression: np.ndarray  # [E] weights
    gaze: np.ndarray | None  # [2] degrees; None follows the weights
    fit: Fit | None  # of another photo, whose camera is used
    view: str | tuple[float, float]  # "photo", "front" or (yaw, pitch) degrees
    size: int | None  # pixels a side; None is the usual
    dynamic: bool  # whether expressions change the texture
    hair: bool = True  # whether the hair layer is shown


def parse(
    weights="", fitted=None, gaze=None, view="front", size=None, textures="dynamic", hair=True
):
    """The options of the command as the fields of a Scene.

    Raises:
        InputError: one cannot be understood.
    """
    fit = record.read_fit(fitted) if fitted else None
    expression = np.zeros(len(EXPRESSIONS), np.float32) if fit is None else fit.expression
    given = _weights(weights)
    expression = np.where(np.isnan(given), expression, given).astype(np.float32)
    direction = _pair("--gaze", gaze) if gaze else (None if fit is None else fit.gaze)
    if gaze:
        expression = look(expression, direction)
    return {
        "expression": expression,
        "gaze": None if direction is None else np.array(direction, float),
        "fit": fit,
        "view": view if view in VIEWS else _pair("--view", view, "photo, front or "),
        "size": size,
        "dynamic": textures == "dynamic",
        "hair": hair,
    }


def _weights(text):
    """[E] weights of "name=value,..."; nan where nothing is said."""
    table = {}
    for item in filter(None, (part.strip() for part in text.split(","))):
        name, equals, value = item.partition("=")
        try:
            table[name.strip()] = float(value)
        except ValueError:
            raise InputError(f"--weights: '{item}'; give NAME=VALUE, as jawOpen=0.6") from None
    row = weight_rows([table], "--weights")[0]
    return np.array([row[i] if n in table else np.nan for i, n in enumerate(EXPRESSIONS)])


def _pair(option, text, others=""):
    try:
        yaw, pitch = (float(part) for part in text.split(","))
    except ValueError:
        raise InputError(f"{option}: '{text}'; give {others}YAW,PITCH in degrees") from None
    if not (abs(yaw) <= 180 and abs(pitch) <= 90):
        raise InputError(f"{option}: {text}; yaw lies in -180..180, pitch in -90..90")
    return yaw, pitch


def render(avatar, scene):
    """Draw a scene.

    Returns:
        picture [H, W, 3] sRGB-encoded, and the face's pixels [H, W] 0..1.
    """
    camera = _camera(avatar, scene)
    gaze = scene.gaze if scene.gaze is not None else gaze_of(scene.expression).mean(0)
    neutral = neutral_for(avatar.head, avatar.neutral, avatar.fit.head, scene.fit)
    vertices = avatar.head.vertices(neutral, scene.expression, gaze)
    frame = draw(avatar, vertices, camera, scene.expression, gaze, scene.dynamic, scene.hair)
    face = np.minimum(frame.alpha, frame.face)
    if scene.view == "photo" and scene.fit is None and avatar.photo is not None:
        portrait, photo = portrait_at(avatar, camera)
        return to_encoded(over_photo(portrait, frame, vertices, photo)), face
    return to_encoded(over_gray(frame)), face


def neutral_for(head, neutral, name, fit):
    """The neutral shape [V, 3] mm to deform for a fit of another photo.

    Blendshapes never explain a smile to the last millimetre; the fit's own warp does. It belongs to
    the avatar's person only if the fitted heads are alike, so it counts in full below ALIKE[1] and
    not at all above ALIKE[0]: then only expression and camera are taken, as from a driver.

    Args:
        head: HeadModel; neutral: [V, 3] mm, the person's own; name: of the head model.
        fit: Fit of the other photo, or None.
    """
    if fit is None or fit.head != name:
        return neutral
    try:
        theirs = steps.fitted_neutral(load_head(fit.head), fit)
    except (InputError, ModelError):  # given by its path, or not installed here
        return neutral
    if len(theirs) not in (len(neutral), own_vertices(head)):
        return neutral
    own, other = (head.landmarks(shape)[:468] for shape in (neutral, theirs))
    own, other = own - own.mean(0), other - other.mean(0)
    size = face_size(own)
    apart = np.sqrt(((own - other) ** 2).sum(1).mean()) / size
    share = smoothstep(*ALIKE, apart)
    return carried(neutral, np.float32(share) * (theirs - neutral[: len(theirs)]))


def _camera(avatar, scene):
    if scene.fit is not None:
        camera = scene.fit.camera
    elif scene.view == "photo":
        camera = avatar.fit.camera
    else:
        yaw, pitch = (0.0, 0.0) if scene.view == "front" else scene.view
        size = scene.size or SIZE
        return face_camera(avatar.fit, avatar.head, avatar.neutral, yaw, pitch, size, FACE_SHARE)
    if scene.size is None:
        return camera
    scale = scene.size / max(camera.width, camera.height)
    width, height = (max(1, round(n * scale)) for n in (camera.width, camera.height))
    return cameras.crop(camera, 0, 0, width, height, scale)


def recover(avatar, names=()):
    """The textures T_e of single expressions, by eq. 4.

    Args:
        names: ARKit names; none means all.

    Returns:
        dict of name -> [T, T, 3] float16 linear.

    Raises:
        InputError: an unknown name.
    """
    textures = avatar.textures
    weight_rows([dict.fromkeys(names, 1.0)], "expressions")  # are they ARKit's?
    single = dict(zip(EXPRESSIONS, np.eye(len(EXPRESSIONS), dtype=np.float32)))
    return {
        name: face_texture(textures, avatar.masks, single[name]).astype(np.float16)
        for name in names or EXPRESSIONS
    }
