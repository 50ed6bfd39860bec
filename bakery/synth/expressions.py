"""Expressions, gazes and views as people show them, to train on."""

import numpy as np

from bakery.heads.base import look, weights
from bakery.stages.texture.mouth import ranging, smiling, talking
from bakery.synth.scene import EXPRESSIVE
from bakery.types import EXPRESSION_INDEX, EXPRESSIONS

FEELINGS = {  # whole-face expressions besides those of `scene.EXPRESSIVE`, at full strength
    "grin": {
        "mouthSmile": 1.0, "mouthUpperUp": 0.4, "mouthDimple": 0.3, "cheekSquint": 0.9, "eyeSquint": 0.5,
        "mouthLowerDown": 0.15,
    },
    "laugh": {
        "mouthSmile": 0.9, "cheekSquint": 0.9, "eyeSquint": 0.6, "mouthUpperUp": 0.5, "jawOpen": 0.4,
        "mouthLowerDown": 0.3, "browInnerUp": 0.2,
    },
    "astonishment": {
        "browInnerUp": 1.0, "browOuterUp": 1.0, "eyeWide": 1.0, "jawOpen": 0.7, "mouthLowerDown": 0.25,
    },
    "anger": {
        "browDown": 1.0, "noseSneer": 0.9, "eyeSquint": 0.7, "mouthUpperUp": 0.7, "mouthPress": 0.4,
        "jawForward": 0.4, "mouthFrown": 0.3,
    },
    "sadness": {
        "browInnerUp": 0.8, "mouthFrown": 0.9, "mouthShrugLower": 0.8, "mouthShrugUpper": 0.4,
        "mouthRollLower": 0.3, "mouthStretch": 0.3, "eyeBlink": 0.3,
    },
    "kiss": {"mouthPucker": 0.9, "mouthFunnel": 0.5, "cheekPuff": 0.4, "mouthRollUpper": 0.2},
    "grimace": {
        "mouthStretch": 1.0, "mouthLowerDown": 0.9, "mouthRollUpper": 0.2, "browDown": 0.5,
        "cheekSquint": 0.4, "mouthUpperUp": 0.3,
    },
    "squint": {"eyeSquint": 1.0, "cheekSquint": 0.7, "browDown": 0.5, "noseSneer": 0.2},
    "raised brows": {"browInnerUp": 0.9, "browOuterUp": 0.9, "eyeWide": 0.3},
    "sneer": {"noseSneer": 1.0, "mouthUpperUp": 0.6, "browDown": 0.4, "cheekSquint": 0.3},
}  # fmt: skip
# Share of the targets: what an avatar is baked from, plus rest, so that the network keeps still.
KINDS = {"smile": 0.28, "feeling": 0.32, "talk": 0.20, "range": 0.10, "rest": 0.10}


def both_sides(mix):
    """Weights [E] of a mix that names pairs without their side."""
    full = {}
    for name, value in mix.items():
        sides = [name] if name in EXPRESSION_INDEX else [name + "Left", name + "Right"]
        full |= dict.fromkeys(sides, value)
    return weights(full)


def feeling(rng):
    """A whole-face expression [E] of random strength, a little uneven."""
    named = list(EXPRESSIVE) + list(FEELINGS)
    name = named[int(rng.integers(len(named)))]
    out = weights(EXPRESSIVE[name]) if name in EXPRESSIVE else both_sides(FEELINGS[name])
    return out * rng.uniform(0.4, 1.1)


def with_eyes(rng, expression):
    """The expression with what cheeks and brows do along with it, at times with a blink."""
    out = expression.copy()
    smile = out[[EXPRESSION_INDEX["mouthSmileLeft"], EXPRESSION_INDEX["mouthSmileRight"]]].mean()
    for name, share in (("cheekSquint", 0.8), ("eyeSquint", 0.5)):
        amount = smile * share * rng.uniform(0.2, 1.1)
        for side in ("Left", "Right"):
            k = EXPRESSION_INDEX[name + side]
            out[k] = max(out[k], amount)
    if rng.random() < 0.3:
        lift = rng.uniform(0.1, 1.0)
        brow = [("browInnerUp",), ("browInnerUp", "browOuterUp"), ("browDown",)][rng.integers(3)]
        out = np.maximum(out, both_sides({name: lift for name in brow}))
    if rng.random() < 0.12:
        shut = rng.uniform(0.3, 1.0) if rng.random() < 0.5 else 1.0
        out = np.maximum(out, both_sides({"eyeBlink": shut}))
    return out


def draw_expression(rng):
    """Expression [E] with its lids following the gaze, and gaze [2] degrees."""
    kind = rng.choice(list(KINDS), p=list(KINDS.values()))
    makers = {"smile": smiling, "feeling": feeling, "talk": talking, "range": ranging}
    out = np.zeros(len(EXPRESSIONS), np.float32)
    if kind != "rest":
        out = with_eyes(rng, makers[kind](rng).astype(np.float32))
        out = out * np.clip(1 + 0.1 * rng.normal(size=len(out)), 0.5, 1.3)
    out[EXPRESSION_INDEX["tongueOut"]] = 0
    jaw = EXPRESSION_INDEX["jawOpen"]  # few people open their mouths as far as the shape does
    out[jaw] = out[jaw] if out[jaw] < 0.5 else 0.5 + 0.5 * (out[jaw] - 0.5)
    gaze = np.zeros(2)
    if rng.random() < 0.6:
        gaze = np.clip(rng.normal(size=2) * [14, 9], [-32, -22], [32, 22])
    return _possible(look(np.clip(out, 0, 1), gaze)).astype(np.float32), gaze


def _possible(expression):
    """Antagonists do not act together (PITFALLS 3): the stronger one wins."""
    out = expression.copy()
    for one, other in (
        ("eyeWide", "eyeSquint"), ("eyeWide", "eyeBlink"), ("browDown", "browOuterUp"),
        ("mouthSmile", "mouthFrown"),
    ):  # fmt: skip
        for side in ("Left", "Right"):
            a, b = EXPRESSION_INDEX[one + side], EXPRESSION_INDEX[other + side]
            weaker = a if out[a] < out[b] else b
            out[weaker] *= 0.2
    if out[EXPRESSION_INDEX["jawOpen"]] < 0.3:
        return out
    k = EXPRESSION_INDEX["mouthClose"]
    out[k] = min(out[k], 0.1)
    return out


def draw_view(rng):
    """Yaw and pitch in degrees: half near the three views that are baked, half anywhere."""
    if rng.random() < 0.5:
        yaw = rng.choice([0.0, 0.0, 40.0, -40.0]) + rng.normal() * 4
        return float(np.clip(yaw, -45, 45)), float(np.clip(rng.normal() * 4, -25, 25))
    return float(rng.uniform(-45, 45)), float(np.clip(rng.normal() * 11, -25, 25))
