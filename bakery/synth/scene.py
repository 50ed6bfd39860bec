"""What surrounds the subject in one picture: camera, expression, light, background, film."""

from dataclasses import dataclass, field, replace

import numpy as np

from bakery.geometry import rotation
from bakery.geometry.harmonics import direction
from bakery.heads.base import look, weights
from bakery.synth.light import Environment, Lamp, dome
from bakery.types import EXPRESSIONS, Camera


@dataclass(frozen=True)
class Scene:
    """One picture's circumstances."""

    camera: Camera
    environment: Environment
    expression: np.ndarray = field(default_factory=lambda: np.zeros(len(EXPRESSIONS), np.float32))
    gaze: np.ndarray = field(default_factory=lambda: np.zeros(2))  # degrees, head space
    background: str = "studio"  # see `film.background`
    background_color: np.ndarray = field(default_factory=lambda: np.array([0.30, 0.31, 0.33]))
    seed: int = 0
    grain: float = 1.0
    blur: float = 0.5
    contrast: float = 0.0  # see `film.develop`
    quality: int | None = 94


def portrait_camera(
    width,
    height,
    yaw=0.0,
    pitch=0.0,
    roll=0.0,
    filling=0.56,
    distance=1150.0,
    middle=(0.5, 0.50),
    span=215.0,
):
    """A camera that looks at the head.

    Args:
        yaw, pitch, roll: degrees the head is turned by: to its left, up, to the picture's left.
        filling: share of the picture's height between chin and crown.
        distance: mm from the eyes.
        middle: where in the picture the middle of the head lies, shares of width and height.
        span: mm from chin to crown.
    """
    turn = rotation.matrix([0, 0, np.radians(roll)]) @ rotation.yaw_pitch(yaw, pitch)
    focal = filling * height / span * distance
    pivot = np.array([0.0, 0.0, -60.0])
    translation = np.array([0, 0, -distance]) + pivot - turn @ pivot
    return Camera(
        focal=float(focal),
        center=np.array([middle[0] * width, middle[1] * height]),
        rotation=rotation.vector(turn),
        translation=translation,
        width=int(width),
        height=int(height),
    )


def studio_light(
    azimuth=-35.0,
    elevation=28.0,
    radius=14.0,
    key=0.95,
    fill=0.35,
    rim=0.0,
    ambient=0.30,
    warm=0.0,
    seed=0,
):
    """A portrait's usual light: key, weaker fill from the other side, perhaps a rim, and a dome."""
    rng = np.random.default_rng([seed, 11])
    tint = np.array([1 + 0.06 * warm, 1.0, 1 - 0.09 * warm])
    lamps = [Lamp(direction(azimuth, elevation), key * tint, radius)]
    if fill:
        lamps.append(
            Lamp(
                direction(-azimuth * 0.9 + 8, elevation * 0.4),
                fill * np.array([1, 1.0, 1.01]),
                24.0,
            )
        )
    if rim:
        lamps.append(Lamp(direction(180 - azimuth * 0.6, 30), rim * tint[::-1], 12.0))
    return Environment(tuple(lamps), dome(rng, ambient, warm))


EXPRESSIVE = {  # mixtures that faces really make, with their weights at full strength
    "smile": {
        "mouthSmileLeft": 0.57, "mouthSmileRight": 0.54, "cheekSquintLeft": 0.5, "cheekSquintRight": 0.5,
        "eyeSquintLeft": 0.25, "eyeSquintRight": 0.25, "mouthUpperUpLeft": 0.45, "mouthUpperUpRight": 0.45,
        "mouthDimpleLeft": 0.2, "mouthDimpleRight": 0.2, "jawOpen": 0.12, "mouthLowerDownLeft": 0.15, "mouthLowerDownRight": 0.15,
    },
    "closed smile": {
        "mouthSmileLeft": 0.33, "mouthSmileRight": 0.36, "cheekSquintLeft": 0.3, "cheekSquintRight": 0.3,
        "mouthDimpleLeft": 0.2, "mouthDimpleRight": 0.2, "mouthPressLeft": 0.15, "mouthPressRight": 0.15,
    },
    "surprise": {
        "browInnerUp": 0.8, "browOuterUpLeft": 0.7, "browOuterUpRight": 0.7, "eyeWideLeft": 0.7,
        "eyeWideRight": 0.7, "jawOpen": 0.4,
    },
    "frown": {
        "browDownLeft": 0.8, "browDownRight": 0.8, "mouthFrownLeft": 0.6, "mouthFrownRight": 0.6,
        "mouthPressLeft": 0.3, "mouthPressRight": 0.3,
    },
    "open": {"jawOpen": 0.6, "mouthFunnel": 0.2, "mouthLowerDownLeft": 0.3, "mouthLowerDownRight": 0.3},
    "blink": {"eyeBlinkLeft": 1.0, "eyeBlinkRight": 1.0},
    "wink": {"eyeBlinkLeft": 1.0, "cheekSquintLeft": 0.6, "mouthSmileLeft": 0.24},
    "pucker": {"mouthPucker": 0.8},
    "jaw aside": {"jawLeft": 0.5, "mouthLeft": 0.4},
    "disgust": {
        "noseSneerLeft": 0.8, "noseSneerRight": 0.8, "mouthUpperUpLeft": 0.5, "mouthUpperUpRight": 0.5,
        "browDownLeft": 0.5, "browDownRight": 0.5,
    },
}  # fmt: skip


def random_expression(rng, neutral=0.35):
    """Expression weights [E] and gaze [2] degrees; a share `neutral` of draws is neutral."""
    gaze = np.clip(rng.normal(size=2) * [9, 5], -26, 26) * (rng.random() < 0.6)
    out = np.zeros(len(EXPRESSIONS), np.float32)
    if rng.random() > neutral:
        for _ in range(int(rng.integers(1, 3))):
            name = str(rng.choice(list(EXPRESSIVE)))
            out = np.maximum(out, weights(EXPRESSIVE[name]) * rng.uniform(0.3, 1.0))
        out += (rng.random(len(out)) < 0.06) * rng.uniform(0, 0.35, len(out)).astype(np.float32)
        out[EXPRESSIONS.index("tongueOut")] = 0
    return look(np.clip(out, 0, 1), gaze), gaze


def neutral_scene(scene: Scene) -> Scene:
    """The same picture of a resting face that looks straight ahead."""
    rest = np.zeros(len(EXPRESSIONS), np.float32)
    return replace(scene, expression=rest, gaze=np.zeros(2))


def random_scene(rng: np.random.Generator, width: int, height: int, turn: float = 1.0) -> Scene:
    """Draw a scene for training: any light, view within about +-40 degrees, any expression."""
    expression, gaze = random_expression(rng)
    yaw = float(np.clip(rng.normal() * 16, -45, 45)) * turn
    filling = float(rng.uniform(0.42, 0.80))
    camera = portrait_camera(
        width,
        height,
        yaw=yaw,
        pitch=float(np.clip(rng.normal() * 8, -22, 22)) * turn,
        roll=float(np.clip(rng.normal() * 8, -28, 28)) * turn,
        filling=filling,
        distance=float(rng.uniform(500, 2400)),
        middle=(0.5 + rng.normal() * 0.04, 0.5 + rng.normal() * 0.04),
    )
    hard = rng.random() < 0.25
    environment = studio_light(
        azimuth=float(rng.uniform(-85, 85)),
        elevation=float(rng.uniform(-5, 65)),
        radius=float(rng.uniform(2, 6) if hard else rng.uniform(8, 28)),
        key=float(rng.uniform(0.25, 1.1)),
        fill=float(rng.uniform(0, 0.5)),
        rim=float(rng.choice([0, rng.uniform(0, 1.0)])),
        ambient=float(rng.uniform(0.15, 0.5)),
        warm=float(rng.normal()),
        seed=int(rng.integers(2**31)),
    )
    return Scene(
        camera,
        environment,
        expression,
        gaze,
        str(rng.choice(["studio", "room", "garden"])),
        np.exp(rng.normal(size=3) * 0.22) * float(np.exp(rng.uniform(np.log(0.03), np.log(0.9)))),
        int(rng.integers(2**31)),
        grain=float(rng.uniform(0.5, 4)),
        blur=float(rng.uniform(0.3, 1.2)),
        quality=int(rng.integers(55, 97)),
    )
