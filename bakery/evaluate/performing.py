"""A performer drives a portrait: what each way shows, beside the painted truth (Olszewski 2017, C6).

One painted person plays known curves in a clip; the portrait of another is baked. The clip is tracked
as any clip is, and played into the portrait. The truth is the other, painted with the same curves, in the
camera and light of that portrait. No person's own geometry is used, but for reading the truth's texture.
"""

import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np

from bakery.bake import pipeline
from bakery.detectors.base import Detector
from bakery.evaluate.metrics import face_crop, hull_mask, mse, psnr, ssim, warp_pixels
from bakery.evaluate.tracking import CLIP, RATE, Performance, painted, random_performance
from bakery.evaluate.transferring import Scores, against, mean_of
from bakery.export.open import open_avatar
from bakery.formats import video
from bakery.formats.image import write_image
from bakery.formats.mark import PAINTED
from bakery.formats.video import Clip
from bakery.generators.identity import features_of, load_features
from bakery.generators.transfer import load
from bakery.geometry.color import to_linear
from bakery.heads.base import PARTS, HeadModel
from bakery.landmarks import FACE, LIPS_OUTER
from bakery.motion.animate import AnimationPlayer, RenderSettings
from bakery.perform.network import NetworkPlayer
from bakery.perform.performance import Performance as Performed
from bakery.perform.performance import fitted
from bakery.perform.transfer import TransferPlayer
from bakery.plugins import plug_in
from bakery.runtime.avatar import Avatar
from bakery.stages.texture.expression import expression_atlas, mouth_texels, read_texture
from bakery.types import EXPRESSIONS

PORTRAIT = replace(CLIP, size=640)  # pixels a side, of portrait and truth
STEP = 6  # frames of the clip from one that is compared to the next
MOUTH = 1.25  # of the outer lips: what counts as mouth around them
GRID = 256  # pixels of the crops that identity is told from
WARM = 4  # frames that are drawn before the clock runs


@dataclass(frozen=True)
class Shown:
    """One way to play the clip, against the truth."""

    mouth: float  # dB: PSNR of mouth and lips in the picture
    face: float  # dB: of the whole face
    likeness: float  # cosine to the portrait, mean of the frames
    performer: float  # cosine to the performer at rest
    rate: float  # frames a second at 512x512, tracking not counted


@dataclass(frozen=True, eq=False)
class Scene:
    """One painted performer, and another painted with the same curves."""

    clip: Path
    bundle: Path
    frames: np.ndarray  # [n] of the clip that are compared
    truth: list  # of synth.render.Picture, [n]
    rest: np.ndarray  # [H, W, 3] uint8: the performer's first frame
    points: np.ndarray  # [L, 2] pixels, of that


def paint_scene(head: HeadModel, performer: int, target: int, count: int, folder: Path) -> Scene:
    """Paint both people, write the clip and bake the portrait, in a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    played = random_performance(np.random.default_rng([performer, 1]), count)
    acted = list(painted(head, performer, played))
    clip = folder / "clip.mp4"
    part = folder / "part"
    part.write_bytes(video.encode((_bytes(p.encoded) for p in acted), ".mp4", RATE))
    size = CLIP.size, CLIP.size
    video.join(clip, [part], ".mp4", RATE, size, video.Note("painted", "painted"))
    part.unlink()
    chosen = np.arange(STEP, count, STEP)
    rest = np.zeros((1, len(EXPRESSIONS)), np.float32)
    weights = np.concatenate([rest, played.weights[chosen]])
    gaze = np.concatenate([np.zeros((1, 2)), played.gaze[chosen]])
    still = Performance(weights, gaze, np.zeros((len(weights), 3)))
    portrait, *truth = painted(head, target, still, PORTRAIT)
    photo = folder / "portrait.png"
    write_image(photo, portrait.encoded, mark=PAINTED)
    bundle = folder / "portrait.avatar"
    pipeline.build(pipeline.Request(photo, bundle, head=head.name, keep_photo=True, overwrite=True))
    return Scene(clip, bundle, chosen, truth, _bytes(acted[0].encoded), acted[0].landmarks)


def measure(
    head: HeadModel, detector: Detector, scene: Scene, pictures: Path | None = None
) -> tuple[dict[str, Shown], dict[str, Scores]]:
    """Play the clip of a scene in each way, and compare.

    Args:
        pictures: file for a sheet: performer, avatar, transfer, network, truth; a row a frame.

    Returns:
        Shown of avatar, transfer and network (paGAN's); Scores of the texture of transfer as it is drawn, of the
        transfer `network` alone, of `delta`, which adds the performer's difference to the target's
        rest, of `avatar`, its baked textures, and of `neutral`, where nothing changes.
    """
    performed = fitted(Clip(scene.clip), head, detector, scene.clip.parent / "fits", overwrite=True)
    avatar = open_avatar(scene.bundle)
    over = RenderSettings(view="photo", size=PORTRAIT.size, rate=RATE)
    ways = _players(avatar, performed, over, head, scene.clip)
    drawn = {name: list(player.pictures(scene.frames)) for name, player in ways.items()}
    rates = _rates(avatar, performed, head, scene.clip)
    network = load_features()
    own = _cut(_bytes(avatar.photo), avatar.fit.landmarks_projected)
    portrait, performer = features_of(network, np.array([own, _cut(scene.rest, scene.points)]))
    shown = {}
    for name, made in drawn.items():
        rows = [_compare(p / 255, t) for p, t in zip(made, scene.truth)]
        cuts = np.array([_cut(p, t.landmarks) for p, t in zip(made, scene.truth)])
        features = features_of(network, cuts)
        shown[name] = Shown(
            *np.mean(rows, 0), float((features @ portrait).mean()),
            float((features @ performer).mean()), rates[name],
        )  # fmt: skip
    textures = _textures(ways["transfer"], scene, head)
    if pictures:
        _sheet(pictures, scene, drawn, ways["transfer"])
    return shown, textures


def _players(avatar: Avatar, performed: Performed, settings, head, clip):
    take = performed.take
    return {
        "avatar": AnimationPlayer(avatar, take, settings),
        "transfer": TransferPlayer(avatar, take, settings, performed, head, lambda: Clip(clip), load()),
        "network": NetworkPlayer(
            avatar, take, settings, head, plug_in("generators", "pagan"), str(clip)
        ),
    }  # fmt: skip


def _rates(avatar, performed, head, clip):
    """Frames a second of each way at 512x512, in a view of its own."""
    settings, out = RenderSettings(framing="face", size=512, rate=RATE), {}
    for name, player in _players(avatar, performed, settings, head, clip).items():
        list(player.pictures(range(WARM)))
        count = min(player.count, {"avatar": 120, "transfer": 48}.get(name, 12))
        start = time.perf_counter()
        list(player.pictures(range(count)))
        out[name] = count / (time.perf_counter() - start)
    return out


def _compare(made, truth):
    """PSNR of the mouth and of the face."""
    shape = made.shape[:2]
    lips = truth.landmarks[LIPS_OUTER]
    middle = lips.mean(0)
    mouth = hull_mask(middle + MOUTH * (lips - middle), *shape)
    return psnr(made, truth.encoded, mouth), psnr(
        made, truth.encoded, hull_mask(truth.landmarks[:FACE], *shape)
    )


def _cut(picture, points):
    """The face [GRID, GRID, 3] uint8 of a picture, black outside."""
    mask = hull_mask(points[:FACE], *picture.shape[:2])[..., None]
    return _bytes(warp_pixels((picture / 255.0) * mask, face_crop(points[:FACE], GRID), GRID))


def _textures(player: TransferPlayer, scene: Scene, head: HeadModel) -> dict[str, Scores]:
    """Scores of each way, means of the frames."""
    atlas = expression_atlas(head)
    skin = atlas.paint((atlas.part == PARTS.index("skin")).astype(np.uint8))
    mouth, rows = mouth_texels(head), []
    target = player.target.rest
    for frame, truth in zip(scene.frames, scene.truth):
        linear = to_linear(truth.encoded).astype(np.float32)
        right, seen = read_texture(linear, truth.camera, head, truth.vertices, truth.light)
        number = int(player.shows[frame])
        picture, performer = player.frames.picture(number), player.role_of(number).performer
        source, _, made = player.carried(performer, number, picture)
        pose = player.weights[frame], player.gaze[frame]
        ways = {
            "transfer": player.target.texture(*pose, player.painted(frame, picture)),
            "network": made,
            "delta": np.clip(target + source - performer.rest, 0, 1),
            "avatar": player.target.texture(*pose),
            "neutral": target,
        }
        inside = (skin > 0) & (seen > 0.5)
        lips = mouth & (seen > 0.5)
        rows.append({
            name: Scores(
                float(np.abs(one - right)[inside | lips].mean()), mse(one, right, inside | lips),
                ssim(one, right, inside), psnr(one, right, lips),
            )
            for name, one in ways.items()
        })  # fmt: skip
    return {name: mean_of([row[name] for row in rows]) for name in rows[0]}


def _sheet(path, scene, drawn, player):
    lines = []
    for row, frame in enumerate(scene.frames):
        source = player.frames.picture(int(player.shows[frame]))
        side = PORTRAIT.size
        first = cv2.resize(source, (side, side), interpolation=cv2.INTER_AREA)
        made = [drawn[name][row] for name in ("avatar", "transfer", "network")]
        lines.append(np.hstack([first, *made, _bytes(scene.truth[row].encoded)]))
    write_image(path, np.vstack(lines) / np.float32(255), mark=PAINTED)


def _bytes(picture):
    return (np.clip(picture, 0, 1) * 255 + 0.5).astype(np.uint8)


def run(
    head: HeadModel, detector: Detector, seed: int, people: int, count: int, folder: Path,
    pictures: Path | None = None,
) -> Iterator[tuple[str, dict[str, Shown], dict[str, Scores]]]:  # fmt: skip
    """Each of `people` painted people drives the next; yields (name, Shown, Scores) of each pair."""
    for number in range(people):
        performer, target = seed + number, seed + (number + 1) % people
        name = f"{performer} drives {target}"
        scene = paint_scene(head, performer, target, count, folder / f"{performer}-{target}")
        sheet = pictures and pictures / f"{performer}-drives-{target}.png"
        yield name, *measure(head, detector, scene, sheet)


def summary(results: list[tuple[dict[str, Shown], dict[str, Scores]]]) -> dict[str, object]:
    """Means of each way; `against_delta` as the paper's table has it, `mouth_over_avatar` in dB."""
    shown = {way: mean_of([row[0][way] for row in results]) for way in results[0][0]}
    textures = {way: mean_of([row[1][way] for row in results]) for way in results[0][1]}
    return {
        "pairs": len(results),
        "shown": {name: vars(one) for name, one in shown.items()},
        "textures": {name: vars(one) for name, one in textures.items()},
        "against_delta": against(textures["transfer"], textures["delta"]),
        "mouth_over_avatar": shown["transfer"].mouth - shown["avatar"].mouth,
    }
