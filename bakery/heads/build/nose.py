"""The tip of the nose, the nostrils and the columella, where photographs have them.

The search for the head's landmarks begins with landmark 1 on the foremost point of the nose
(`heads.embed.START`). On faces that is landmark 4, some 6 mm above, and the pitch of all fits made up for
it. In photographs of 14 people the nostrils lie at -36.6 mm (median; -36.4 in the mean colours of the
people that the skin database was learned of), and on the head they lay at -40.4: they were painted beside
the tip, and the lip's skin on the columella.
"""

from dataclasses import replace

import cv2
import numpy as np

from bakery.geometry.fill import diffuse, normalized_blur, smoothstep
from bakery.geometry.mesh import vertex_normals
from bakery.geometry.raster import rasterize
from bakery.geometry.sample import bilinear, interpolate
from bakery.heads.base import PARTS
from bakery.heads.build.wheel import Raw
from bakery.heads.patch import Patch

LIFT = 3.2  # mm at the midline
ACROSS = (19.0, 2.0)  # mm from the midline, where it ends, and up to which it is whole
ABOVE, BELOW = (30.0, 4.0), (-19.0, -10.5)  # mm over the tip, the same
BRIDGE = 2.5  # mm by which the bridge comes forward at most
BRIDGE_ACROSS = (11.0, 2.0)  # mm, as ACROSS
BRIDGE_UP = 26.0, 7.0  # mm over the tip: where it does most, and its standard deviation
PER_MM = 12  # pixels of the picture in which the surface is looked up
HOLE = 3.0  # mm that a place lies behind those around: the inside of a nostril
AROUND = 6.0  # mm, how wide a nostril is at most
REACH = 34.0  # mm around the tip that the picture holds
ATLAS = 1024  # texels on a side
# Widths of the blurs of the move on the atlas, texels: each turn makes up for what the last one left.
SMOOTH = 14.0, 12.0, 10.0, 8.0
FACING, NEAR = 0.25, 0.7  # cosine, and mm: a vertex that the front shows


def with_lifted_nose(raw: Raw) -> Raw:
    """The control mesh with the lower end of its nose lifted, and a straight ridge."""
    skin = np.unique(raw.quads[raw.parts == "skin"])
    mean = raw.mean.copy()
    tip = tip_of(mean[skin])
    mean[skin, 2] += bridge_at(mean[skin], tip)
    mean[skin, 1] += lift_at(mean[skin], tip)
    return replace(raw, mean=mean)


def tip_of(places: np.ndarray) -> np.ndarray:
    """The foremost place [3] in the middle of a face's skin [N, 3] mm."""
    middle = places[np.abs(places[:, 0]) < 4]
    out: np.ndarray = middle[middle[:, 2].argmax()]
    return out


def lift_at(places: np.ndarray, tip: np.ndarray) -> np.ndarray:
    """How far places [N, 3] mm around a nose with this tip [3] go up, [N] mm; 0 behind the face."""
    x, y, z = (places - tip).T
    share = smoothstep(*ACROSS, np.abs(x)) * smoothstep(*ABOVE, y) * smoothstep(*BELOW, y)
    out: np.ndarray = LIFT * share * (z > -40)
    return out


def bridge_at(places: np.ndarray, tip: np.ndarray) -> np.ndarray:
    """How far places [N, 3] mm around a nose with this tip [3] come forward, [N] mm."""
    x, y, z = (places - tip).T
    middle, width = BRIDGE_UP
    share = smoothstep(*BRIDGE_ACROSS, np.abs(x)) * np.exp(-(((y - middle) / width) ** 2) / 2)
    out: np.ndarray = BRIDGE * share * (z > -40)
    return out


def moved_uv(hanging: Patch, lifted: np.ndarray) -> np.ndarray:
    """The uv [U, 2] of a head's flesh whose vertices move to `lifted` [V, 3] mm.

    What moves on the surface moves on the atlas as well: a texel stays in front of the same place as
    seen from the front, and textures that were learned on the atlas stay in register.
    """
    faces = np.flatnonzero(hanging.parts == PARTS.index("skin"))
    corners = np.unique(hanging.uv_faces[faces])
    vertex = np.zeros(len(hanging.uv), int)
    vertex[hanging.uv_faces[faces]] = hanging.faces[faces]
    lift = lifted[:, 1] - hanging.mean[:, 1]
    tip = tip_of(hanging.mean[vertex[corners]])
    picture, known = _front_view(hanging, faces, tip)
    moved = corners[lift[vertex[corners]] > 1e-3]
    here = hanging.mean[vertex[moved]]
    there = here + np.stack([0 * here[:, 0], lift[vertex[moved]], 0 * here[:, 0]], 1)
    now = _look_up(picture, here, tip)
    wanted = hanging.uv[moved] + (_look_up(picture, there, tip) - now)[:, :2]
    facing = vertex_normals(hanging.mean, hanging.faces[faces])[vertex[moved], 2] > FACING
    seen = (
        facing & (np.abs(now[:, 2] - here[:, 2]) < NEAR) & (_look_up(known, here, tip)[:, 0] > 0.9)
    )
    told, goal = np.setdiff1d(corners, moved[~seen]), hanging.uv.astype(float)
    goal[moved] = wanted
    uv = hanging.uv.astype(float)
    for smooth in SMOOTH:
        field = _smooth_field(uv[told], goal[told] - uv[told], smooth)
        uv[moved] += bilinear(field, uv[moved] * ATLAS)
    return uv


def _smooth_field(places: np.ndarray, values: np.ndarray, width: float) -> np.ndarray:
    """Values [N, 2] at places [N, 2] of the atlas, between them and smooth: [S, S, 2]."""
    size = ATLAS
    column, row = np.clip((places * size).astype(int), 0, size - 1).T
    total, count = np.zeros((size, size, 2), np.float32), np.zeros((size, size), np.float32)
    np.add.at(total, (row, column), values)
    np.add.at(count, (row, column), 1)
    mean = total / np.maximum(count, 1)[..., None]
    weight = np.minimum(count, 1)
    near = normalized_blur(mean, weight, width)
    # Beyond the reach of that blur, in the middle of a nostril: from its rim.
    return diffuse(near, np.minimum(1, cv2.GaussianBlur(weight, (0, 0), width) * 50))


def _front_view(head: Patch, faces, tip):
    """uv and depth of the face's surface as the front sees it [S, S, 3], and where nostrils do not hide it."""
    size = int(2 * REACH * PER_MM)
    pixels = (head.mean[:, :2] - tip[:2]) * [PER_MM, -PER_MM] + size / 2
    found = rasterize(pixels, 500 - head.mean[:, 2], head.faces[faces], (size, size), cull=True)
    uv = interpolate(found, head.uv[head.uv_faces[faces]].astype(np.float32))
    depth = np.where(found.face >= 0, 500 - found.depth, 0).astype(np.float32)
    width = int(AROUND * PER_MM) | 1
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (width, width))
    known = (cv2.morphologyEx(depth, cv2.MORPH_CLOSE, disc) - depth < HOLE) & (found.face >= 0)
    known = cv2.erode(np.float32(known), np.ones((5, 5)))
    picture = np.concatenate([uv, depth[..., None]], 2)
    return diffuse(np.where(known[..., None] > 0, picture, 0), known), known


def _look_up(picture, places, tip):
    """Values [N, C] of a picture from `_front_view` at places [N, 3] mm."""
    pixels = (places[:, :2] - tip[:2]) * [PER_MM, -PER_MM] + len(picture) / 2 - 0.5
    out = cv2.remap(picture, np.float32(pixels[:, None]), None, cv2.INTER_LINEAR)
    return out.reshape(len(places), -1)
