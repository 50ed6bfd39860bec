"""The portraits of `samples/`: six people who never lived, written down trait by trait."""

import hashlib

import numpy as np

from bakery.errors import InputError
from bakery.formats.files import write_bytes
from bakery.formats.image import write_image
from bakery.formats.mark import PAINTED
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
        "face_width": -4, "jaw_width": -8, "chin_width": -4, "chin_height": -3, "nose_width": -3.5,
        "nose_length": -2, "eye_width": 2.5, "eye_open": 2.0, "brow_height": 2.2, "upper_lip": 0.7,
        "lower_lip": 1.1, "mouth_width": 3.5, "lip_gap": -2, "corner": 4,
    },
    "bela": {
        "jaw_width": 2, "nose_length": 2, "nose_width": -2, "nose_depth": 2, "brow_height": -0.5,
        "upper_lip": 0.2, "lower_lip": 0.4, "mouth_width": 0.5, "chin_height": 1, "eye_width": 1.5,
        "eye_open": 1.2, "corner": 4, "face_width": -2,
    },
    "chidi": {
        "nose_width": 6, "upper_lip": 2.2, "lower_lip": 2.2, "mouth_width": 2.5, "nose_depth": -1,
        "eye_width": 1.5, "eye_open": 1.4, "jaw_width": -2, "lip_gap": -1, "corner": 4, "brow_height": 1,
    },
    "dalia": {
        "face_width": -3, "nose_width": 1, "upper_lip": 1.4, "lower_lip": 1.6, "eye_open": 2.2, "eye_width": 3,
        "jaw_width": -8, "chin_width": -4, "brow_height": 2, "chin_height": -2, "corner": 4, "mouth_width": 5,
    },
    "emil": {
        "nose_length": 4, "nose_width": 2, "upper_lip": -0.8, "lower_lip": -0.6, "lip_gap": 1,
        "eye_open": 0, "brow_height": -0.5, "chin_height": 2, "eye_tilt": -1.2, "jaw_width": 1,
        "corner": 3, "mouth_width": 0.5,
    },
    "fumiko": {
        "face_width": 2, "eye_open": 0.4, "eye_tilt": 1.2, "nose_length": -2.5, "nose_width": 1,
        "bridge_depth": -3, "eye_gap": 2, "jaw_width": -5, "chin_width": -3, "chin_height": -2,
        "upper_lip": 0.2, "lower_lip": 0.6, "corner": 4, "mouth_width": 3, "lip_gap": -1,
    },
}  # fmt: skip
CLOSELY = {"sharpness": 0.4, "largest": 3.0}  # how far `likeness` goes for them
CALM = {
    "mouthSmileLeft": 0.19,
    "mouthSmileRight": 0.19,
}  # a resting mouth whose corners do not droop


STILL = {"mouthSmileLeft": 0.05, "mouthSmileRight": 0.05}  # wide mouths smile by their shape


def _scene(seed, background, color, expression=None, gaze=(0.0, -2.0), light=None, **camera):
    """A portrait as official ones are taken: from two metres, by a large soft lamp with fill and rim."""
    framing = {"filling": 0.57, "distance": 2000.0, "middle": (0.5, 0.445)}
    lamps = {"key": 1.05, "fill": 0.32, "rim": 0.7, "ambient": 0.27, "radius": 16.0}
    return Scene(
        portrait_camera(WIDTH, HEIGHT, **(framing | camera)),
        studio_light(**(lamps | (light or {}))),
        look(weights(expression or CALM), gaze),
        np.asarray(gaze, float),
        background,
        np.asarray(color, float),
        seed,
        grain=0.8,
        blur=0.55,
        contrast=0.55,
        quality=None,
    )


def people(head):
    """Name -> (Subject, Scene) of every sample."""

    def face(name, seed):
        return identity_of(head, FACES[name], seed, **CLOSELY)

    return {
        "anna": (
            Subject(
                101, face("anna", 101), age=29, melanin=0.26, haemoglobin=1.05, freckles=0.45, lip_color=1.5,
                iris="green", hair="long_wavy", hair_color="chestnut", part=-1.0, brow_density=0.95,
                brow_length=0.9, lash_length=1.2, clothes="crew", cloth_color=np.array([0.035, 0.09, 0.085]),
            ),
            _scene(1, "studio", (0.30, 0.33, 0.38), light={"azimuth": -32.0, "elevation": 30.0}),
        ),
        "bela": (
            Subject(
                102, face("bela", 102), age=38, melanin=0.5, lip_color=0.8, stubble=0.0, beard=6.0, iris="brown",
                hair="side_part", hair_color="dark brown", hairline=3.0, brow_density=1.2, brow_length=1.1,
                lash_length=0.85, clothes="suit", cloth_color=np.array([0.018, 0.022, 0.034]),
                shirt_color=(0.46, 0.53, 0.64), tie_color=None,
            ),
            _scene(2, "studio", (0.30, 0.27, 0.23), STILL, light={"azimuth": 30.0, "fill": 0.45}, yaw=-7.0),
        ),
        "chidi": (
            Subject(
                103, face("chidi", 103), age=33, melanin=2.1, gloss=1.0, lip_color=0.9, iris="dark brown", hair="curly",
                hair_color="black", stubble=0.2, brow_density=1.1, lash_length=0.95, clothes="suit",
                cloth_color=np.array([0.028, 0.032, 0.042]), tie_color=(0.16, 0.018, 0.022),
            ),
            _scene(3, "studio", (0.20, 0.26, 0.32), STILL, light={"azimuth": -36.0, "rim": 1.0}),
        ),
        "dalia": (
            Subject(
                104, face("dalia", 104), age=27, melanin=1.25, lip_color=1.6, iris="dark brown",
                hair="bun", hair_color="black", hairline=3.0, brow_density=1.0, brow_length=0.95, lash_length=1.25,
                clothes="turtleneck", cloth_color=np.array([0.33, 0.05, 0.045]),
            ),
            _scene(4, "garden", (0.22, 0.30, 0.20), EXPRESSIVE["smile"], light={"azimuth": 28.0, "warm": 0.6}),
        ),
        "emil": (
            Subject(
                105, face("emil", 105), age=69, melanin=0.30, lip_color=0.8, moles=7, iris="blue",
                hair="receding", hair_color="grey", grey=0.6, hairline=4.0, brow_density=1.0,
                brow_length=1.15, lash_length=0.8, clothes="suit", cloth_color=np.array([0.05, 0.055, 0.065]),
                tie_color=(0.03, 0.06, 0.20),
            ),
            _scene(5, "studio", (0.17, 0.24, 0.31), STILL, light={"azimuth": -40.0, "radius": 12.0}, yaw=4.0),
        ),
        "fumiko": (
            Subject(
                106, face("fumiko", 106), age=56, melanin=0.5, haemoglobin=0.9, moles=4, iris="dark brown",
                hair="fringe", hair_color="black", grey=0.22, part=1.0, brow_density=0.8, lash_length=1.0,
                lip_color=1.5, clothes="jacket", cloth_color=np.array([0.05, 0.045, 0.11]),
            ),
            _scene(6, "studio", (0.42, 0.38, 0.34), STILL, light={"azimuth": 32.0}, yaw=6.0),
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
        write_image(folder / f"{name}.jpg", picture.encoded, quality, PAINTED)
        write_bytes(folder / f"{name}.json", dump(truth_table(picture)))
        yield folder / f"{name}.jpg"


def digest(picture):
    """Digest of a picture's pixels, to tell whether two runs agree."""
    return hashlib.sha256(np.round(picture.encoded * 255).astype(np.uint8).tobytes()).hexdigest()
