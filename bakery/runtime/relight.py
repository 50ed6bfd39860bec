"""An avatar in another light: what its photo's light did is taken back, the new light done instead."""

from dataclasses import dataclass

import numpy as np

from bakery.geometry import harmonics, rotation
from bakery.geometry.color import LUMA
from bakery.geometry.fill import smoothstep
from bakery.geometry.mesh import vertex_normals
from bakery.heads.base import PARTS
from bakery.memo import once_per_object
from bakery.runtime.avatar import Avatar
from bakery.runtime.blend import lay_hair
from bakery.stages.atlas import make_atlas
from bakery.stages.texture.unwrap import photo_shade, shading
from bakery.types import Fragments

LEAST = 0.02  # of a light's mean: second-order harmonics swing below 0 behind a narrow lamp
DARKEST, BRIGHTEST = 1e-3, 50.0  # of a texel that is divided by, and of what comes of it
ALIKE = (0.5, 0.2)  # of log colour, between a hair layer and the skin below: hair, and skin
PHOTOGRAPHED = (1, 2)  # codes of coverage.exr by which the exposure is measured


@dataclass(frozen=True, eq=False)
class Unlit:
    """What takes the photo's light off an avatar's textures."""

    skin: np.ndarray  # [T, T, 3] float32, times a face texture
    hair: np.ndarray  # [T, T, 3] float32, times the hair layer, which shows skin too, beside hair
    strip: np.ndarray  # [T, T] float32 0..1, how surely the hair layer shows skin
    white: np.ndarray  # [3] what takes the colour of the photo's light off the rest
    exposure: float  # by which a light of mean 1 gives the face the photo's mean level


@once_per_object
def unlit(avatar: Avatar) -> Unlit:
    """`Unlit` of an avatar, found once; bundles without albedo keep highlights and the light's colour."""
    textures, size = avatar.textures, avatar.textures.neutral.shape[0]
    atlas = make_atlas(avatar.head, size).take("skin")
    shade = atlas.paint(photo_shade(avatar.fit, avatar.head, posed(avatar), atlas), 1)
    shade = atlas.fill_gutter(shade.astype(np.float32))
    texture = np.asarray(textures.neutral, np.float32)
    on_skin = atlas.paint(np.ones(len(atlas.index), bool))
    seen = on_skin & np.isin(textures.source, PHOTOGRAPHED)
    skin, white = 1 / shade, np.ones(3, np.float32)
    if len(textures.albedo):
        bare = np.asarray(textures.albedo, np.float32) / np.maximum(texture, DARKEST)
        white = np.median((bare * shade)[seen], 0) if seen.any() else white
        inside = atlas.fill_gutter(on_skin.astype(np.float32))[..., None] > 0
        skin = np.where(inside, np.clip(bare, 0, BRIGHTEST), skin * white)
    level, bare_level = ((texture * gain)[seen] @ LUMA for gain in (np.float32(1), skin))
    exposure = float(level.mean() / max(bare_level.mean(), 1e-6)) if seen.any() else 1.0
    hair, strip = white / shade, _shows_skin(textures.hair, texture)
    hair = hair + strip[..., None] * (skin - hair)
    return Unlit(skin.astype(np.float32), hair.astype(np.float32), strip, white, exposure)


def _shows_skin(layer: np.ndarray, texture: np.ndarray) -> np.ndarray:
    """How surely a hair layer [T, T, 4] shows skin: [T, T] 0..1, by the skin [T, T, 3] that it lies on."""
    layer = np.asarray(layer, np.float32)
    shown = layer[..., :3] / np.maximum(layer[..., 3:], DARKEST)
    apart = np.abs(np.log(np.maximum(shown, DARKEST) / np.maximum(texture, DARKEST))).max(-1)
    found: np.ndarray = smoothstep(*ALIKE, apart)
    return found


def skin_without(avatar: Avatar, skin: np.ndarray, hair: np.ndarray | None) -> np.ndarray:
    """A face texture [T, T, 3] with the hair layer [T, T, 4] over it, both without the photo's light."""
    bare = unlit(avatar)
    skin = skin * bare.skin
    if hair is None:
        return skin
    hair = np.asarray(hair, np.float32)
    return lay_hair(skin, np.dstack([hair[..., :3] * bare.hair, hair[..., 3:]]))


def relit(
    avatar: Avatar,
    color: np.ndarray,
    found: Fragments,
    faces: np.ndarray,
    vertices: np.ndarray,
    light: np.ndarray,
) -> np.ndarray:
    """A drawn picture in another light.

    Args:
        avatar: whose photo's light is on eyes and mouth.
        color: [H, W, 3] float32 linear: skin without its light, eyes and mouth with it.
        found: Fragments; faces: [n] those of the head that they number.
        vertices: [V, 3] mm as drawn.
        light: [9, 3] of mean 1, head space: it stays where it is when the camera goes round.

    Returns:
        [H, W, 3] float32 linear.
    """
    head, hit = avatar.head, found.face >= 0
    face = faces[found.face[hit]]
    corners, weight = head.faces[face], found.barycentric[hit]

    def at(normals: np.ndarray) -> np.ndarray:
        inside: np.ndarray = np.einsum("nkc,nk->nc", normals[corners], weight)
        inside /= np.maximum(np.linalg.norm(inside, axis=1, keepdims=True), 1e-6)
        return inside

    turn = rotation.matrix(avatar.fit.camera.rotation)
    photographed = vertex_normals(posed(avatar), head.faces) @ turn.T
    was = shading(at(photographed), avatar.fit.light)
    on_skin = head.face_part[face] == PARTS.index("skin")
    now = shine(at(vertex_normals(vertices, head.faces)), light)
    out: np.ndarray = color.copy()
    bare = unlit(avatar)
    out[hit] *= bare.exposure * now * np.where(on_skin[:, None], 1, bare.white / was)
    return out


def hair_shine(avatar: Avatar, normals: np.ndarray, light: np.ndarray) -> np.ndarray:
    """What the hair of the photo is multiplied by to stand in another light.

    Args:
        normals: [N, 3] unit, head space.
        light: [9, 3] as for `relit`.

    Returns:
        [N, 3] float32.
    """
    bare = unlit(avatar)
    turn = rotation.matrix(avatar.fit.camera.rotation)
    was = shading(normals @ turn.T, avatar.fit.light)
    factor: np.ndarray = bare.exposure * shine(normals, light) * bare.white / was
    return factor.astype(np.float32)


def posed(avatar: Avatar) -> np.ndarray:
    """The head [V, 3] mm as it stands in the photo."""
    fit = avatar.fit
    vertices: np.ndarray = avatar.head.vertices(avatar.neutral, fit.expression, fit.gaze)
    return vertices


def shine(normals: np.ndarray, light: np.ndarray) -> np.ndarray:
    """What a light [9, 3] of mean 1 shows at unit normals [N, 3]: [N, 3], never black."""
    found: np.ndarray = np.maximum(harmonics.irradiance(normals, light), LEAST)
    return found.astype(np.float32)
