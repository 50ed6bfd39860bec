"""Painted and photographed people for the close-up networks: crops of eyes and mouth with points.

Photographs show people at rest or smiling. Painted people do everything faces do, and where their
points are is known; there are as many dark skins as light ones. Two painters take turns: the quick one,
whose skins mix photographed ones, and the careful one, who grows brows, beards and hair.
"""

from dataclasses import replace

import cv2
import numpy as np

from bakery import landmarks as marks
from bakery.detectors import closeups, frames
from bakery.geometry import camera as cameras
from bakery.geometry import rotation
from bakery.geometry.color import LUMA
from bakery.heads.base import PARTS, look
from bakery.stages.condition import face_camera
from bakery.stages.texture.mouth import smiling, talking
from bakery.synth import film, quick
from bakery.synth.expressions import draw_view, feeling
from bakery.synth.pairs.painter import PairOptions, draw_figure
from bakery.synth.render import dress, paint
from bakery.synth.scene import portrait_camera, random_scene
from bakery.synth.subject import random_subject
from bakery.synth.training import TrainingOptions
from bakery.train import augment
from bakery.train.faces import mirror_order
from bakery.types import EXPRESSION_INDEX, EXPRESSIONS, Fit

WIDE = 96  # pixels of a kept crop
INSIDE = 0.95  # of a crop in which points of the mean head are looked for
MARGIN = 1.35  # its side over that of the crop the network sees
SIZE = (128, 288)  # pixels of a painted frame's side, least and most
CAREFUL = TrainingOptions(size=224)
ARRAYS = ("eyes", "eye_points", "mouths", "mouth_points")
PAIRED = [name for name in EXPRESSIONS if name.endswith("Left") and not name.startswith("eyeLook")]
# What shut lips do: what parts them by a millimetre or hides their red is hardest to see.
SHUT = (
    "mouthPressLeft", "mouthRollLower", "mouthRollUpper", "mouthShrugLower", "mouthShrugUpper",
    "mouthPucker", "mouthFrownLeft", "mouthStretchLeft", "mouthDimpleLeft", "mouthSmileLeft",
)  # fmt: skip


def random_face(rng):
    """Expression [E] and gaze [2] degrees: whole expressions, single shapes, lids, brows, shut lips."""
    kind = rng.random()
    pose = np.zeros(len(EXPRESSIONS), np.float32)
    if kind < 0.25:
        pose = talking(rng)
    elif kind < 0.4:
        pose = smiling(rng)
    elif kind < 0.7:
        pose = feeling(rng)
    pose = np.array(pose, np.float32)

    def add(name, amount, both=0.8):
        pose[EXPRESSION_INDEX[name]] += amount
        if name.endswith("Left") and rng.random() < both:
            twin = name[:-4] + "Right"
            pose[EXPRESSION_INDEX[twin]] += amount * rng.uniform(0.8, 1)

    if 0.7 <= kind < 0.9:
        for name in SHUT:
            if rng.random() < 0.25:
                add(name, rng.uniform(0, 0.9))
        opened = rng.choice([0.0, rng.uniform(0, 0.08), rng.uniform(0, 0.4)])
        add("jawOpen", opened)
        add("mouthClose", opened * (rng.random() < 0.6))
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


def random_view(rng):
    """Yaw, pitch and roll in degrees: mostly towards the camera, all of +-40 at times."""
    yaw, pitch = rng.normal(size=2) * [16, 9] if rng.random() < 0.6 else draw_view(rng)
    return tuple(np.clip([yaw, pitch, rng.normal() * 10], -42, 42).tolist())


def quick_frames(rng, stage, skins, count):
    """Yield pictures of one invented person by the quick painter, with where its points are.

    Args:
        rng: numpy Generator.
        stage: quick.Stage.
        skins: lists of skins, one a tone (`synth.skins.by_tone`), or an empty list.
        count: pictures.

    Yields:
        [S, S, 3] uint8 sRGB, [478, 2] pixels.
    """
    paths = skins[int(rng.integers(len(skins)))] if skins else []
    figure, lens, balance = draw_figure(rng, stage, paths, PairOptions(painted=0.25))
    fit = Fit(
        stage.head.name, lens, figure.traits.identity, np.zeros(len(EXPRESSIONS), np.float32),
        np.zeros(2), np.zeros((9, 3)), np.zeros(0), np.zeros((468, 3)), None,
    )  # fmt: skip
    for _ in range(count):
        size = int(rng.integers(*SIZE)) // 2 * 2
        expression, gaze = random_face(rng)
        yaw, pitch, roll = random_view(rng)
        share = float(rng.uniform(0.5, 0.85))
        camera = face_camera(fit, figure.head, figure.neutral, yaw, pitch, size, share)
        turn = rotation.matrix([0, 0, np.radians(roll)])
        camera = replace(
            camera,
            rotation=rotation.vector(turn @ rotation.matrix(camera.rotation)),
            translation=turn @ camera.translation,
        )
        linear, kind = quick.paint(figure, expression, gaze, camera)
        skin = np.median(linear[kind == PARTS.index("skin")] @ LUMA)
        # Well lit, or too dark: what cameras make of dark skin in dim light.
        bright = np.exp(rng.uniform(np.log(0.03), np.log(0.45)))
        base = np.exp(rng.normal(size=3) * 0.3) * np.exp(rng.uniform(np.log(0.02), np.log(0.9)))
        behind = film.background(rng, str(rng.choice(["studio", "room"])), size, size, base)
        linear = np.where(
            kind[..., None] >= 0, linear * (bright / max(skin, 1e-4) * balance), behind
        )
        encoded = film.develop(
            linear, rng, rng.uniform(0.5, 4), rng.uniform(0.3, 1.0), rng.integers(40, 97)
        )
        posed = figure.head.vertices(figure.neutral, expression, gaze)
        points = cameras.project(figure.head.landmarks(posed), camera)
        yield np.round(encoded * 255).astype(np.uint8), points


def careful_frames(rng, head, count, options=CAREFUL):
    """Yield pictures of one invented person by the careful painter; see `quick_frames`."""
    subject = random_subject(rng, head, options.spread)
    scene = random_scene(rng, options.size, options.size)
    wardrobe = dress(head, subject, options.detail, options.share)
    distance = float(rng.uniform(500, 2400))
    for index in range(count):
        expression, gaze = random_face(rng)
        camera = portrait_camera(
            options.size, options.size, *random_view(rng),
            filling=float(rng.uniform(0.55, 0.95)), distance=distance,
        )  # fmt: skip
        one = replace(
            scene, camera=camera, expression=expression, gaze=gaze, seed=scene.seed + index,
            quality=int(rng.integers(40, 97)),
        )  # fmt: skip
        picture = paint(wardrobe, one, options.supersample, options.quality)
        yield np.round(picture.encoded * 255).astype(np.uint8), picture.landmarks


def believed(rng, points):
    """What the points network makes of points [478, 2]: features off as a whole, lips too shut."""
    unit = marks.face_size(points)
    found = points + rng.normal(0, 0.004, points.shape) * unit
    for rows in (marks.LIPS, marks.EYE_LEFT, marks.EYE_RIGHT):
        found[rows] += np.clip(rng.standard_t(4, 2) * 0.018, -0.1, 0.1) * unit
    closing = rng.uniform(0.2, 1.0)  # lips part by a third only
    middle = (found[marks.LIPS_INNER_UPPER] + found[marks.LIPS_INNER_LOWER]).mean(0) / 2
    found[marks.LIPS] = middle + (found[marks.LIPS] - middle) * [1, closing]
    return found


def crops_of(rng, picture, points):
    """The wide crops of a frame as a camera may show it, and where their points are.

    Args:
        picture: [H, W, 3] uint8 sRGB.
        points: [478, 2] pixels.

    Returns:
        eyes [2, W, W] uint8 (left, right in the mirror) with points [2, 478, 2], mouth [W, W] with
        points [478, 2]; in the unit of the network's own crop, from its middle. An eye's iris has
        its middle in all five points.
    """
    coarse = believed(rng, points)
    picture = np.ascontiguousarray(picture[..., ::-1])
    size = frames.frame_of_points(points).size
    if rng.random() < 0.1:
        picture = augment.glasses(rng, picture, points, size)
    if rng.random() < 0.1:
        picture = augment.occlude(rng, picture, points, 0.5 * size)
    picture = augment.photograph(rng, picture, rng.uniform(0.2, 0.8))[..., ::-1]
    seen = points.copy()
    for iris in (marks.LEFT_IRIS, marks.RIGHT_IRIS):
        seen[iris] = points[iris].mean(0)
    eyes, targets = [], []
    for frame, mirrored in zip(closeups.eye_frames(coarse), (False, True)):
        crop, place = _crop(picture, frame, mirrored)
        eyes.append(crop)
        targets.append(place(seen))
    crop, place = _crop(picture, closeups.mouth_frame(coarse), False)
    return np.stack(eyes), np.stack(targets), crop, place(seen)


def _crop(picture, frame, mirrored):
    wide = replace(frame, size=frame.size * MARGIN)
    matrix = closeups.matrix_of(wide, mirrored, WIDE)
    crop = closeups.take(picture, matrix, WIDE)
    return crop, lambda points: (frames.apply_affine(matrix, points) / WIDE - 0.5) * MARGIN


def rows_seen(head):
    """The points that lie in the crops of the mean head: eyes [2, n] (left, right), mouth [1, m].

    The right eye's are the counterparts of the left's.
    """
    points = head.landmarks(head.mean)
    order = mirror_order(points[None])
    flat = points[:, :2] * [1, -1]

    def within(frame):
        return np.abs(flat - frame.center).max(1) < 0.5 * INSIDE * frame.size

    skin = np.arange(len(flat)) < marks.FACE
    mouth = within(closeups.mouth_frame(flat)) & skin
    left = np.append(
        np.flatnonzero(within(closeups.eye_frames(flat)[0]) & skin), marks.LEFT_IRIS.start
    )
    right = np.append(order[left[:-1]], marks.RIGHT_IRIS.start)
    return np.stack([left, right]), np.flatnonzero(mouth & mouth[order])[None]


def mirrored_rows(head, rows):
    """Which of the points in `rows` [n] takes whose place in the mirror [n]."""
    order = mirror_order(head.landmarks(head.mean)[None])
    place = {int(row): number for number, row in enumerate(rows)}
    return np.array([place[int(order[row])] for row in rows])


def table_of(rng, pictures, copies):
    """The crops of a person's pictures: dict of `ARRAYS`, an eye crop for each eye.

    Args:
        pictures: iterable of picture and points, as `crops_of` takes them.
        copies: how often each is looked at, through another camera each time.
    """
    found = {name: [] for name in ARRAYS}
    for picture, points in pictures:
        for _ in range(copies):
            for name, value in zip(ARRAYS, crops_of(rng, picture, points)):
                found[name].append(value)
    table = {name: np.array(values) for name, values in found.items()}
    table["eyes"] = table["eyes"].reshape(-1, *table["eyes"].shape[2:])
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
