"""What a head shows in light of its own: albedo, roughness, and the relief of its skin as a normal map.

The relief is read from the skin's own fine shades: what is darker than the skin around it lies
deeper. Source: Beeler et al. 2010, "High-quality single-shot capture of facial geometry", section 5,
without its refinement of the mesh.
"""

import cv2
import numpy as np

from bakery.errors import BundleError
from bakery.export.materials import Lit
from bakery.export.mouth import mouth_light
from bakery.export.web.files import small_picture
from bakery.formats import image
from bakery.geometry.color import LUMA
from bakery.geometry.fill import normalized_blur, smoothstep, soft_limit
from bakery.geometry.mesh import vertex_normals
from bakery.heads.base import HeadModel
from bakery.landmarks import BROW_LEFT, BROW_RIGHT, EYES, LIPS_INNER, LIPS_OUTER
from bakery.runtime.avatar import Avatar
from bakery.runtime.blend import lay_hair
from bakery.runtime.relight import unlit
from bakery.stages.atlas import make_atlas, uv_polygon

QUALITY = 95  # of JPEG
FINE = 1 / 170  # of the atlas's side: relief is finer, tone is wider; 3 mm of the face
DEPTH = 0.35  # mm that skin lies deeper where it is darker by a factor of e; pores come to 0.02 mm
DARKEST = 0.35  # of that; darker than so is a mole or a hair
EDGE = 1 / 130  # of the side: over which relief fades beside what is no bare skin
SMOOTH = ((EYES[0], 1.35), (EYES[1], 1.35), (LIPS_INNER, 1.2), (BROW_LEFT, 1.4), (BROW_RIGHT, 1.4))
# Roughness as glTF has it, by eye; skin's microfacet slope of about 0.3 is 0.55 (Weyrich et al. 2006).
SKIN, LIPS, HAIR = 0.55, 0.4, 0.65
OILY = {4: 0.13, 151: 0.09, 9: 0.07, 205: 0.05, 425: 0.05, 199: 0.06}  # landmark -> less rough by
WIDE = 0.045  # of the side: how far that reaches


def lit_pictures(avatar: Avatar, size: int) -> Lit:
    """The pictures of an avatar.

    Args:
        size: texels on a side, at most.

    Raises:
        BundleError: a bundle without albedo.
    """
    textures, head = avatar.textures, avatar.head
    if not len(textures.albedo):
        raise BundleError(
            "lit materials need the albedo, which bundles of version 1.0 lack; bake the photo again"
        )
    bare = textures.albedo * mouth_light(head, avatar.neutral, len(textures.albedo))
    hair = np.array(textures.hair, np.float32)
    # Skin beside hair is part of the layer; hair itself keeps the photo's light, as its mesh does.
    light = unlit(avatar)
    hair[..., :3] *= 1 + light.strip[..., None] * (light.skin - 1)
    color = small_picture(lay_hair(bare, hair), size)
    size = min(size, len(textures.neutral))
    covered = _shrunk(np.asarray(textures.hair[..., 3], np.float32), size)
    rough = roughness(head, covered)
    height = relief(head, _shrunk(np.asarray(textures.neutral, np.float32), size), covered)
    normal = relief_normals(head, avatar.neutral, height)
    packed = np.stack([np.ones_like(rough), rough, np.zeros_like(rough)], -1)
    return Lit(
        color=image.encode_image(color, ".jpg", QUALITY),
        roughness=image.encode_image(_shrunk(packed, size // 2), ".jpg", QUALITY),
        normal=image.encode_image((normal + 1) / 2, ".png"),
    )


def roughness(head: HeadModel, covered: np.ndarray) -> np.ndarray:
    """Roughness [T, T] float32 0..1 of the skin.

    Args:
        covered: [T, T] 0..1, how much hair lies on the skin.
    """
    size = len(covered)
    places = head.landmark_uv() * size
    row, column = np.mgrid[:size, :size].astype(np.float32)
    out = np.full((size, size), SKIN, np.float32)
    for mark, less in OILY.items():
        apart = (column - places[mark, 0]) ** 2 + (row - places[mark, 1]) ** 2
        out -= less * np.exp(-apart / (WIDE * size) ** 2)
    lips = cv2.GaussianBlur(uv_polygon(head, LIPS_OUTER, 1.0, size), (0, 0), EDGE * size)
    out += (LIPS - out) * lips
    return out + (HAIR - out) * np.clip(covered, 0, 1)


def relief(head: HeadModel, texture: np.ndarray, covered: np.ndarray) -> np.ndarray:
    """How much higher than its surroundings skin stands: [T, T] float32 mm, 0 off bare skin.

    Args:
        texture: [T, T, 3] linear, T_0.
        covered: [T, T] 0..1, how much hair lies on the skin.
    """
    size = len(texture)
    atlas = make_atlas(head, size).take("skin")
    bare = atlas.paint(np.ones(len(atlas.index), np.float32))
    for ring, wide in SMOOTH:
        bare *= 1 - uv_polygon(head, ring, wide, size)
    bare *= covered < 0.1
    radius = max(round(2 * EDGE * size), 1)
    inside = cv2.erode(bare, np.ones((2 * radius + 1,) * 2), borderValue=0)
    fade = smoothstep(0, 1, cv2.GaussianBlur(inside, (0, 0), EDGE * size)) * bare
    shade = np.log(np.maximum(texture @ LUMA, 1e-3)).astype(np.float32)
    above = shade - normalized_blur(shade, np.maximum(bare, 1e-6), FINE * size)
    return (DEPTH * soft_limit(above, DARKEST) * fade).astype(np.float32)


def relief_normals(head: HeadModel, neutral: np.ndarray, height: np.ndarray) -> np.ndarray:
    """A relief as unit normals [T, T, 3] float32 in the tangent space of the atlas.

    x goes along u, y against v (up in the picture), z along the normal of the mesh.

    Args:
        neutral: [V, 3] mm, the surface that the relief stands on.
        height: [T, T] mm.
    """
    size = len(height)
    atlas = make_atlas(head, size).take("skin")
    inside = atlas.paint(np.ones(len(atlas.index), np.uint8))
    inside = cv2.erode(inside, np.ones((3, 3), np.uint8), borderValue=0) > 0
    place = atlas.paint(atlas.at(neutral))
    along_v, along_u = np.gradient(place, axis=(0, 1))  # [T, T, 3] mm a texel
    up = atlas.paint(atlas.at(vertex_normals(neutral, head.faces)))
    along_u -= (along_u * up).sum(2, keepdims=True) * up
    step = np.maximum(np.linalg.norm(along_u, axis=2), 1e-3)
    tangent = along_u / step[..., None]
    slant = (along_v * tangent).sum(2)
    across = np.maximum(np.linalg.norm(along_v - slant[..., None] * tangent, axis=2), 1e-3)
    rise_v, rise_u = np.gradient(height)
    x = -rise_u / step
    y = (rise_v + slant * x) / across
    out = np.stack([x, y, np.ones_like(x)], -1)
    out[~inside] = 0, 0, 1
    out /= np.linalg.norm(out, axis=2, keepdims=True)
    return out.astype(np.float32)


def _shrunk(picture, size):
    if len(picture) <= size:
        return picture
    return cv2.resize(picture, (size, size), interpolation=cv2.INTER_AREA)
