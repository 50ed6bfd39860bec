"""The part of a face's albedo that one photo shows, on the atlas (Saito 2017, section 4)."""

from dataclasses import dataclass

import cv2
import numpy as np

from bakery.geometry import harmonics, rotation
from bakery.geometry.color import LUMA
from bakery.geometry.fill import diffuse, normalized_blur, smoothstep, soft_limit, sparse_blur
from bakery.geometry.mesh import vertex_normals
from bakery.geometry.sample import bicubic, bilinear
from bakery.heads.base import HeadModel
from bakery.landmarks import EYES, LIPS_INNER, NOSE_BASE, OVAL
from bakery.stages.atlas import Atlas, Visibility, soften, uv_polygon
from bakery.stages.texture.hair import Mattes
from bakery.stages.texture.occlusion import Openness, openness
from bakery.stages.texture.shadows import SHADED, penumbra
from bakery.types import Fit

DARKEST, BRIGHTEST = 0.5, 1.6  # shading over that of a frontal normal is never beyond
CONTRAST = 2.0  # of the shading of what faces the camera
AHEAD = np.array([[0, 0, 1], [-0.8, 0, 0.6], [0.8, 0, 0.6], [0, -0.8, 0.6], [0, 0.8, 0.6]])
SLANTING = (75.0, 55.0)  # degrees from which on tones are not believed, and up to which they are
SQUARE = (0.45, 0.75)  # cosine to the line of sight, from which the photo's light is kept
FALLOFF = 0.1  # log of light, beyond the rim at most
COARSE = 256  # texels of the picture in which light goes on from the face
# Of the face's contour, beyond which the head shelters skin: in the texture, and in what the albedo is divided by.
# At a jaw's rim the photo has an edge of its own, which would be a pale line in another light.
FROM_JAW, FROM_NECK = 1.0, 1.22
SHELTERED = 0.25  # of the light from above, is left everywhere
MIDDLE = 0.55  # of the face's contour: within, sockets and sides of a nose are dark by nature, and believed
PALER = 0.6  # log of red over blue: skin of one face, in all its parts, differs less
GRAZING = (75.0, 45.0)  # degrees: from the second on the light behind a head may glare on its skin
GLARE_PALER, GLARE_LIGHTER = (0.2, 0.45), (0.15, 0.4)  # log of red over blue, and of luminance
BETTER = (0.15, 0.35)  # cosine by which the other half is seen better: no matter, it stands in
STREAKED = (0.55, 0.35)  # cosine from which on it does not, and up to which it does
UP_TO_HAIR = 0.9  # of the face's contour
HAIR_DARKER, HAIR_PALER = (0.3, 0.7), (0.2, 0.45)  # log by which beards are darker and less red
BLUR = 1 / 500  # of the atlas's side, before colours are compared
ISLAND = 0.02  # of the largest piece of seen skin: smaller ones beyond the face are left out


@dataclass(frozen=True)
class PartialAlbedo:
    """What a photo shows of the skin's albedo, with all its detail, on the atlas."""

    albedo: np.ndarray  # [T, T, 3] float32 linear, relative to what a photo shows as 1
    seen: np.ndarray  # [T, T] float32 0..1: how surely the photo shows bare skin there
    even: np.ndarray  # [T, T] float32 0..1: 1 where it is seen squarely and in no cast shadow
    plain: np.ndarray  # [T, T] float32 0..1: 0 where brows, beard or lips are dark by nature
    light: np.ndarray  # [T, T, 3] float32: what an avatar keeps of the photo's, see `_held_light`
    openness: np.ndarray  # [T, T] float32 0..1, of the light from everywhere (`occlusion.Openness`)
    on_skin: np.ndarray  # [T, T] float32: 1 on the charts of the skin

    def lit(self, albedo: np.ndarray) -> np.ndarray:
        """An albedo [T, T, 3] in the light that the avatar keeps."""
        out: np.ndarray = albedo * np.where(self.on_skin[..., None] > 0, self.light, 1)
        return out


def reflectance(linear_points, shade):
    """Divide colours [N, 3] by shading [N, 3], both linear."""
    return linear_points / np.maximum(shade, 1e-3)


def shading(normals: np.ndarray, light: np.ndarray) -> np.ndarray:
    """Irradiance [N, 3] at camera-space normals, relative to that of a frontal normal.

    An avatar's texture keeps the photo's light, and nobody wants half a head in the dark: light from
    everywhere is added until what faces the camera differs by CONTRAST at most. On sides that the photo
    never showed harmonics swing wildly: the ratio bends smoothly towards DARKEST and BRIGHTEST.
    """
    front, *ahead = harmonics.irradiance(AHEAD, light) @ LUMA
    most, least = max(ahead), max(min(ahead), 0.0)
    fill = max(0.0, (most - CONTRAST * least) / (CONTRAST - 1))
    gray = harmonics.irradiance(normals, light) @ LUMA
    log = np.log(np.maximum(gray + fill, 1e-4) / max(front + fill, 1e-4))
    bound = np.log(np.where(log < 0, 1 / DARKEST, BRIGHTEST))
    out: np.ndarray = np.exp(soft_limit(log, bound))[:, None] * np.ones(3, np.float32)
    return out


def photo_shade(fit: Fit, head: HeadModel, vertices: np.ndarray, atlas: Atlas) -> np.ndarray:
    """`shading` of a photo's light at the texels of an atlas: [N, 3].

    Args:
        fit: Fit of the photo.
        vertices: [V, 3] mm, the shape as it stands in the photo.
    """
    return shading(_seen_normals(fit, head, vertices, atlas), fit.light)


def photo_light(fit: Fit, head: HeadModel, vertices: np.ndarray, atlas: Atlas) -> np.ndarray:
    """What an albedo has not of an avatar's texture: the photo's light [T, T, 3] float32, 1 off the atlas.

    Arguments as above.

    Where the photo sees the face squarely that is its shading. Beside it light falls off further: a thin
    rim in the photo, a dull cheek when the avatar turns. There the light at the rim goes on, with FALLOFF,
    and with what the head takes of the light from above: below the jaw it is dark.
    """
    normals = _seen_normals(fit, head, vertices, atlas)
    reached = _reached(head, vertices, atlas)
    shade = shading(normals, fit.light)
    return _held_light(shade, normals[:, 2], reached, head, atlas, FROM_NECK)[0]


def _reached(head, vertices, atlas):
    """Openness of the texels [N] of an atlas."""
    return Openness(*atlas.at(np.stack(openness(head, vertices), 1)).T)


def _held_light(shade, cosine, reached, head, atlas, within):
    """`photo_light` [T, T, 3] of shading [N, 3] and the cosine [N] to the line of sight, on an atlas.

    Args:
        reached: Openness of the texels. Folds, which no light reaches, are none of this.
        within: of the face's contour, where nothing shelters skin.

    Returns:
        That, and what of it [T, T] is left of the light from above beside the face, over that at its rim.
    """
    gray = np.log(np.maximum(shade[:, 0], 1e-3))
    sky = reached.above / np.maximum(reached.everywhere, 1e-3)
    sky = np.log(np.clip(sky, SHELTERED, 1))
    log, sky, on_skin = (atlas.paint(np.float32(x)) for x in (gray, sky, np.ones(len(gray))))
    square = atlas.paint(np.float32(smoothstep(*SQUARE, cosine)))
    square *= inner_face(head, atlas.size, 1.0)
    rim, rim_sky = _gone_on(np.stack([log, sky], 2), square)
    held = rim + soft_limit(log - rim, FALLOFF)
    beside = (1 - inner_face(head, atlas.size, within)) * on_skin
    shelter = np.exp(np.minimum(sky - rim_sky, 0) * beside)
    kept = np.exp(held + square * (log - held)) * shelter * on_skin + (1 - on_skin)
    return np.repeat(kept[..., None], 3, 2).astype(np.float32), shelter


def _gone_on(values, square):
    """Values [T, T, C] as they are where `square` [T, T] says so, gone on from there over the head: C of [T, T].

    From left and right they meet where the chart is cut, at the back and over the top. They are smooth, so
    a coarse picture will do.
    """
    full, size = len(square), min(len(square), COARSE)
    total = cv2.resize(
        np.dstack([values * square[..., None], square]), (size, size), interpolation=cv2.INTER_AREA
    )
    over = np.concatenate([total[: size // 2][::-1, ::-1], total])
    closed = np.concatenate([over[:, -size // 2 :], over, over[:, : size // 2]], 1)
    known = closed[..., -1]
    on = diffuse(closed[..., :-1] / np.maximum(known, 1e-6)[..., None], known)
    on = on[size // 2 :, size // 2 : -size // 2]
    return np.moveaxis(cv2.resize(on, (full, full), interpolation=cv2.INTER_LINEAR), 2, 0)


def _seen_normals(fit, head, vertices, atlas):
    """Unit normals [N, 3] at the texels of an atlas, in the camera's space."""
    turn = rotation.matrix(fit.camera.rotation)
    normals = atlas.at(vertex_normals(vertices, head.faces) @ turn.T)
    return normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-6)


def rims(points, shape):
    """How near a pixel [H, W] 0..1 is to the edge of a lid or to the line between the lips.

    There the surface turns away from the camera, yet what the photo shows is its own colour: the
    lash line, the line of the mouth.
    """
    out = np.zeros(shape, np.float32)
    for ring, band in ((EYES[0], 0.07), (EYES[1], 0.07), (LIPS_INNER, 0.05)):
        curve = points[ring]
        width = np.ptp(curve[:, 0])
        line = np.ones(shape, np.uint8)
        cv2.polylines(line, [np.round(curve * 16).astype(np.int32)], True, 0, shift=4)
        away = cv2.distanceTransform(line, cv2.DIST_L2, 3)
        out = np.maximum(out, smoothstep(band * width, 0.5 * band * width, away))
    return out.astype(np.float32)


def open_lids(skin_mask, points, occluder):
    """The mask with the lids let in up to their edge, where nothing hides them.

    A segmentation leaves a margin around the eyes; without it the lash line would be lost and lids
    would end in bare skin.

    Args:
        points: [L, 2] pixels.
        occluder: [H, W] 0..1, what hides the face.
    """
    out = skin_mask.copy()
    for lids in EYES:
        ring = points[lids]
        width = np.ptp(ring[:, 0])
        eye = np.zeros(out.shape, np.uint8)
        cv2.fillPoly(eye, [np.round(ring * 16).astype(np.int32)], 1, shift=4)
        away = cv2.distanceTransform(1 - eye, cv2.DIST_L2, 3)
        around = smoothstep(0.30 * width, 0.18 * width, away) * (1 - eye)
        out = np.maximum(out, around.astype(np.float32))
    return out * (1 - occluder)


def unwrap_albedo(
    linear: np.ndarray,
    mattes: Mattes,
    points: np.ndarray,
    fit: Fit,
    head: HeadModel,
    vertices: np.ndarray,
    atlas: Atlas,
    visibility: Visibility,
) -> PartialAlbedo:
    """Unwrap the skin of a photo and divide its light out.

    Args:
        linear: [H, W, 3] float32 photo, already filtered to about the atlas's density.
        mattes: Mattes of the photo.
        points: [L, 2] pixels, landmarks of the photo.
        fit: Fit of the photo.
        vertices: [V, 3] mm, the shape as it stands in the photo.
        atlas: Atlas of the head's skin.
        visibility: Visibility of that atlas through the photo's camera.

    References:
        Saito et al. 2017, section 4: the photo divided by the fitted shading, visible skin only.
    """
    pixels = visibility.pixels
    # There is no second view that could know better, so even slanting skin counts.
    weight = visibility.weight(grazing=88.0, full=76.0)
    weight = np.maximum(
        weight, visibility.visible * bilinear(rims(points, linear.shape[:2]), pixels)
    )
    mask = open_lids(mattes.skin, points, mattes.occluder)
    skin = np.maximum(bilinear(mask, pixels), up_to_hair(mattes, head, atlas, pixels))
    weight *= smoothstep(0.5, 0.95, skin)
    color = np.maximum(bicubic(linear, pixels), 0)
    normals = _seen_normals(fit, head, vertices, atlas)
    shade = shading(normals, fit.light)
    on_skin = atlas.paint(np.ones(len(pixels), np.float32))
    reached = _reached(head, vertices, atlas)
    light, shelter = _held_light(shade, normals[:, 2], reached, head, atlas, FROM_JAW)
    shade = shade * shelter.reshape(-1)[atlas.index, None]
    albedo = atlas.paint(np.float32(reflectance(color, shade)))
    slant = atlas.paint(1 - visibility.weight(*GRAZING))
    weight = without_foreign(albedo, atlas.paint(weight), slant, head)
    weight = without_worse(weight, atlas.paint(visibility.cosine), inner_face(head, atlas.size))
    beard = bearded(albedo, weight, head)
    shadow = atlas.paint(bilinear(mattes.shadow, pixels)) * (1 - beard)
    middle = inner_face(head, atlas.size, MIDDLE)
    square = np.maximum(atlas.paint(visibility.weight(*SLANTING)), middle)
    plain = (1 - atlas.paint(bilinear(mattes.dark, pixels))) * (1 - beard)
    edge = penumbra(shadow, albedo, weight * plain)
    return PartialAlbedo(
        albedo,
        soften(weight * (1 - edge), on_skin),
        square * smoothstep(*SHADED[::-1], shadow) * on_skin,
        plain,
        light,
        atlas.paint(reached.everywhere, 1),
        on_skin,
    )


def without_worse(weight: np.ndarray, cosine: np.ndarray, face: np.ndarray) -> np.ndarray:
    """The weight [T, T] without what the other half of the face shows much better.

    On the far side of a nose a pixel is a long streak, and the nose's edge a dark line along its ridge.

    Args:
        weight: [T, T] 0..1.
        cosine: [T, T] between the skin and the line of sight.
        face: [T, T] 0..1, 1 well within the face.
    """
    worse = smoothstep(*BETTER, cosine[:, ::-1] - cosine) * smoothstep(*STREAKED, cosine) * face
    out: np.ndarray = weight * (1 - worse * weight[:, ::-1])
    return out


def up_to_hair(mattes: Mattes, head: HeadModel, atlas: Atlas, pixels: np.ndarray) -> np.ndarray:
    """What is dark by nature, brows above all, that counts however near hair hangs: [N] 0..1.

    Plain skin in the strip beside hair does not: strands of a fringe on it are lines on the forehead.

    Args:
        pixels: [N, 2], of the atlas.
    """
    face = uv_polygon(head, OVAL, UP_TO_HAIR, atlas.size)
    face = cv2.GaussianBlur(face, (0, 0), 1.5 * BLUR * atlas.size).reshape(-1)[atlas.index]
    bare = np.minimum(mattes.strip + mattes.shadow, 1) * mattes.dark * (1 - mattes.occluder)
    out: np.ndarray = bilinear(bare, pixels) * face
    return out


def inner_face(head: HeadModel, size: int, share: float = 0.75) -> np.ndarray:
    """1 well within the face's contour [T, T], 0 from the contour on; `share` is how much of it counts."""
    return sparse_blur(uv_polygon(head, OVAL, share, size), size / 50)


def bearded(albedo: np.ndarray, weight: np.ndarray, head: HeadModel) -> np.ndarray:
    """How surely a texel [T, T] 0..1 below the nose is dark hair: skin in shadow is as red as skin in light.

    Args:
        albedo: [T, T, 3] linear; weight: [T, T] 0..1.
    """
    size = len(albedo)
    below = np.arange(size) + 0.5 > size * head.landmark_uv()[NOSE_BASE, 1].mean()
    face = uv_polygon(head, OVAL, 1.1, size) > 0
    sure = (weight > 0.9) & face
    if not sure.any():
        return np.zeros_like(weight)
    blurred = np.log(np.maximum(normalized_blur(albedo, weight, 2 * BLUR * size), 1e-4))
    level, tint = blurred @ LUMA, blurred[..., 0] - blurred[..., 2]
    darker, paler = np.median(level[sure]) - level, np.median(tint[sure]) - tint
    hair = smoothstep(*HAIR_DARKER, darker) * smoothstep(*HAIR_PALER, paler)
    return np.float32(hair * below[:, None] * face * (weight > 0))


def without_foreign(
    albedo: np.ndarray, weight: np.ndarray, slant: np.ndarray, head: HeadModel
) -> np.ndarray:
    """The weight [T, T] without what is no skin of this face, though it was called skin.

    Beyond the face's contour, bits of collars, jewels and walls are left: they are less red than the
    face's skin, or islands. Light from behind glares on skin that is seen at a slant: it is whiter and
    lighter, and drawn out over the side of the face.

    Args:
        albedo: [T, T, 3] linear; weight: [T, T] 0..1.
        slant: [T, T] 0..1, 1 where the skin is seen at a slant.
    """
    size = len(albedo)
    face = uv_polygon(head, OVAL, 1.0, size) > 0
    sure = (weight > 0.9) & face
    if not sure.any():
        return weight
    blurred = cv2.GaussianBlur(albedo * weight[..., None], (0, 0), BLUR * size)
    tint = np.log(np.maximum(blurred[..., 0], 1e-4) / np.maximum(blurred[..., 2], 1e-4))
    level = np.log(np.maximum(normalized_blur(albedo @ LUMA, weight, BLUR * size), 1e-4))
    usual = np.median(tint[sure])
    white = smoothstep(*GLARE_PALER, usual - tint)
    white *= smoothstep(*GLARE_LIGHTER, level - np.median(level[sure]))
    weight = weight * (1 - cv2.dilate(np.float32(slant * white), np.ones((size // 100 | 1,) * 2)))
    pale = tint < usual - PALER
    pale = cv2.dilate((pale & (weight > 0)).astype(np.uint8), np.ones((size // 200 | 1,) * 2))
    out = np.where(face, weight, weight * (1 - pale))
    _, parts, sizes, _ = cv2.connectedComponentsWithStats((out > 0.5).astype(np.uint8))
    area = sizes[:, cv2.CC_STAT_AREA].astype(np.float64)
    area[0] = 0
    island = (area < ISLAND * area.max())[parts] & (parts > 0) & ~face
    return out * (1 - cv2.dilate(island.astype(np.uint8), np.ones((5, 5))))
