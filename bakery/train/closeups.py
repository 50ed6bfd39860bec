"""Training of the close-up networks on avatars that are played: true points of any expression.

A photo shows a person at rest or smiling; the avatar baked from it blinks, squints, talks and
laughs, and says where every point is. Frames are drawn by the fast player, from random sides, over
random backgrounds, in other shapes of the head; crops are kept, and cut a little off at each step.
"""

import logging
import os
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np
import torch
from safetensors.torch import save_file

from bakery import landmarks as marks
from bakery.detectors import closeups, frames
from bakery.detectors.blocks import CloseupNet, fold
from bakery.errors import ModelError
from bakery.geometry import camera as cameras
from bakery.geometry import rotation
from bakery.heads.base import look, weights
from bakery.runtime.player import Player
from bakery.stages.condition import face_camera
from bakery.stages.texture_mouth import smiling, talking
from bakery.synth.scene import EXPRESSIVE
from bakery.train import augment, runs
from bakery.types import EXPRESSION_INDEX, EXPRESSIONS

log = logging.getLogger(__name__)
WIDE = 96  # pixels of a kept crop
MODES = 40  # identity modes that faces are varied by
MARGIN = 1.35  # its side over that of the crop the network sees
PAIRED = [name for name in EXPRESSIONS if name.endswith("Left") and not name.startswith("eyeLook")]
# The lips' rings begin at the right corner and reach the left one after ten steps.
MIRROR = np.concatenate([(10 - np.arange(20)) % 20, 20 + (10 - np.arange(20)) % 20])


@dataclass(frozen=True)
class CloseupOptions:
    frames: int = 150  # drawn of each avatar
    size: tuple = (150, 460)  # pixels of a frame's side, least and most
    spread: float = 0.6  # standard deviation of the identity modes added
    steps: int = 2000
    batch: int = 64
    rate: float = 2e-3
    average: float = 0.995  # of the weights that ship
    log_every: int = 100
    seed: int = 0


def random_face(rng):
    """Expression [E] and gaze [2] degrees: whole expressions, single shapes, lids and brows."""
    kind = rng.random()
    pose = np.zeros(len(EXPRESSIONS), np.float32)
    if kind < 0.3:
        pose = talking(rng)
    elif kind < 0.5:
        pose = smiling(rng)
    elif kind < 0.75:
        pose = weights(EXPRESSIVE[str(rng.choice(list(EXPRESSIVE)))]) * rng.uniform(0.3, 1)
    pose = np.array(pose, np.float32)

    def add(name, amount, both=0.8):
        pose[EXPRESSION_INDEX[name]] += amount
        if name.endswith("Left") and rng.random() < both:
            twin = name[:-4] + "Right"
            pose[EXPRESSION_INDEX[twin]] += amount * rng.uniform(0.8, 1)

    if rng.random() < 0.45:
        add("eyeBlinkLeft", rng.choice([rng.uniform(0, 1), rng.uniform(0.85, 1)]), 0.9)
    elif rng.random() < 0.25:
        add("eyeWideLeft", rng.uniform(0, 1))
    for name in ("eyeSquintLeft", "browDownLeft", "browOuterUpLeft", "browInnerUp", "jawOpen"):
        if rng.random() < 0.2:
            add(name, rng.uniform(0, 1))
    for name in rng.choice(PAIRED, 2, replace=False):
        if rng.random() < 0.4:
            add(str(name), rng.uniform(0, 0.8))
    gaze = np.clip(rng.normal(size=2) * [12, 8], -30, 30)
    return look(np.clip(pose, 0, 1), gaze), gaze


def draw_frames(avatar, modes, rng, count, options):
    """Yield pictures of an avatar with where its points are.

    Args:
        modes: [I, V, 3] mm: identity modes of its head model, [0, V, 3] for none.

    Yields:
        [S, S, 3] uint8 sRGB, [478, 2] pixels.
    """
    player = Player(avatar)
    rest, spaces = player.rest.copy(), {}
    for index in range(count):
        if index % 10 == 0:  # another face under the same skin
            mix = rng.normal(size=len(modes)).astype(np.float32) * options.spread
            neutral = avatar.neutral + np.tensordot(mix, modes, 1)
            player.rest = rest + (neutral - avatar.neutral)[player.used]
            player.centers = avatar.head.eye_centers(neutral)
        size = int(rng.integers(*options.size)) // 2 * 2
        expression, gaze = random_face(rng)
        yaw, pitch = np.clip(rng.normal(size=2) * [16, 9], -42, 42)
        share = float(rng.uniform(0.5, 0.85))
        camera = face_camera(avatar.fit, avatar.head, neutral, yaw, pitch, size, share)
        roll = rotation.matrix([0, 0, np.radians(np.clip(rng.normal() * 10, -30, 30))])
        camera = replace(
            camera,
            rotation=rotation.vector(roll @ rotation.matrix(camera.rotation)),
            translation=roll @ camera.translation,
        )
        if size not in spaces:
            spaces[size] = player.workspace(size, size)
        picture = player.picture(spaces[size], camera, expression, gaze)
        alpha = spaces[size].alpha[..., None]
        behind = rng.uniform(0, 255, 3) + rng.normal(0, 20, (4, 4, 3))
        behind = cv2.resize(np.clip(behind, 0, 255).astype(np.uint8), (size, size))
        picture = (picture * alpha + behind * (1 - alpha)).astype(np.uint8)
        vertices = avatar.head.vertices(neutral, expression, gaze)
        yield picture, cameras.project(avatar.head.landmarks(vertices), camera)


def crops_of(rng, picture, points):
    """The wide crops of a frame, and where their points are.

    Returns:
        eyes [2, W, W] uint8 with points [2, n, 2], mouth [W, W] with points [m, 2]; in the unit of
        the network's own crop, from its middle.
    """
    coarse = points + rng.normal(0, 0.004, points.shape) * marks.face_size(points)
    # What the points network makes of lips: they part by a third only.
    closing = rng.uniform(0.2, 1.0)
    lips = coarse[closeups.MOUTH]
    middle = (coarse[marks.LIPS_INNER_UPPER] + coarse[marks.LIPS_INNER_LOWER]).mean(0) / 2
    coarse[closeups.MOUTH] = middle + (lips - middle) * [1, closing]
    picture = augment.photograph(rng, picture[..., ::-1], 0.7)[..., ::-1]
    eyes, targets = [], []
    for frame, mirrored, (lids, iris, brow) in zip(
        closeups.eye_frames(coarse), (False, True), closeups.EYES
    ):
        crop, place = _crop(picture, frame, mirrored)
        seen = np.concatenate([points[lids], points[iris].mean(0)[None], points[brow]])
        eyes.append(crop)
        targets.append(place(seen))
    crop, place = _crop(picture, closeups.mouth_frame(coarse), False)
    return np.stack(eyes), np.stack(targets), crop, place(points[closeups.MOUTH])


def _crop(picture, frame, mirrored):
    wide = replace(frame, size=frame.size * MARGIN)
    matrix = closeups.matrix_of(wide, mirrored, WIDE)
    crop = closeups.take(picture, matrix, WIDE)
    return crop, lambda points: (frames.apply_affine(matrix, points) / WIDE - 0.5) * MARGIN


def collect(avatars, modes, options, progress=None):
    """Draw all avatars: a dict of arrays, eyes and mouths with their points.

    Args:
        avatars: list of callables that open one.
        modes: [I, V, 3].
        progress: called with (step, done, total).
    """
    found = {name: [] for name in ("eyes", "eye_points", "mouths", "mouth_points")}
    for number, opened in enumerate(avatars):
        if progress is not None:
            progress("draw", number, len(avatars))
        rng = np.random.default_rng([options.seed, number])
        for picture, points in draw_frames(opened(), modes, rng, options.frames, options):
            for name, value in zip(found, crops_of(rng, picture, points)):
                found[name].append(value)
    table = {name: np.array(values) for name, values in found.items()}
    table["eyes"] = table["eyes"].reshape(-1, WIDE, WIDE)
    table["eye_points"] = table["eye_points"].reshape(len(table["eyes"]), -1, 2)
    return {name: v if v.dtype == np.uint8 else v.astype(np.float32) for name, v in table.items()}


def jittered(rng, crops, points):
    """Cut crops [B, W, W] a little off: [B, S, S] uint8, and the points [B, n, 2] in them."""
    out = np.empty((len(crops), closeups.SIDE, closeups.SIDE), np.uint8)
    moved = np.empty_like(points)
    for n, (crop, place) in enumerate(zip(crops, points)):
        scale = np.exp(rng.normal(0, 0.06)) * MARGIN * closeups.SIDE / WIDE
        linear = frames.rotation(rng.normal(0, 0.07)) * scale
        shift = rng.normal(0, 0.035, 2) * closeups.SIDE
        offset = closeups.SIDE / 2 + shift - linear @ [WIDE / 2, WIDE / 2]
        out[n] = frames.take_crop(
            cv2.cvtColor(crop, cv2.COLOR_GRAY2RGB), np.column_stack([linear, offset]),
            closeups.SIDE,
        )[..., 0]  # fmt: skip
        pixels = (place / MARGIN + 0.5) * WIDE
        moved[n] = (pixels @ linear.T + offset) / closeups.SIDE - 0.5
    return out, moved


def train(crops, points, options, held=0.05, mirror=None):
    """Train one network.

    Args:
        crops: [N, W, W] uint8; points: [N, n, 2], see `crops_of`.
        held: share at the end that is measured and not learned from.
        mirror: [n] which point takes whose place in the mirror, or None.

    Yields:
        dict of figures; the last one has "tensors", what ships.

    Raises:
        ModelError: the loss is not finite.
    """
    torch.manual_seed(options.seed)
    rng = np.random.default_rng(options.seed)
    count = points.shape[1]
    network, averaged = CloseupNet(count), CloseupNet(count)
    network.mean_shape.copy_(torch.from_numpy(points.mean(0)))
    averaged.load_state_dict(network.state_dict())
    optimizer = torch.optim.AdamW(network.parameters(), weight_decay=1e-4)
    split = len(crops) - max(int(len(crops) * held), 1)
    test = [torch.from_numpy(part) for part in jittered(rng, crops[split:], points[split:])]
    for step in range(1, options.steps + 1):
        for group in optimizer.param_groups:
            fall = min(1.0, 2 * (options.steps - step + 1) / options.steps)
            group["lr"] = options.rate * min(1.0, step / 100) * fall
        chosen = rng.integers(split, size=options.batch)
        batch, target = jittered(rng, crops[chosen], points[chosen])
        if mirror is not None:
            flip = rng.random(len(batch)) < 0.5
            batch[flip] = batch[flip, :, ::-1]
            target[flip] = target[flip][:, mirror] * np.float32([-1, 1])
        network.train()
        distance = (network(torch.from_numpy(batch)) - torch.from_numpy(target)).norm(dim=-1)
        loss = distance.mean()
        if not torch.isfinite(loss):
            raise ModelError(f"the loss is not finite at step {step}; give a lower rate")
        optimizer.zero_grad(set_to_none=True)
        loss.backward()
        torch.nn.utils.clip_grad_norm_(network.parameters(), 5.0)
        optimizer.step()
        runs.average(averaged, network, min(options.average, step / (10 + step)))
        if step % options.log_every == 0 or step == options.steps:
            averaged.eval()
            with torch.inference_mode():
                held_out = (averaged(test[0]) - test[1]).norm(dim=-1).mean()
            yield {"step": step, "loss": loss.item(), "held_out": float(held_out)}
    yield {"tensors": fold(averaged.eval())}


def train_part(name, samples, people, options):
    """`train` on the "eyes" or the "mouths" of what `collect` drew; the last person is held out.

    Args:
        people: how many avatars were drawn.
    """
    points = samples[name[:-1] + "_points"]
    mirror = MIRROR if name == "mouths" else None
    return train(samples[name], points, options, 1 / people if people > 1 else 0.05, mirror)


def export(eye, mouth, path):
    """Write what `train` gave for eyes and mouth into one file, half precision."""
    tensors = {f"eye.{k}": v.half() for k, v in eye.items()}
    tensors |= {f"mouth.{k}": v.half() for k, v in mouth.items()}
    aside = Path(path).with_suffix(".tmp")
    save_file(tensors, aside)
    os.replace(aside, path)
