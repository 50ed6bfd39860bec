"""What lies where in a painted picture: shares of each kind of thing, and where light is blocked."""

import cv2
import numpy as np

from bakery import landmarks
from bakery.heads.base import PARTS
from bakery.synth import film
from bakery.synth.chart import SIDES
from bakery.synth.skin import brow_mask
from bakery.synth.strands import draw_strands, shade_strands

CLOTH = len(PARTS)  # part number of clothes in the merged mesh
PROP = CLOTH + 1  # the first thing that the subject holds or wears; more follow
JAW = np.array([152, 377, 400, 378, 379, 365, 397, 288, 361, 323])  # from the chin to the ear
UNDER_JAW = 5.0  # mm below the points of the jaw at which the neck begins
GROUPS = {
    "skin": ["skin", "eye_socket"],
    "eyes": ["eye_left", "eye_right"],
    "mouth": [
        "mouth_cavity", "teeth_upper", "teeth_lower", "gums_upper", "gums_lower", "tongue",
    ],
}  # fmt: skip


def spread(values: np.ndarray, where: tuple, shape: tuple) -> np.ndarray:
    """Values [N] at pixels (rows [N], columns [N]) as a picture `shape` float32, 0 elsewhere."""
    out = np.zeros(shape, np.float32)
    out[where] = values
    return out


def skin_regions(chart, rest: np.ndarray, is_skin: np.ndarray) -> dict:
    """Which skin is of lips, ears and neck.

    Args:
        chart: the head's `Chart`.
        rest: [N, 3] mm, places on the mean head.
        is_skin: [N] bool.

    Returns:
        dict of [N] float32 0..1: lips, brows, ears, neck.
    """
    flat = chart.flat(rest)
    lips = chart.sample(chart.polygon(chart.spot(landmarks.LIPS_OUTER), 0.6), rest)
    left, right, bottom, top = chart.ear
    across = (np.abs(flat[:, 0]) - (left + right) / 2) / ((right - left) / 2)
    up = (flat[:, 1] - (bottom + top) / 2) / ((top - bottom) / 2)
    ears = (np.abs(across) ** 4 + np.abs(up) ** 4 < 1) * is_skin
    jaw = chart.spot(JAW)
    edge = np.interp(np.abs(flat[:, 0]), jaw[:, 0], jaw[:, 1])
    neck = (flat[:, 1] < edge - UNDER_JAW) & (ears == 0) & is_skin
    brows = sum(chart.sample(brow_mask(chart, side), rest) for side in SIDES)
    return {"lips": lips * is_skin, "brows": brows * is_skin, "ears": ears, "neck": neck}


def cast_shadow(normals: np.ndarray, visibility: np.ndarray, dome: np.ndarray, environment) -> dict:
    """Where the first lamp is blocked, as a share of the light that would be there.

    Args:
        normals: [N, 3] unit, camera space.
        visibility: [lamps, N] how much of each lamp arrives.
        dome: [N, 3] shadowed light of the dome.
        environment: Environment.

    Returns:
        {"shadow": [N] float32 0..1}; small where the surface is turned from the lamp, since nothing
        is to be seen of a shadow there.
    """
    facing = [
        np.clip(normals @ lamp.direction, 0, 1) * float(np.mean(lamp.color))
        for lamp in environment.lamps
    ]
    blocked = facing[0] * (1 - visibility[0])
    arrives = dome.mean(1) + sum(light * seen for light, seen in zip(facing, visibility))
    return {"shadow": blocked / np.maximum(arrives + blocked, 1e-6)}


def prop_regions(shown: np.ndarray, props: tuple) -> dict:
    """Where each kind of prop shows: {"prop frame": [H, W] float32, ...}.

    Args:
        shown: [H, W] part numbers, -1 for none.
        props: of `props.Prop`.
    """
    out = {}
    for number, prop in enumerate(props, PROP):
        name = f"prop {prop.what}"
        out[name] = out.get(name, 0) + (shown == number).astype(np.float32)
    return out


def shrink(picture: np.ndarray, supersample: int) -> np.ndarray:
    """A picture with `supersample` squared of its pixels averaged into one."""
    if supersample == 1:
        return picture
    size = (picture.shape[1] // supersample, picture.shape[0] // supersample)
    return cv2.resize(picture, size, interpolation=cv2.INTER_AREA)


def compose(scene, kinds, depth, image, sets, lash, volume, fine, supersample, regions):
    """Draw hair over the image, lay it on the background, and shrink.

    Args:
        scene: Scene.
        kinds: [H, W] part of the merged mesh, -1 for none.
        depth: [H, W] mm of what is seen.
        image: [H, W, 3] float32 linear of the solid parts.
        sets: Strands in camera space: scalp hair, brows, then beard.
        lash: Strands of the lashes.
        volume: Volume of the hair.
        fine: Camera of these pixels.
        supersample: pixels to average along each axis.
        regions: {name: [H, W]} of solid things, which scalp hair hides.

    Returns:
        linear [h, w, 3]; masks {name: [h, w] float32 share} that sum to one: hair, clothes,
        background, props, skin, eyes, mouth; parts of these alike: beard and the regions.
    """
    rng = np.random.default_rng([scene.seed, 3])
    height, width = kinds.shape
    behind = film.background(rng, scene.background, height, width, scene.background_color)
    solid = kinds >= 0
    image[~solid] = behind[~solid]
    wall = depth.astype(np.float32)
    coverage = {name: np.zeros((height, width), np.float32) for name in ("hair", "brow", "beard")}
    colors = [shade_strands(s, scene.environment, volume) for s in sets]
    for one, color in zip(sets[1:], colors[1:]):
        draw_strands([one], [color], fine, wall, image, coverage[one.kind])
    fringe = [shade_strands(s, scene.environment, volume, 0.8) for s in lash]
    draw_strands(lash, fringe, fine, wall + 2.0, image, np.zeros((height, width), np.float32))
    draw_strands(sets[:1], colors[:1], fine, wall, image, coverage["hair"])
    bare = 1 - coverage["hair"]
    masks = {"hair": coverage["hair"]}
    masks["clothes"], masks["background"] = (kinds == CLOTH) * bare, (kinds < 0) * bare
    masks["props"] = (kinds >= PROP) * bare
    for name, members in GROUPS.items():
        masks[name] = np.isin(kinds, [PARTS.index(m) for m in members]) * bare
    parts = {"beard": coverage["beard"], **regions}
    parts = {name: part * bare for name, part in parts.items()}
    small = [
        {name: shrink(m.astype(np.float32), supersample) for name, m in some.items()}
        for some in (masks, parts)
    ]
    return shrink(image, supersample), *small
