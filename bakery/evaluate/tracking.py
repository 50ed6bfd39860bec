"""How well a clip is tracked: painted people who play known curves.

The people are painted by `bakery.synth`; what they do is drawn at random from what faces do: visemes
and whole expressions that ease into each other, blinks, glances, a head that turns.
"""

import time
from dataclasses import dataclass, replace

import numpy as np

from bakery.heads.base import look, weights
from bakery.motion.follow import follow
from bakery.motion.track import track
from bakery.stages.texture.mouth import smiling, talking
from bakery.synth.render import dress, paint
from bakery.synth.scene import EXPRESSIVE, portrait_camera, random_scene
from bakery.synth.subject import random_subject
from bakery.synth.training import TrainingOptions
from bakery.types import EXPRESSION_INDEX, EXPRESSIONS

RATE = 30.0  # frames a second
REST = 8  # frames at the start in which nothing is done: people begin clips like this
STILL = 0.02  # weight below which nothing is seen to move
GRAIN = 2.0  # levels of 255, standard deviation of fresh noise on the frames of a still face
CLIP = TrainingOptions(size=384, spread=0.8, quality=0.3)


@dataclass(frozen=True, eq=False)
class Performance:
    """What a painted person does, frame by frame."""

    weights: np.ndarray  # [N, E] 0..1
    gaze: np.ndarray  # [N, 2] degrees
    head: np.ndarray  # [N, 3] degrees: yaw to its left, pitch up, roll to its left shoulder


def _ease(rng, draw, count, low, high):
    """Random targets of `draw`, each held and then eased into the next: [N, ...]."""
    now, out = draw(), []
    while len(out) < count:
        target = draw()
        for share in np.linspace(0, 1, int(rng.integers(low, high)) + 1)[1:]:
            s = share * share * (3 - 2 * share)
            out.append(now + (target - now) * s)
        out += [target] * int(rng.integers(0, low))
        now = target
    return np.array(out[:count])


def _pose(rng):
    """A random pose [E]: talking, smiling, a whole expression, or rest."""
    kind = rng.random()
    if kind < 0.4:
        return talking(rng)
    if kind < 0.55:
        return smiling(rng)
    if kind < 0.85:
        names = [name for name in EXPRESSIVE if "blink" not in name]
        return weights(EXPRESSIVE[str(rng.choice(names))]) * rng.uniform(0.4, 1.0)
    return np.zeros(len(EXPRESSIONS), np.float32)


def random_performance(rng, count):
    """A Performance of `count` frames."""
    face = np.concatenate(
        [np.zeros((REST, len(EXPRESSIONS))), _ease(rng, lambda: _pose(rng), count, 6, 14)]
    )[:count]
    brows = _ease(rng, lambda: rng.uniform(0, 0.8) * (rng.random() < 0.4), count, 8, 16)
    for name in ("browInnerUp", "browOuterUpLeft", "browOuterUpRight"):
        face[REST:, EXPRESSION_INDEX[name]] += brows[: count - REST] * (1 - face[REST:, 0])
    at = int(rng.integers(REST, REST + 30))
    while at < count:
        for step, closed in enumerate((0.4, 0.9, 1.0, 0.8, 0.4)):
            for side in ("Left", "Right"):
                if at + step < count:
                    place = at + step, EXPRESSION_INDEX["eyeBlink" + side]
                    face[place] = max(face[place], closed)
        at += int(rng.integers(30, 90))
    gaze = _ease(rng, lambda: np.clip(rng.normal(size=2) * [9, 5], -22, 22), count, 3, 12)
    head = _ease(rng, lambda: np.clip(rng.normal(size=3) * [9, 5, 4], -25, 25), count, 15, 30)
    face = np.array([look(np.clip(row, 0, 1), where) for row, where in zip(face, gaze)])
    return Performance(face.astype(np.float32), gaze, head)


def still_frames(played):
    """Frames [N] bool of a Performance in which the face rests, whatever the gaze does."""
    moving = [n for n, name in enumerate(EXPRESSIONS) if not name.startswith("eyeLook")]
    return played.weights[:, moving].max(1) < STILL


def paint_clip(head, seed, performance, options=CLIP):
    """Yield the frames of one random person, camera and light: [H, W, 3] uint8 sRGB."""
    for picture in painted(head, seed, performance, options):
        yield (picture.encoded * 255 + 0.5).astype(np.uint8)


def painted(head, seed, performance, options=CLIP):
    """Yield the frames of one random person, camera and light: synth.render.Picture."""
    rng = np.random.default_rng(seed)
    subject = random_subject(rng, head, options.spread)
    scene = random_scene(rng, options.size, options.size, 0.0)
    wardrobe = dress(head, subject, options.detail, options.share)
    filling, distance = float(rng.uniform(0.5, 0.68)), float(rng.uniform(600, 1500))
    for index, (face, gaze, turn) in enumerate(
        zip(performance.weights, performance.gaze, performance.head)
    ):
        yaw, pitch, roll = map(float, turn)
        camera = portrait_camera(  # its roll is to the picture's left: the right shoulder
            options.size, options.size, yaw, pitch, -roll, filling=filling, distance=distance
        )
        one = replace(scene, camera=camera, expression=face, gaze=gaze, grain=1.0, quality=None)
        one = replace(one, blur=0.5, seed=scene.seed + index)
        yield paint(wardrobe, one, options.supersample, options.quality)


def still_clip(picture, count, seed=0):
    """Yield one picture `count` times, each with fresh grain, at RATE."""
    rng = np.random.default_rng(seed)
    for index in range(count):
        noisy = picture + rng.normal(0, GRAIN, picture.shape)
        yield index / RATE, np.clip(noisy + 0.5, 0, 255).astype(np.uint8)


@dataclass(frozen=True)
class ClipResult:
    """One painted clip against what was played."""

    seed: int
    frames: int
    found: float  # share of frames in which the face was found
    error: float  # mean absolute error of the 52 weights
    resting: float  # the same in the frames in which only the gaze moves; NaN if there are none
    baseline: float  # the same if every frame were called a resting face
    correlation: float  # of all weights with what was played
    blink: float  # mean absolute error of the two eyeBlink weights
    jaw: float  # and of jawOpen
    gaze: float  # degrees, mean distance
    head: float  # degrees, mean absolute error of yaw, pitch and roll without their own mean
    jitter: float  # standard deviation over time of a still face's weights, mean of the 52
    frames_per_second: float  # of following and fitting
    worst: dict  # the five expressions with the largest error


def measure(head, detector, seed, count, still=24, pictures=None):
    """Paint a clip of a random person, track it, compare.

    Args:
        head: head model, of the painter and of the fit.
        detector: detectors.base.Detector.
        count: frames.
        still: frames of the still face.
        pictures: frames that were painted before with this seed and count, or None.

    Returns:
        ClipResult.
    """
    played = random_performance(np.random.default_rng([seed, 1]), count)
    if pictures is None:
        pictures = list(paint_clip(head, seed, played))
    detector.detect(pictures[0])  # the first use loads and compiles
    track(follow([(0.0, pictures[0])], detector), head)
    start = time.perf_counter()
    followed = follow(((n / RATE, p) for n, p in enumerate(pictures)), detector)
    take = track(followed, head)
    seconds = time.perf_counter() - start
    error = np.abs(take.weights - played.weights)
    same = track(follow(still_clip(pictures[0], still, seed), detector), head)
    turn, resting = take.head - played.head, still_frames(played)
    order = np.argsort(-error.mean(0))[:5]

    def of(*names):
        return float(error[:, [EXPRESSION_INDEX[name] for name in names]].mean())

    return ClipResult(
        seed=seed,
        frames=count,
        found=float(followed.found.mean()),
        error=float(error.mean()),
        resting=float(error[resting].mean()) if resting.any() else float("nan"),
        baseline=float(played.weights.mean()),
        correlation=float(np.corrcoef(take.weights.ravel(), played.weights.ravel())[0, 1]),
        blink=of("eyeBlinkLeft", "eyeBlinkRight"),
        jaw=of("jawOpen"),
        gaze=float(np.linalg.norm(take.eyes[:, 0] - played.gaze, axis=1).mean()),
        head=float(np.abs(turn - turn.mean(0)).mean()),
        jitter=float(same.weights.std(0).mean()),
        frames_per_second=count / seconds,
        worst={EXPRESSIONS[n]: round(float(error[:, n].mean()), 3) for n in order},
    )


def summary(results):
    """Means of several ClipResults, and the worst jitter."""
    names = [
        "error", "resting", "baseline", "correlation", "blink", "jaw", "gaze", "head",
        "frames_per_second",
    ]  # fmt: skip
    rows = {name: [getattr(result, name) for result in results] for name in names}
    table = {name: float(np.nanmean(row)) for name, row in rows.items()}
    return {"clips": len(results)} | table | {"jitter": max(result.jitter for result in results)}
