"""Paint a subject in a scene, with everything that is known about the picture."""

from dataclasses import dataclass, replace

import numpy as np

from bakery.geometry import rotation
from bakery.geometry.camera import crop, project, project_camera, to_camera
from bakery.geometry.mesh import vertex_normals
from bakery.geometry.raster import rasterize
from bakery.heads.base import EYES, INTERIOR, PARTS, HeadModel
from bakery.synth import facial, film, garment, layers, skin
from bakery.synth.chart import chart_of
from bakery.synth.eyes import shade_eye
from bakery.synth.hair import grow_scalp, hair_color
from bakery.synth.layers import CLOTH, PROP
from bakery.synth.light import ShadowMap, disc_directions, shine_on, transfer
from bakery.synth.mouth import PARTS_INSIDE, opening, shade_inside
from bakery.synth.roots import scalp_mask
from bakery.synth.scene import Scene
from bakery.synth.strands import Strands, Volume
from bakery.synth.subject import Subject
from bakery.synth.surface import bend, diffuse, highlights, scatter
from bakery.types import EXPRESSION_INDEX, EXPRESSIONS, Camera


@dataclass(frozen=True)
class Picture:
    """A painted picture and the truth about it."""

    encoded: np.ndarray  # [H, W, 3] float32 sRGB-encoded 0..1
    camera: Camera
    identity: np.ndarray  # [I]
    expression: np.ndarray  # [E]
    gaze: np.ndarray  # [2] degrees
    light: np.ndarray  # [9, 3] irradiance / pi of the unshadowed light
    landmarks: np.ndarray  # [L, 2] pixels
    vertices: np.ndarray  # [V, 3] mm, the posed head in head space
    masks: dict  # name -> [H, W] float32 share: skin, hair, clothes, background, eyes, mouth, props
    parts: dict  # name -> [H, W] float32 share: beard and `layers.skin_regions`
    linear: np.ndarray  # [H, W, 3] float32 scene light before the film


@dataclass(frozen=True)
class Wardrobe:
    """What a subject keeps from picture to picture."""

    subject: Subject
    head: HeadModel
    chart: object
    neutral: np.ndarray  # [V, 3] mm
    scalp: np.ndarray  # [H, W] hair density on the chart
    hair: Strands
    clothes: object
    share: float  # of the full number of hairs
    props: tuple = ()  # of props.Prop


def dress(head: HeadModel, subject: Subject, detail: float = 4.0, share: float = 1.0) -> Wardrobe:
    """Prepare a subject for painting.

    Args:
        detail: pixels a mm of the skin's chart.
        share: of the full number of hairs.
    """
    chart = chart_of(head, detail)
    neutral = head.neutral(subject.identity)
    mask = scalp_mask(chart, subject)
    clothes = garment.make_garment(head, subject, neutral)
    hair = grow_scalp(head, chart, subject, mask, neutral, share, clothes.body)
    return Wardrobe(
        subject,
        head,
        chart,
        neutral,
        mask,
        hair,
        clothes,
        share,
    )


def _merge(wardrobe, posed):
    """One mesh of head, clothes and props: vertices, faces, part [F], rest [V, 3], band [V]."""
    head, clothes = wardrobe.head, wardrobe.clothes
    shown = head.part_faces("skin", *INTERIOR)
    shown = shown[~clothes.covered[shown]]
    offset = len(posed)
    vertices = np.concatenate([posed, clothes.vertices])
    faces = np.concatenate([head.faces[shown], clothes.faces + offset])
    part = np.concatenate([head.face_part[shown], np.full(len(clothes.faces), CLOTH)]).astype(int)
    rest = np.concatenate([head.mean, clothes.vertices])
    band = np.concatenate([np.zeros(offset), clothes.band])
    for number, prop in enumerate(wardrobe.props, PROP):
        faces = np.concatenate([faces, prop.faces + len(vertices)])
        part = np.concatenate([part, np.full(len(prop.faces), number)])
        vertices = np.concatenate([vertices, prop.vertices])
        rest = np.concatenate([rest, prop.albedo])  # a prop's place at rest is nobody's business
        band = np.concatenate([band, np.zeros(len(prop.vertices))])
    return vertices, faces, part, rest, band


def _move(strands, camera):
    turn = rotation.matrix(camera.rotation)
    return replace(
        strands,
        points=to_camera(strands.points, camera).astype(np.float32),
        normals=strands.normals @ turn.T,
    )


def _normals(vertices, faces, part):
    """Vertex normals [V, 3], each part on its own so that lids and lips keep their own side."""
    out = np.zeros_like(vertices)
    for number in np.unique(part):
        own = faces[part == number]
        used = np.unique(own)
        out[used] = vertex_normals(vertices, own)[used]
    skin = faces[part == PARTS.index("skin")]
    used = np.unique(skin)
    out[used] = vertex_normals(vertices, skin)[used]
    return out


def paint(wardrobe: Wardrobe, scene: Scene, supersample: int = 2, quality: float = 1.0) -> Picture:
    """Paint one picture.

    Args:
        wardrobe: from `dress`.
        scene: from `bakery.synth.scene`.
        supersample: samples per pixel and axis.
        quality: scales the number of shadow directions.

    Returns:
        Picture.
    """
    subject, head, chart = wardrobe.subject, wardrobe.head, wardrobe.chart
    environment = scene.environment
    fine = crop(
        scene.camera,
        0,
        0,
        scene.camera.width * supersample,
        scene.camera.height * supersample,
        supersample,
    )
    height, width = fine.height, fine.width
    posed = head.vertices(wardrobe.neutral, scene.expression, scene.gaze)
    merged, faces, part, rest, band = _merge(wardrobe, posed)
    vertices = to_camera(merged, fine)
    normals = _normals(vertices, faces, part)
    unseen = [k for k, prop in enumerate(wardrobe.props, PROP) if not prop.shown]
    drawn = faces[~np.isin(part, unseen)]  # those left out come last, so that numbers hold
    seen = rasterize(project_camera(vertices, fine), -vertices[:, 2], drawn, (height, width))

    sets = [wardrobe.hair, *facial.brows(head, chart, subject, posed, wardrobe.share)]
    sets += facial.beard(head, chart, subject, posed, wardrobe.share)
    lash = facial.lashes(head, subject, posed, wardrobe.share)
    sets = [_move(s, fine) for s in sets]
    lash = [_move(s, fine) for s in lash]
    volume = Volume([sets[0]] + [s for s in sets if s.kind == "beard"])

    walls = faces[(part == PARTS.index("skin")) | (part >= CLOTH)]  # what casts shadows
    baked, openness = _bake(vertices, normals, walls, environment, volume, quality)
    rows, columns = np.nonzero(seen.face >= 0)
    corner = faces[seen.face[rows, columns]]
    weight = seen.barycentric[rows, columns]

    def blend(values):
        return np.einsum("nk,nkc->nc", weight, values.astype(np.float32)[corner])

    points, smooth = blend(vertices), blend(normals)
    smooth /= np.linalg.norm(smooth, axis=1, keepdims=True) + 1e-9
    kind = part[seen.face[rows, columns]]
    still, shade = blend(rest), blend(np.concatenate([baked, openness[:, None], band[:, None]], 1))
    view = -points / np.linalg.norm(points, axis=1, keepdims=True)
    visibility = _visibility(points, smooth, vertices, walls, environment, volume, quality)
    pixel = float(np.median(points[:, 2] / -fine.focal))

    image = np.zeros((height, width, 3), np.float32)
    is_skin, is_cloth = kind == PARTS.index("skin"), kind == CLOTH
    folds = _folds(scene.expression)
    maps = skin.design_skin(chart, subject, wardrobe.scalp, **folds)
    turn = rotation.matrix(fine.rotation).astype(np.float32)
    _shade_skin(
        image, (rows, columns), is_skin, subject, chart, maps, still, smooth, view, shade,
        visibility, environment, turn, pixel, seen,
    )  # fmt: skip
    at = np.flatnonzero(is_cloth)
    if len(at):
        image[rows[at], columns[at]] = _shade_cloth(
            subject,
            wardrobe.clothes.throat,
            still[at],
            smooth[at],
            view[at],
            shade[at],
            visibility[:, at],
            environment,
            turn,
        )
    for number, prop in enumerate(wardrobe.props, PROP):
        at = np.flatnonzero(kind == number)
        image[rows[at], columns[at]] = _shade_prop(
            prop, still[at], smooth[at], view[at], shade[at], visibility[:, at], environment
        )
    marks = to_camera(head.landmarks(posed), fine)
    centers = to_camera(head.eye_centers(wardrobe.neutral), fine)
    lips = float(marks[[13, 14], 2].max())
    shown = np.full((height, width), -1)
    shown[rows, columns] = kind
    inside = opening(shown, [PARTS.index(n) for n in PARTS_INSIDE if n != "eye_socket"], pixel)
    for number, name in enumerate(PARTS):
        at = np.flatnonzero(kind == number)
        if not len(at) or name == "skin":
            continue
        if name.startswith("eye_") and name[4:] in EYES:
            side = name[4:]
            center = centers[EYES.index(side)]
            ball = float(
                np.median(
                    np.linalg.norm(vertices[np.unique(faces[part == number])] - center, axis=1)
                )
            )
            mask = np.zeros((height, width), bool)
            mask[rows[at], columns[at]] = True
            image[rows[at], columns[at]] = shade_eye(
                subject, side, points[at], (rows[at], columns[at]), mask, pixel, marks, center, ball,
                environment, visibility[0, at],
            )  # fmt: skip
        elif name in PARTS_INSIDE:
            image[rows[at], columns[at]] = shade_inside(
                name, points[at], smooth[at], view[at], lips, inside[rows[at], columns[at]],
                visibility[:, at], environment,
            )  # fmt: skip
    regions = {
        name: layers.spread(values, (rows, columns), (height, width))
        for name, values in {
            **layers.skin_regions(chart, still, is_skin),
            **layers.cast_shadow(smooth, visibility, shade[:, :3], environment),
        }.items()
    }
    regions |= layers.prop_regions(shown, wardrobe.props)
    linear, masks, parts = layers.compose(
        scene, shown, seen.depth, image, sets, lash, volume, fine, supersample, regions
    )
    rng = np.random.default_rng([scene.seed, 5])
    return Picture(
        film.develop(linear, rng, scene.grain, scene.blur, scene.quality, contrast=scene.contrast),
        scene.camera,
        subject.identity,
        scene.expression,
        np.asarray(scene.gaze, float),
        environment.irradiance(),
        project(head.landmarks(posed), scene.camera),
        posed,
        masks,
        parts,
        linear,
    )


def _folds(expression):
    w = dict(zip(EXPRESSIONS, expression))
    assert len(w) == len(EXPRESSION_INDEX)
    return {
        "smile": float(w["mouthSmileLeft"] + w["mouthSmileRight"]) / 2,
        "brow_raise": float(
            max(w["browInnerUp"], (w["browOuterUpLeft"] + w["browOuterUpRight"]) / 2)
        ),
        "frown": float(w["browDownLeft"] + w["browDownRight"]) / 2,
    }


def _bake(vertices, normals, faces, environment, volume, quality):
    """Shadowed dome light [V, 3] and openness [V] at the vertices."""
    carried, openness = transfer(vertices, normals, faces, max(24, int(80 * quality)))
    hidden = np.exp(-0.10 * volume.thickness(vertices + normals, normals, 1.0, 26.0))
    baked = np.maximum(carried @ environment.ambient, 0) * (0.25 + 0.75 * hidden)[:, None]
    return baked, np.clip(openness * hidden, 0, 1)


def _visibility(points, normals, vertices, faces, environment, volume, quality):
    """How much of each lamp [lamps, N] reaches each point."""
    out = np.ones((len(environment.lamps), len(points)), np.float32)
    for k, lamp in enumerate(environment.lamps):
        count = max(3, int((14 if k == 0 else 6) * quality))
        total = np.zeros(len(points), np.float32)
        lifted = (points + normals * 0.6).astype(np.float32)
        for toward in disc_directions(lamp, count):
            total += ShadowMap(vertices, faces, toward, 900 if quality >= 1 else 384).lit(
                lifted, 0.8, 2.0
            )
        shadow = volume.thickness(points, lamp.direction, 1.5, 70.0)
        out[k] = total / count * np.exp(-0.14 * shadow)
    return out


def _shade_skin(
    image,
    where,
    is_skin,
    subject,
    chart,
    maps,
    still,
    smooth,
    view,
    shade,
    visibility,
    environment,
    turn,
    pixel,
    seen,
):
    """Fill the skin pixels of the image."""
    rows, columns = where[0][is_skin], where[1][is_skin]
    albedo, rough, slope, cavity, lips = skin.shade_inputs(
        chart, maps, subject, still[is_skin], hair_color(subject)
    )
    base, baked, lit = smooth[is_skin], shade[is_skin, :3], visibility[:, is_skin]
    openness = shade[is_skin, 3]
    normal = bend(base, (slope @ turn.T).astype(np.float32))
    light = diffuse(normal, base, environment, lit, baked, np.array([0.42, 0.16, 0.08]))
    flat = np.zeros_like(image)
    flat[rows, columns] = light * cavity[:, None]
    mask = np.zeros(image.shape[:2], np.float32)
    mask[rows, columns] = 1
    spread = scatter(flat, mask, pixel)[rows, columns]
    # Light that bounces in creases comes back redder.
    bounce = albedo ** (1 + 0.35 * (1 - openness)[:, None] ** 2)
    reflectance = 0.026 + 0.006 * lips
    shine = highlights(normal, view[is_skin], rough, reflectance, environment, lit, openness)
    strength = (0.85 + 0.35 * (subject.gloss - 1)) * cavity**2
    image[rows, columns] = bounce * spread + shine * strength[:, None]


def _shade_cloth(subject, throat, still, smooth, view, shade, visibility, environment, turn):
    """Colour [n, 3] of cloth, which light partly shines through and bounces within."""
    albedo, slope = garment.cloth_inputs(subject, still, shade[:, 4], throat)
    normal = bend(smooth, slope @ turn.T)
    within = shine_on(smooth, environment.irradiance_ambient()) * albedo
    baked = 0.8 * shade[:, :3] + 0.35 * within
    light = diffuse(normal, smooth, environment, visibility, baked, np.full(3, 0.1))
    rough = np.full(len(view), 0.75, np.float32)
    sheen = highlights(normal, view, rough, 0.03, environment, visibility, shade[:, 3])
    return albedo * light + 0.5 * sheen


def _shade_prop(prop, albedo, smooth, view, shade, visibility, environment):
    """Colour [n, 3] of a thing that light enters as little as it enters skin."""
    light = diffuse(
        smooth, smooth, environment, visibility, shade[:, :3], np.array([0.3, 0.1, 0.05])
    )
    rough = np.full(len(view), prop.rough, np.float32)
    shine = highlights(smooth, view, rough, prop.reflectance, environment, visibility, shade[:, 3])
    return albedo * light + shine
