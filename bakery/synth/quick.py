"""Paints a textured head fast: a tenth of a second a picture, for pairs to train on.

The shading is that of `bakery.synth.render` (shadowed lamps, a dome, light under the skin, gloss);
skin comes from a texture on the head's atlas, so that no strand of hair is drawn but lashes.
"""

from dataclasses import dataclass, replace

import cv2
import numpy as np

from bakery.generators.lids import lid_cover
from bakery.geometry import camera as cameras
from bakery.geometry import harmonics, rotation
from bakery.geometry.fill import smoothstep
from bakery.geometry.mesh import vertex_normals
from bakery.geometry.noise import value_noise
from bakery.geometry.raster import rasterize
from bakery.geometry.sample import bilinear
from bakery.heads.base import INTERIOR, PARTS
from bakery.stages.atlas import make_atlas
from bakery.synth import film
from bakery.synth import quick_kernels as kernels
from bakery.synth.eyes import EYES, shade_eye
from bakery.synth.light import Environment, ShadowMap, disc_directions, shine_on, transfer
from bakery.synth.mouth import PARTS_INSIDE, shade_inside
from bakery.synth.skin import HAEMOGLOBIN
from bakery.synth.strands import draw_strands
from bakery.synth.surface import diffuse, highlights, scatter

SHADOW_MAP = 256  # pixels
KEY_SAMPLES, OTHER_SAMPLES = 4, 1  # directions of a lamp's disc
DOME_SAMPLES = 32
SOFT = 4.0  # mm of height over which a shadow's edge fades
DRAWN = ("skin", *INTERIOR)
WRAP = np.array([0.42, 0.16, 0.08])  # how far light creeps round, per channel
# Blood that leaves skin under tension and gathers under compression, share of it per share of area.
FLUSH = 0.5
DEEPEST = 0.95  # mm that relief tends to
GROOVE = np.array([0.30, 0.38, 0.40])  # log-reflectance a mm of relief, per channel
DEEP = 16.0  # mm behind the lips at which half of the light is left


@dataclass(frozen=True)
class Stage:
    """What all subjects of one head model share."""

    head: object  # HeadModel
    atlas: object  # Atlas
    skin_rows: np.ndarray  # [N] rows of the atlas on skin
    rest: np.ndarray  # [T, T, 3] mm, the mean head at the texels
    steps: np.ndarray  # [F, 2, 2] texels (u, v) along the first and second edge of each face
    walls: np.ndarray  # [n, 3] faces of the skin, which cast shadows


def make_stage(head, texels):
    """Prepare a head model for painting."""
    atlas = make_atlas(head, texels)
    uv = head.uv[head.uv_faces] * texels
    return Stage(
        head,
        atlas,
        np.flatnonzero(atlas.rows("skin")),
        atlas.paint(atlas.at(head.mean)),
        np.stack([uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]], 1).astype(np.float32),
        head.faces[head.part_faces("skin")],
    )


@dataclass(frozen=True)
class Figure:
    """One subject under its light, ready to be painted in any expression from any side."""

    stage: Stage
    head: object  # HeadModel whose lids close on this subject's eyes
    traits: object  # synth.subject.Subject, for eyes and lashes
    neutral: np.ndarray  # [V, 3] mm
    albedo: np.ndarray  # [T, T, 3] float32 linear
    rough: np.ndarray  # [T, T] float32
    height: np.ndarray  # [N] mm, relief of the resting skin at the stage's rows
    folds: object  # folds.Folds
    lids: object  # generators.lids.LidSkin
    teeth: dict  # mouth part -> [3] reflectance
    lashes: object  # (vertices) -> list of Strands
    environment: Environment  # in head space
    dome: np.ndarray  # [V, 3] shadowed light of the dome at rest
    openness: np.ndarray  # [V] 0..1


def bake_dome(head, neutral, environment):
    """Shadowed light of the dome [V, 3] and openness [V] at the vertices of a resting head."""
    normals = vertex_normals(neutral, head.faces)
    faces = head.faces[head.part_faces("skin")]
    carried, openness = transfer(neutral, normals, faces, DOME_SAMPLES, 128)
    return (
        np.maximum(carried @ environment.ambient, 0).astype(np.float32),
        np.clip(openness, 0, 1).astype(np.float32),
    )


def turned(environment, turn):
    """An environment rotated by `turn` [3, 3]."""
    lamps = tuple(replace(lamp, direction=turn @ lamp.direction) for lamp in environment.lamps)
    return Environment(lamps, harmonics.turned(environment.ambient, turn))


def paint(figure, expression, gaze, camera, supersample=1.5):
    """Scene light [H, W, 3] linear of one picture, and what is seen [H, W] (part, -1 for none).

    Args:
        expression: [E] weights; gaze: [2] degrees.
        camera: Camera of the picture.
    """
    head = figure.head
    fine = cameras.crop(
        camera, 0, 0, camera.width * supersample, camera.height * supersample, supersample
    )
    posed = head.vertices(figure.neutral, expression, gaze)
    points = cameras.to_camera(posed, fine)
    faces = head.part_faces(*DRAWN)
    found = rasterize(
        cameras.project_camera(points, fine), -points[:, 2], head.faces[faces],
        (fine.height, fine.width), cull=True,
    )  # fmt: skip
    seen = found.face >= 0
    number = np.where(seen, faces[found.face], 0).astype(np.int32)
    kind = np.where(seen, head.face_part[number].astype(np.int16), -1)
    fragments = type(found)(
        np.where(seen, number, -1).astype(np.int32), found.barycentric, found.depth
    )
    normals = vertex_normals(points, head.faces).astype(np.float32)
    light = turned(figure.environment, rotation.matrix(fine.rotation))
    pixel = float(np.median(found.depth[seen])) / fine.focal
    image = np.zeros(kind.shape + (3,), np.float32)
    maps = [_maps(points, figure.stage.walls, lamp, k) for k, lamp in enumerate(light.lamps)]
    _skin(
        figure, image, fragments, kind, points, normals, posed, expression, light, maps, pixel, fine
    )
    _inside(figure, image, fragments, kind, points, normals, posed, light, maps, pixel, fine)
    if figure.lashes is not None:
        _lashes(figure, image, posed, found.depth, fine, light)
    if supersample > 1:
        size = (camera.width, camera.height)
        image = cv2.resize(image, size, interpolation=cv2.INTER_AREA)
        kind = cv2.resize(kind, size, interpolation=cv2.INTER_NEAREST)
    return image, kind


def _maps(points, walls, lamp, number):
    count = KEY_SAMPLES if number == 0 else OTHER_SAMPLES
    return [ShadowMap(points, walls, toward, SHADOW_MAP) for toward in disc_directions(lamp, count)]


def _visibility(maps, points, normals):
    """How much of each lamp [lamps, N] reaches points [N, 3]."""
    lifted = np.ascontiguousarray(points + normals * 0.8, np.float32)
    out = np.zeros((len(maps), len(lifted)), np.float32)
    for total, own in zip(out, maps):
        for one in own:
            total += one.lit(lifted, 1.0, SOFT) / len(own)
    return out


def _skin(
    figure, image, fragments, kind, points, normals, posed, expression, light, maps, pixel, camera
):
    head, stage = figure.head, figure.stage
    atlas = stage.atlas
    rows, columns = np.nonzero(kind == PARTS.index("skin"))
    face, weight = fragments.face[rows, columns], fragments.barycentric[rows, columns]
    turn = rotation.matrix(camera.rotation)
    rest = vertex_normals(figure.neutral, head.faces) @ turn.T
    flush = kernels.swell(stage.walls, posed, figure.neutral)
    values = np.concatenate(
        [normals, points, rest, figure.dome, figure.openness[:, None], flush[:, None]], 1
    ).astype(np.float32)
    values = kernels.gather(face, weight, head.faces, values)
    smooth, rest = kernels.unit(values[:, :3]), kernels.unit(values[:, 6:9])
    place, dome, openness, flush = values[:, 3:6], values[:, 9:12], values[:, 12], values[:, 13]
    view = kernels.unit(-place)
    texel = kernels.gather(face, weight, head.uv_faces, head.uv) * atlas.size

    height = np.zeros(len(atlas.index), np.float32)
    total = figure.height + figure.folds.relief(figure.folds.depths(posed))
    height[stage.skin_rows] = DEEPEST * np.tanh(total / DEEPEST)  # folds that meet share their skin
    relief = atlas.fill_gutter(atlas.paint(height))
    slope_v, slope_u = np.gradient(relief)
    sampled = bilinear(np.stack([slope_u, slope_v, relief, figure.rough], -1), texel)
    normal = kernels.tilt(
        face, head.faces, points.astype(np.float32), stage.steps, sampled[:, :2], smooth, 1.2
    )
    # Light is lost in a groove; its edges catch a little more.
    cavity = np.exp(0.30 * np.clip(sampled[:, 2], -1.5, 0.4)).astype(np.float32)

    albedo = bilinear(figure.albedo, texel)
    shut = lid_cover(figure.lids, expression, texel / atlas.size)
    if shut is not None:
        albedo = albedo + (shut[0] - albedo) * shut[1][:, None]
    albedo = albedo * np.exp(-FLUSH * np.outer(flush, HAEMOGLOBIN).astype(np.float32))

    # The dome was baked at rest: what the expression turns towards it or away counts as a ratio.
    sky = light.irradiance_ambient()
    ratio = shine_on(smooth, sky) / np.maximum(shine_on(rest, sky), 1e-3)
    baked = dome * np.clip(ratio, 0.6, 1.6)
    visible = _visibility(maps, place, smooth)
    flat = np.zeros_like(image)
    flat[rows, columns] = diffuse(normal, smooth, light, visible, baked, WRAP) * cavity[:, None]
    mask = (kind == PARTS.index("skin")).astype(np.float32)
    spread = scatter(flat, mask, pixel)[rows, columns]
    # Light that bounces in creases comes back redder.
    bounce = albedo ** (1 + 0.35 * (1 - openness)[:, None] ** 2)
    rough = np.clip(sampled[:, 3], 0.22, 0.9)
    gloss = highlights(normal, view, rough, 0.026, light, visible, openness)
    strength = figure.traits.gloss * 0.75 * cavity**2
    # A groove too narrow to show in the light that spreads under the skin is still dark and red.
    groove = np.exp(np.outer(np.clip(sampled[:, 2], -1.2, 0.5), GROOVE)).astype(np.float32)
    image[rows, columns] = bounce * spread * groove + gloss * strength[:, None]


def _inside(figure, image, fragments, kind, points, normals, posed, light, maps, pixel, fine):
    """Eyes and the mouth's interior."""
    head = figure.head
    marks = cameras.to_camera(head.landmarks(posed), fine)
    centers = cameras.to_camera(head.eye_centers(figure.neutral), fine)
    mouth = [PARTS.index(n) for n in PARTS_INSIDE if n != "eye_socket"]
    reach = _reach(kind, fragments.depth, mouth, pixel)
    surface = np.concatenate([points, normals], 1).astype(np.float32)
    for number, name in enumerate(PARTS):
        if name == "skin":
            continue
        rows, columns = np.nonzero(kind == number)
        if not len(rows):
            continue
        face, weight = fragments.face[rows, columns], fragments.barycentric[rows, columns]
        both = kernels.gather(face, weight, head.faces, surface)
        place, normal = both[:, :3], kernels.unit(both[:, 3:])
        visible = _visibility(maps, place, normal)
        if name.startswith("eye_") and name[4:] in EYES:
            side = name[4:]
            center = centers[EYES.index(side)]
            own = np.unique(head.faces[head.part_faces(name)])
            ball = float(np.median(np.linalg.norm(points[own] - center, axis=1)))
            image[rows, columns] = shade_eye(
                figure.traits, side, place, (rows, columns), kind == number, pixel, marks, center,
                ball, light, visible[0],
            )  # fmt: skip
        elif name in PARTS_INSIDE:
            view = -place / np.linalg.norm(place, axis=1, keepdims=True)
            image[rows, columns] = shade_inside(
                name, place, normal, view, 0.0, None, visible, light,
                _inner_color(figure, name, face, weight), reach[rows, columns],
            )  # fmt: skip


def _reach(kind, depth, mouth, pixel):
    """Share [H, W] of the light that comes in between the lips.

    Points near a lip see less sky, points deep behind the lips see the opening under a smaller
    angle. Lips bend back towards the corners: depth counts from the skin around each point.
    """
    inside = np.isin(kind, mouth).astype(np.float32)
    if not inside.any():
        return inside
    skin = (kind == PARTS.index("skin")).astype(np.float32)
    around = max(5.0 / pixel, 1.0)
    near = cv2.GaussianBlur(inside, (0, 0), max(1.1 / pixel, 0.5))
    rim = (cv2.dilate(inside, np.ones((3, 3))) * skin) > 0
    # In the middle of a mouth that gapes no lip is near: there they are as deep as all of their rim.
    typical = depth[rim].mean() if rim.any() else 0.0
    lips = cv2.GaussianBlur(np.where(skin > 0, depth - typical, 0), (0, 0), around)
    lips = typical + lips / np.maximum(cv2.GaussianBlur(skin, (0, 0), around), 1e-3)
    behind = np.where(inside > 0, depth - lips - 3.0, 0)
    deep = 1 / (1 + (np.maximum(behind, 0) / DEEP) ** 2)
    return (deep * (0.45 + 0.55 * smoothstep(0.3, 0.95, near))).astype(np.float32)


def _inner_color(figure, name, face, weight):
    """Reflectance [n, 3] of teeth, gums and tongue; every tooth a little different."""
    base = figure.teeth.get(name)
    if base is None:
        return None
    rest = kernels.gather(face, weight, figure.head.faces, figure.head.mean)
    tooth = value_noise(rest, 6.0, figure.traits.seed)
    fine = value_noise(rest, 1.1, figure.traits.seed + 1)
    strong = 0.35 if name.startswith("teeth") else 1.0
    return base * np.exp(0.16 * strong * tooth + 0.10 * strong * fine)[:, None]


def _lashes(figure, image, posed, depth, fine, light):
    """Draw the lashes over the picture."""
    sets = [
        replace(
            one,
            points=cameras.to_camera(one.points, fine).astype(np.float32),
            normals=one.normals @ rotation.matrix(fine.rotation).T,
        )
        for one in figure.lashes(posed)
    ]
    shine = light.irradiance_ambient()[0].mean() * harmonics.C0 * 4
    colors = [
        np.repeat((one.color * shine)[:, None], one.points.shape[1], 1).astype(np.float32)
        for one in sets
    ]
    coverage = np.zeros(image.shape[:2], np.float32)
    draw_strands(sets, colors, fine, depth.astype(np.float32) + 2.0, image, coverage)


def develop(linear, exposure, balance):
    """Scene light to a photo's linear values 0..1: exposure, white balance [3], film curve."""
    return film.tone(linear * (exposure * balance))
