"""The portraits of `samples/`: six people who never lived, written down trait by trait."""

import hashlib

import numpy as np

from bakery.errors import InputError
from bakery.formats.files import write_bytes
from bakery.formats.image import write_image
from bakery.formats.record import dump, faces_to_table
from bakery.heads.base import look, weights
from bakery.synth.likeness import identity_of
from bakery.synth.render import dress, paint
from bakery.synth.scene import EXPRESSIVE, Scene, portrait_camera, studio_light
from bakery.synth.subject import Subject
from bakery.types import Landmarks

WIDTH, HEIGHT = 1024, 1280


# What each face looks like, as mm more than the mean head; see `likeness`.
FACES = {
    "anna": {
        "face_width": -3, "jaw_width": -6, "chin_width": -3, "chin_height": -2, "nose_width": -4,
        "nose_length": -1, "eye_width": 2, "eye_open": 1.3, "brow_height": 1.5, "upper_lip": 0.2,
        "lower_lip": 0.5, "mouth_width": -1, "lip_gap": -1, "corner": 1.5,
    },
    "bela": {
        "jaw_width": 3, "nose_length": 2, "nose_width": -1, "nose_depth": 2, "brow_height": -1.5,
        "upper_lip": -0.5, "mouth_width": 2, "chin_height": 2, "eye_width": 1, "corner": 1.5,
    },
    "chidi": {
        "nose_width": 6, "upper_lip": 2, "lower_lip": 2, "mouth_width": 4, "nose_depth": -1,
        "eye_width": 1.5, "eye_open": 0.5, "jaw_width": -2, "lip_gap": -1, "corner": 1.5,
    },
    "dalia": {
        "nose_width": 1, "upper_lip": 1, "lower_lip": 1.4, "eye_open": 1.2, "eye_width": 2,
        "jaw_width": -6, "chin_width": -3, "brow_height": 1.5, "chin_height": -2, "corner": 1,
    },
    "emil": {
        "nose_length": 4, "nose_width": 3, "upper_lip": -1.6, "lower_lip": -1.4, "lip_gap": 2,
        "eye_open": -1, "brow_height": -1, "chin_height": 3, "eye_tilt": -1.2, "jaw_width": 2, "corner": 0.5,
    },
    "fumiko": {
        "face_width": 3, "eye_open": -1, "eye_tilt": 1, "nose_length": -2, "nose_width": 2,
        "bridge_depth": -3, "eye_gap": 2, "jaw_width": -2, "chin_height": -1, "upper_lip": -0.3, "corner": 1.5,
    },
}  # fmt: skip


def _scene(seed, background, color, expression=None, gaze=(0.0, -3.5), light=None, **camera):
    return Scene(
        portrait_camera(WIDTH, HEIGHT, **camera),
        studio_light(**(light or {})),
        look(weights(expression or CALM), gaze),
        np.asarray(gaze, float),
        background,
        np.asarray(color, float),
        seed,
        grain=1.0,
        blur=0.45,
        quality=None,
    )


CALM = {
    "mouthSmileLeft": 0.10,
    "mouthSmileRight": 0.10,
}  # a resting mouth whose corners do not droop


def people(head):
    """Name -> (Subject, Scene) of every sample."""
    smile = {name: weight for name, weight in EXPRESSIVE["smile"].items()}
    return {
        "anna": (
            Subject(
                101, identity_of(head, FACES["anna"], 101), age=29, melanin=0.28, haemoglobin=1.0, freckles=0.5, lip_color=1.1,
                iris="green", hair="bob", hair_color="chestnut", part=-1.0, brow_density=0.85,
                brow_length=0.9, lash_length=1.15, clothes="crew", cloth_color=np.array([0.035, 0.09, 0.085]),
            ),
            _scene(1, "studio", (0.32, 0.33, 0.36), light={"azimuth": -30.0, "elevation": 27.0}),
        ),
        "bela": (
            Subject(
                102, identity_of(head, FACES["bela"], 102), age=36, melanin=0.55, lip_color=0.7, stubble=0.55, iris="brown", hair="side_part",
                hair_color="dark brown", hairline=3.0, brow_density=1.15, brow_length=1.1, lash_length=0.85,
                clothes="collar", cloth_color=np.array([0.42, 0.50, 0.60]),
            ),
            _scene(2, "room", (0.34, 0.30, 0.25), light={"azimuth": 48.0, "fill": 0.25}, yaw=-7.0),
        ),
        "chidi": (
            Subject(
                103, identity_of(head, FACES["chidi"], 103), age=31, melanin=2.4, gloss=0.9, lip_color=0.8, iris="dark brown", hair="curly",
                hair_color="black", stubble=0.25, brow_density=1.1, lash_length=0.9, clothes="crew",
                cloth_color=np.array([0.55, 0.53, 0.48]),
            ),
            _scene(3, "studio", (0.26, 0.21, 0.17), light={"azimuth": -38.0, "rim": 0.5}),
        ),
        "dalia": (
            Subject(
                104, identity_of(head, FACES["dalia"], 104), age=27, melanin=1.55, lip_color=1.3, iris="dark brown",
                hair="pulled_back", hair_color="black", brow_density=1.0, brow_length=0.95, lash_length=1.2,
                clothes="turtleneck", cloth_color=np.array([0.33, 0.07, 0.05]),
            ),
            _scene(4, "garden", (0.22, 0.30, 0.20), smile, light={"azimuth": 25.0, "warm": 0.6}),
        ),
        "emil": (
            Subject(
                105, identity_of(head, FACES["emil"], 105), age=69, melanin=0.32, lip_color=0.65, moles=7, iris="blue",
                hair="thinning", hair_color="grey", grey=0.6, hairline=9.0, brow_density=0.9,
                brow_length=1.15, lash_length=0.75, clothes="collar",
                cloth_color=np.array([0.60, 0.60, 0.58]),
            ),
            _scene(5, "studio", (0.20, 0.23, 0.27), light={"azimuth": -42.0, "radius": 10.0}, yaw=4.0),
        ),
        "fumiko": (
            Subject(
                106, identity_of(head, FACES["fumiko"], 106), age=58, melanin=0.62, haemoglobin=0.9, moles=5, iris="dark brown",
                hair="bob", hair_color="black", grey=0.35, part=1.0, brow_density=0.7, lash_length=0.9,
                lip_color=0.95, clothes="crew", cloth_color=np.array([0.16, 0.14, 0.22]),
            ),
            _scene(6, "room", (0.42, 0.40, 0.37), light={"azimuth": 32.0}, yaw=6.0),
        ),
    }  # fmt: skip


def truth_table(picture):
    """The landmarks of a painted picture as the JSON table that `bakery detect` writes."""
    height, width = picture.encoded.shape[:2]
    points = picture.landmarks
    low, high = points.min(0), points.max(0)
    face = Landmarks(
        box=np.concatenate([low, high - low]),
        score=1.0,
        points=points,
        confidence=np.ones(len(points)),
    )
    return faces_to_table(width, height, [face])


def write(head, folder, names=None, quality=93):
    """Paint the samples into a folder: NAME.jpg and NAME.json, the landmarks.

    Args:
        head: head model; the committed samples use the built-in one.
        folder: Path; made if missing.
        names: which of `people`; None for all.

    Yields:
        Path of each picture once it is written.

    Raises:
        InputError: a name is not one of `people`.
    """
    known = people(head)
    wrong = sorted(set(names or ()) - set(known))
    if wrong:
        raise InputError(
            f"{', '.join(wrong)}: no such sample; known: {', '.join(known)}; name some of these or none"
        )
    folder.mkdir(parents=True, exist_ok=True)
    for name, (subject, scene) in known.items():
        if names and name not in names:
            continue
        picture = paint(dress(head, subject), scene)
        write_image(folder / f"{name}.jpg", picture.encoded, quality)
        write_bytes(folder / f"{name}.json", dump(truth_table(picture)))
        yield folder / f"{name}.jpg"


def digest(picture):
    """Digest of a picture's pixels, to tell whether two runs agree."""
    return hashlib.sha256(np.round(picture.encoded * 255).astype(np.uint8).tobytes()).hexdigest()
