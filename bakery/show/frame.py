"""What `bakery render` draws: options to a scene, a scene to pictures."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from bakery.bake.fitting import fitted_neutral, with_parts_of
from bakery.errors import InputError, ModelError, UsageProblem
from bakery.formats import record
from bakery.formats.exr import write_exr
from bakery.formats.image import write_image
from bakery.formats.light import read_light
from bakery.formats.targets import expression_weights, parse_weights, weight_rows
from bakery.geometry import camera as cameras
from bakery.geometry.color import to_encoded, to_linear
from bakery.geometry.fill import enclosed, smoothstep
from bakery.heads.base import gaze_of, look
from bakery.heads.file import load_head
from bakery.heads.lashes import carried, own_vertices
from bakery.landmarks import face_size
from bakery.runtime.avatar import Avatar
from bakery.runtime.blend import face_texture
from bakery.runtime.framing import framed_camera
from bakery.runtime.render import draw, over_gray, over_photo, portrait_at
from bakery.stages.fit.gaze import LIMIT
from bakery.stages.fit.rest import played_back
from bakery.stages.fit.warp import residual_offsets
from bakery.types import EXPRESSIONS, Fit

SIZE = 512  # pixels
VIEWS = ("photo", "front")
BACKGROUNDS = ("none", "gray", "photo")
MASKS = (".png", ".jpg", ".webp")  # files that masks are written to
PICTURES = (*MASKS, ".exr")  # files that pictures are written to
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
    hair: bool = True  # whether hair is shown, layer and mesh
    framing: str = "head"  # "head" or "face": what views other than the photo's own hold
    # "none", "gray", "photo" or [3] linear; None is the photo in its own view, else gray
    background: str | np.ndarray | None = None
    light: np.ndarray | None = None  # [9, 3] of `formats.light`; None is the photo's own


def parse(
    weights="", fitted=None, gaze=None, view="front", size=None, textures="dynamic", hair=True,
    expression="", framing="head", background=None, light=None,
):  # fmt: skip
    """The options of the command as the fields of a Scene.

    A named expression takes the place of the fit's own; weights lie over either.

    Raises:
        InputError: one cannot be understood; UsageProblem: names and angles that there are not.
    """
    fit = record.read_fit(fitted) if fitted else None
    if expression:
        base = expression_weights(expression)
    else:
        base = np.zeros(len(EXPRESSIONS), np.float32) if fit is None else fit.expression
    given = _weights(weights)
    expression = np.where(np.isnan(given), base, given).astype(np.float32)
    direction = _gaze(gaze) if gaze else (None if fit is None else fit.gaze)
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
        "framing": framing,
        "background": _background(background, view, fit, light),
        "light": None if light is None else read_light(light),
    }


def _weights(text):
    """[E] weights of "name=value,..."; nan where nothing is said."""
    table = parse_weights(text, "--weights")
    row = weight_rows([table], "--weights")[0]
    return np.array([row[i] if n in table else np.nan for i, n in enumerate(EXPRESSIONS)])


def _pair(option, text, others=""):
    try:
        yaw, pitch = (float(part) for part in text.split(","))
    except ValueError:
        raise UsageProblem(f"{option}: '{text}'; give {others}YAW,PITCH in degrees") from None
    if not (abs(yaw) <= 180 and abs(pitch) <= 90):
        raise UsageProblem(f"{option}: {text}; yaw lies in -180..180, pitch in -90..90")
    return yaw, pitch


def _gaze(text):
    """Direction of "yaw,pitch" that eyes can take."""
    yaw, pitch = _pair("--gaze", text)
    if abs(yaw) > LIMIT[0] or abs(pitch) > LIMIT[1]:
        raise UsageProblem(
            f"--gaze: {text}; eyes turn {LIMIT[0]:g} degrees aside and {LIMIT[1]:g} up or down at "
            "most; turn the head with --view"
        )
    return yaw, pitch


def _background(text, view, fit, light):
    """A Scene's background from the option, or None."""
    if text == "photo" and light is not None:
        raise InputError("--background photo: it keeps its own light; leave out --light")
    if text == "photo" and (view != "photo" or fit is not None):
        raise InputError("--background photo: only the photo's own view has it; add --view photo")
    if text is None or text in BACKGROUNDS:
        return text
    try:
        code = bytes.fromhex(text.removeprefix("#"))
        if len(code) != 3 or len(text) != 7:
            raise ValueError(text)
    except ValueError:
        raise InputError(
            f"--background: '{text}'; give {', '.join(BACKGROUNDS)} or a colour as '#1e90ff'"
        ) from None
    return to_linear(np.array(list(code), np.float32) / 255)


def output_scene(path: Path, scene: Scene) -> Scene:
    """The scene as a file can hold it: an OpenEXR file has no background unless one is asked for.

    Raises:
        InputError: the file's ending is none that is written, or it has no alpha and needs one.
    """
    check_ending(path, PICTURES)
    kind = path.suffix.lower()
    if kind == ".jpg" and isinstance(scene.background, str) and scene.background == "none":
        raise InputError(f"{path}: JPEG has no alpha; give .png, .webp or .exr")
    if kind == ".exr" and scene.background is None:
        return replace(scene, background="none")
    return scene


def check_ending(path: Path, kinds: tuple[str, ...]) -> None:
    """Refuse a file whose name ends in none of `kinds`.

    Raises:
        InputError: it does.
    """
    if path.suffix.lower() not in kinds:
        raise InputError(f"{path}: is written as {', '.join(kinds)}; give it such a name")


def turntable(scene: Scene, count: int) -> Iterator[Scene]:
    """The scene seen from `count` sides around the head, beginning with its own.

    Raises:
        InputError: its view is the camera of a photo.
    """
    if scene.view == "photo" or scene.fit is not None:
        raise InputError("--turntable: a photo's camera has one view; leave out --view or --fit")
    yaw, pitch = (0.0, 0.0) if scene.view == "front" else scene.view
    for number in range(count):
        yield replace(scene, view=(yaw + 360 * number / count, pitch))


def numbered(path: Path, number: int) -> Path:
    """The name of one picture of a sequence: out.png is out.007.png."""
    return path.with_name(f"{path.stem}.{number:03d}{path.suffix}")


def write(path: Path, picture: np.ndarray) -> None:
    """Write what `draw_scene` drew, by the name's ending.

    Args:
        path: .exr gets half floats, linear and premultiplied; others get sRGB bytes, straight.
        picture: [H, W, 3 or 4].
    """
    if path.suffix.lower() == ".exr":
        write_exr(path, {"head": picture})
    else:
        write_image(path, encoded(picture))


def encoded(picture: np.ndarray) -> np.ndarray:
    """A linear picture [H, W, 3 or 4] sRGB-encoded; premultiplied alpha becomes straight."""
    if picture.shape[2] == 3:
        return to_encoded(picture)
    color, alpha = picture[..., :3], picture[..., 3:]
    return np.concatenate([to_encoded(color / np.maximum(alpha, 1e-6)), alpha], -1)


def render(avatar, scene):
    """Draw a scene.

    Returns:
        picture [H, W, 3] sRGB-encoded ([H, W, 4] with straight alpha without a background), and the
        face's pixels [H, W] 0..1.
    """
    picture, face = draw_scene(avatar, scene)
    return encoded(picture), face


def draw_scene(avatar: Avatar, scene: Scene) -> tuple[np.ndarray, np.ndarray]:
    """Draw a scene, scene-linear.

    Returns:
        picture [H, W, 3] ([H, W, 4] premultiplied without a background), and the face's pixels
        [H, W] 0..1.

    Raises:
        InputError: the photo is wanted behind the head, and the bundle keeps none.
    """
    own = scene.view == "photo" and scene.fit is None and avatar.photo is not None
    background = scene.background
    if background is None:
        background = "photo" if own and scene.light is None else "gray"
    over = isinstance(background, str) and background == "photo"
    if over and not own:
        raise InputError("--background photo: the bundle keeps none; build it with --keep-photo")
    camera = _camera(avatar, scene)
    gaze = scene.gaze if scene.gaze is not None else gaze_of(scene.expression).mean(0)
    neutral = neutral_for(avatar.head, avatar.neutral, avatar.fit, scene.fit, scene.expression)
    vertices = avatar.head.vertices(neutral, scene.expression, gaze)
    seen = (avatar, vertices, camera, scene.expression, gaze, scene.dynamic)
    frame = draw(*seen, scene.hair, scene.light, apart=over)
    face = np.minimum(frame.alpha, frame.face)
    if frame.hair is not None:
        face *= 1 - frame.hair[..., 3]
    if not isinstance(background, str) or background == "none":
        volume = scene.hair and avatar.textures.hair_mesh is not None
        clear = _clear(frame, draw(*seen, hair=False) if volume else None)
        if isinstance(background, str):
            return clear, face
        return clear[..., :3] + (1 - clear[..., 3:]) * background, face
    if over:
        portrait, photo = portrait_at(avatar, camera)
        return over_photo(portrait, frame, vertices, photo), face
    return over_gray(frame), face


def _clear(frame, head=None):
    """The frame [H, W, 4] premultiplied, without holes.

    Between an eye's cap and its lid one looks into the empty head; gray stands there, as in other
    pictures, and nothing of what the head is laid over. What is seen between locks is no hole.

    Args:
        head: the Frame without hair that has volume; None if that is the same.
    """
    hole = enclosed((frame if head is None else head).alpha < 1) & (frame.alpha < 1)
    color = np.where(hole[..., None], over_gray(frame), frame.color)
    return np.dstack([color, np.where(hole, 1, frame.alpha)])


def neutral_for(head, neutral, mine, fit, expression):
    """The neutral shape [V, 3] mm to deform for a fit of another photo.

    Blendshapes never explain a smile to the last millimetre; the fit's own warp does. It belongs to
    the avatar's person only if the fitted heads are alike, so it counts in full below ALIKE[1] and
    not at all above ALIKE[0]: then only expression and camera are taken, as from a driver.

    Args:
        head: HeadModel; neutral: [V, 3] mm, the person's own; mine: their Fit.
        fit: Fit of the other photo, or None; expression: [E] weights that it will be deformed by.
    """
    if fit is None or fit.head != mine.head:
        return neutral
    try:
        plain = load_head(fit.head)
        theirs = fitted_neutral(plain, with_parts_of(fit, mine))
        resting = theirs + residual_offsets(plain, fit.rest)
        back = played_back(plain, fitted_neutral(plain, mine), mine, expression)
    except (InputError, ModelError):  # a head that was given by its path, or is not installed here
        return neutral
    if len(theirs) not in (len(neutral), own_vertices(head)):
        return neutral
    own, other = (head.landmarks(shape)[:468] for shape in (neutral, resting))
    own, other = own - own.mean(0), other - other.mean(0)
    size = face_size(own)
    apart = np.sqrt(((own - other) ** 2).sum(1).mean()) / size
    share = smoothstep(*ALIKE, apart)
    # The avatar's expressions carry what was taken off its own neutral shape: not so theirs.
    return carried(neutral, np.float32(share) * (theirs + back - neutral[: len(theirs)]))


def _camera(avatar, scene):
    if scene.fit is not None:
        camera = scene.fit.camera
    elif scene.view == "photo":
        camera = avatar.fit.camera
    else:
        yaw, pitch = (0.0, 0.0) if scene.view == "front" else scene.view
        return framed_camera(
            scene.framing, avatar.fit, avatar.head, avatar.neutral, yaw, pitch, scene.size or SIZE,
            avatar.textures.hair_mesh if scene.hair else None,
        )  # fmt: skip
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
