"""Painted portraits of which every pixel's class is known, for the segmentation network.

People of any skin and hair with glasses, hats, hands and things before their faces, in soft and in
hard light. Pictures come without background: straight colour and coverage, so that any background
can be laid behind while the network learns.
"""

from dataclasses import dataclass, replace

import cv2
import numpy as np

from bakery.detectors import portrait
from bakery.geometry import rotation
from bakery.geometry.camera import project
from bakery.geometry.color import to_encoded
from bakery.settings import Settings, setting
from bakery.synth import film, props, wear
from bakery.synth.render import dress, paint
from bakery.synth.scene import Scene, portrait_camera, random_expression, studio_light
from bakery.synth.subject import LONG_STYLES, random_subject

CANVAS = 384  # pixels painted, shrunk to portrait.SIDE
BEARDED = 0.12  # share of a beard's hairs around a pixel from which it is beard
HAIRY = 0.13  # share of scalp hair around a pixel from which the skin between counts as hair
HARD = 4.5  # degrees: shadows of a lamp of at most this radius count as hard
SHADOW = (0.22, 0.38)  # share of the light that is blocked: below none, above shadow, else unsure


@dataclass(frozen=True)
class PortraitOptions(Settings):
    """How people are painted."""

    scenes: int = setting(2, "pictures of each person", 1, 64)
    detail: float = setting(1.0, "pixels a mm of the skin's map", 0.5, 8)
    share: float = setting(0.1, "of the full number of hairs on the scalp", 0.01, 1)
    short: float = setting(0.25, "of the full number of brows, lashes and beard", 0.01, 1)
    quality: float = setting(0.3, "of the shadows", 0.1, 1)
    glasses: float = setting(0.35, "share of pictures with glasses", 0, 1)
    hats: float = setting(0.18, "share of pictures with a hat", 0, 1)
    hands: float = setting(0.25, "share of pictures with a hand", 0, 1)
    things: float = setting(0.12, "share of pictures with another thing", 0, 1)
    hard: float = setting(0.4, "share of pictures in hard light", 0, 1)


@dataclass(frozen=True)
class Labelled:
    """One picture with its truth; S is `portrait.SIDE`."""

    image: np.ndarray  # [S, S, 3] uint8 straight sRGB colour
    alpha: np.ndarray  # [S, S] uint8 share that is not background
    label: np.ndarray  # [S, S] uint8 into portrait.CLASSES
    shadow: np.ndarray  # [S, S] uint8: 0 none, 1 hard cast shadow, portrait.UNSURE between
    points: np.ndarray  # [478, 2] float32 pixels


def random_portraits(head, seed, options: PortraitOptions = PortraitOptions()):
    """Yield the `Labelled` pictures of one random person.

    Args:
        head: HeadModel.
        seed: integer or sequence of integers; the same seed gives the same pictures.
    """
    rng = np.random.default_rng(seed)
    subject = _traits(rng, random_subject(rng, head, 0.8))
    wardrobe = dress(head, subject, options.detail, options.share)
    wardrobe = replace(wardrobe, share=options.short)  # scalp hair is grown already
    for _ in range(options.scenes):
        scene = random_light_and_view(rng, options)
        yield _portrait(rng, wardrobe, scene, options)


def _traits(rng, subject):
    """More beards, and clothes of the skin's own colour at times."""
    changes = {}
    if subject.hair not in LONG_STYLES and rng.random() < 0.3:
        changes |= {"beard": float(rng.uniform(3, 14)), "stubble": 0.0}
    if rng.random() < 0.15:
        own = np.array([0.45, 0.27, 0.19]) * np.exp(-0.55 * subject.melanin)
        changes["cloth_color"] = np.clip(own * np.exp(rng.normal(size=3) * 0.15), 0.01, 0.75)
    elif rng.random() < 0.25:
        changes["cloth_color"] = wear.random_color(rng)
    return replace(subject, **changes)


def random_light_and_view(rng, options: PortraitOptions) -> Scene:
    """A scene framed as official portraits are; a share of them in hard light."""
    expression, gaze = random_expression(rng)
    camera = portrait_camera(
        CANVAS, CANVAS,
        yaw=float(np.clip(rng.normal() * 15, -42, 42)),
        pitch=float(np.clip(rng.normal() * 7, -20, 20)),
        roll=float(np.clip(rng.normal() * 6, -20, 20)),
        filling=float(rng.uniform(0.52, 0.68)),
        distance=float(rng.uniform(550, 2400)),
        middle=(0.5 + rng.normal() * 0.03, 0.5 + rng.normal() * 0.03),
    )  # fmt: skip
    hard = rng.random() < options.hard
    environment = studio_light(
        azimuth=float(rng.uniform(-75, 75)),
        elevation=float(rng.uniform(5, 65)),
        radius=float(rng.uniform(0.4, HARD) if hard else rng.uniform(10, 28)),
        key=float(rng.uniform(0.7, 1.4) if hard else rng.uniform(0.25, 1.1)),
        fill=float(rng.uniform(0, 0.2) if hard else rng.uniform(0, 0.5)),
        rim=float(rng.choice([0, 0, rng.uniform(0, 1.0)])),
        ambient=float(rng.uniform(0.05, 0.3) if hard else rng.uniform(0.15, 0.5)),
        warm=float(rng.normal()),
        seed=int(rng.integers(2**31)),
    )
    return Scene(
        camera, environment, expression, gaze, background_color=np.zeros(3),
        seed=int(rng.integers(2**31)), grain=0.0, blur=0.0, quality=None,
    )  # fmt: skip


def _portrait(rng, wardrobe, scene, options):
    head, subject, neutral = wardrobe.head, wardrobe.subject, wardrobe.neutral
    worn, rims = [], None
    if rng.random() < options.glasses:
        worn, rims = wear.random_glasses(head, neutral, rng)
    if rng.random() < options.hats:
        style = str(rng.choice(wear.HATS))
        hat, press = wear.random_hat(head, wardrobe.chart, neutral, rng, style)
        worn.append(hat)
        wardrobe = replace(wardrobe, hair=wear.pressed(wardrobe.hair, press))
    elif subject.hair in ("bob", "side_part") and rng.random() < 0.25:
        side = float(rng.choice([-1, 1]))
        strands = props.fringe(head, subject, neutral, wardrobe.hair, side, 1400)
        wide = strands.width * np.where(
            np.arange(len(strands.width)) < len(wardrobe.hair.width), 1, 3
        )
        wardrobe = replace(wardrobe, hair=replace(strands, width=wide))
    for _ in range(int(rng.random() < options.hands) + int(rng.random() < options.hands / 4)):
        worn.append(wear.random_hand(head, subject, neutral, rng))
    if rng.random() < options.things:
        worn.append(wear.random_object(head, neutral, rng))
    key = scene.environment.lamps[0]
    if key.radius <= HARD and rng.random() < 0.4:
        toward = key.direction @ rotation.matrix(scene.camera.rotation)
        middle = head.landmarks(neutral)[4].astype(float)
        worn += wear.random_bars(rng, toward, middle)
    picture = paint(replace(wardrobe, props=tuple(worn)), scene, 1, options.quality)
    masks = {n: _small(m) for n, m in (picture.masks | picture.parts).items()}
    linear = _small(picture.linear)
    lens = None
    if rims is not None and "prop lens" not in masks:
        lens = _lenses(head, neutral, rims, scene.camera, masks)
    alpha = np.clip(1 - masks["background"], 0, 1)
    linear = _straight(linear, alpha)
    exposure = np.exp(rng.normal() * 0.25) * 0.30 / max(_brightness(linear, masks), 0.02)
    if lens is not None:
        linear = _glass(rng, linear, lens, exposure)
    encoded = to_encoded(film.tone(linear * np.clip(exposure, 0.3, 4.0)))
    label = labels_of(masks, lens)
    hard = key.radius <= HARD
    shadow = _shadow(masks, label) if hard else np.zeros_like(label)
    points = picture.landmarks * (portrait.SIDE / CANVAS)
    return Labelled(
        np.round(np.clip(encoded, 0, 1) * 255).astype(np.uint8),
        np.round(alpha * 255).astype(np.uint8),
        label,
        shadow,
        points.astype(np.float32),
    )


def _small(picture):
    size = (portrait.SIDE, portrait.SIDE)
    return cv2.resize(picture, size, interpolation=cv2.INTER_AREA)


def _straight(linear, alpha):
    """Colour of the person alone, carried a little over the outline."""
    near = cv2.GaussianBlur(linear, (0, 0), 2.0)
    near = near / np.maximum(cv2.GaussianBlur(alpha, (0, 0), 2.0), 1e-2)[..., None]
    own = linear / np.maximum(alpha, 0.05)[..., None]
    sure = np.clip((alpha - 0.05) / 0.3, 0, 1)[..., None]
    return near + (own - near) * sure


def _brightness(linear, masks):
    skin = masks["skin"] > 0.8
    return float(np.median(linear[skin].mean(-1))) ** 0.7 if skin.sum() > 50 else 0.3


def _lenses(head, neutral, rims, camera, masks):
    """Where clear lenses are seen [S, S] 0..1: inside the rims, and nothing before them."""
    out = np.zeros((portrait.SIDE, portrait.SIDE), np.float32)
    for side in props.LENS:
        outline = project(props.rim(head, neutral, side, rims=rims), camera)
        outline = np.round((outline * portrait.SIDE / CANVAS - 0.5) * 16).astype(np.int32)
        cv2.fillPoly(out, [outline], 1.0, cv2.LINE_AA, 4)
    before = sum(masks.get(name, 0) for name in ("prop thing", "prop hat", "prop frame"))
    return out * np.clip(1 - before - masks["hair"] - masks["background"], 0, 1)


def _glass(rng, linear, lens, exposure):
    """Tint and reflections of clear lenses."""
    tint = np.ones(3)
    if rng.random() < 0.4:
        tint = np.exp(-rng.uniform(0, 1.6) * rng.uniform(0.3, 1.0, 3))
    out = linear * (1 + (tint - 1) * lens[..., None])
    edge = np.clip(lens - cv2.GaussianBlur(lens, (0, 0), 0.8), 0, 1)[..., None]
    out = out * (1 + edge * rng.uniform(-1.2, 1.2))  # glass is seen from the side there
    if rng.random() < 0.6:
        size = linear.shape[0]
        pane = np.zeros(linear.shape[:2], np.float32)
        for _ in range(int(rng.integers(1, 4))):
            middle = rng.uniform(0.3, 0.7, 2) * size
            corners = middle + rng.normal(size=(4, 2)) * rng.uniform(4, 20)
            hull = cv2.convexHull(corners.astype(np.float32))[:, 0]
            cv2.fillPoly(pane, [np.round(hull * 16).astype(np.int32)], 1.0, cv2.LINE_AA, 4)
        pane = cv2.GaussianBlur(pane, (0, 0), rng.uniform(0.5, 2.5)) * lens
        light = rng.uniform(0.2, 1.0) * np.exp(rng.normal(size=3) * 0.1) / exposure
        out = out + (light - out) * (rng.uniform(0.2, 0.9) * pane)[..., None]
    veil = rng.choice([0, rng.uniform(0, 0.25)]) * lens[..., None]
    return out + (0.4 / exposure - out) * veil


def labels_of(masks: dict, lens=None) -> np.ndarray:
    """The class [S, S] uint8 that has the largest share of each pixel.

    Args:
        masks: {name: [S, S] share}, those of `render.Picture.masks` and `.parts`.
        lens: [S, S] share of clear lenses, or None.
    """
    near = {n: cv2.GaussianBlur(masks[n], (0, 0), 2.2) for n in ("beard", "hair")}
    shares = np.zeros((len(portrait.CLASSES), *masks["skin"].shape), np.float32)
    nothing = np.zeros_like(masks["skin"])
    shares[portrait.BACKGROUND] = masks["background"]
    shares[portrait.SKIN] = masks["skin"]
    shares[portrait.EYES], shares[portrait.MOUTH] = masks["eyes"], masks["mouth"]
    shares[portrait.HAIR], shares[portrait.CLOTH] = masks["hair"], masks["clothes"]
    for number, name in (
        (portrait.FRAME, "frame"), (portrait.LENS, "lens"), (portrait.HAT, "hat"),
        (portrait.THING, "thing"), (portrait.CLOTH, "clothes"),
    ):  # fmt: skip
        shares[number] += masks.get(f"prop {name}", nothing)
    # A rim is thinner than a pixel and still seen.
    shares[portrait.FRAME] = np.minimum(shares[portrait.FRAME] * 1.8, 1)
    label = shares.argmax(0).astype(np.uint8)
    skin = label == portrait.SKIN
    label[skin & (masks["neck"] > 0.5 * masks["skin"])] = portrait.NECK
    label[skin & (masks["ears"] > 0.5 * masks["skin"])] = portrait.EARS
    bearded = (near["beard"] > BEARDED) & np.isin(label, (portrait.SKIN, portrait.NECK))
    label[bearded] = portrait.BEARD
    label[skin & (masks["lips"] > 0.5 * masks["skin"])] = portrait.LIPS
    label[skin & (masks["brows"] > 0.4 * masks["skin"])] = portrait.BROWS
    label[skin & (near["hair"] > HAIRY)] = portrait.HAIR
    if lens is not None:
        seen = (lens > 0.5) & (label != portrait.FRAME)
        label[seen] = portrait.LENS
    return label


def _shadow(masks, label):
    share = masks["shadow"] / np.maximum(masks["skin"] + masks["clothes"] + masks["props"], 0.3)
    out = np.where(share > SHADOW[1], 1, np.where(share > SHADOW[0], portrait.UNSURE, 0))
    out[np.isin(label, (portrait.HAIR, portrait.BEARD, portrait.BROWS))] = portrait.UNSURE
    out[label == portrait.BACKGROUND] = 0
    return out.astype(np.uint8)
