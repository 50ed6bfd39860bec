"""Hair with volume, made ready to be drawn: an opaque cap, and cards over it.

The cap is drawn with the head. Cards and fringe lie over both, from both sides, the farthest card
first: sorted for each view by the middle of the card. No player has a neck that stands still while the
head turns, so all hair turns with the head, whatever its `hang`.
"""

from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from bakery.geometry import rotation
from bakery.geometry.camera import project_camera, to_camera
from bakery.geometry.raster import rasterize
from bakery.geometry.sample import bilinear, interpolate
from bakery.memo import once_per_object
from bakery.runtime.cards import lay_faces, lay_picture
from bakery.types import HAIR_KINDS, HAIR_TRIANGLES, Camera, Fragments, HairMesh

CAP = HAIR_KINDS.index("cap")
FAINT = 1e-3  # alpha of a cap's texel below which it has no colour of its own


@dataclass(frozen=True, eq=False)
class HairCards:
    """The faces of one level of detail."""

    vertices: np.ndarray  # [N, 3] float32 mm
    normals: (
        np.ndarray
    )  # [N, 3] float32 unit: out of the hair as a whole, alike on both sides of a card
    cap: np.ndarray  # [C, 3] int32: each of its faces twice, for it is seen from both sides
    cap_uv: np.ndarray  # [C, 3, 2] float32
    cards: np.ndarray  # [F, 3] int32
    cards_uv: np.ndarray  # [F, 3, 2] float32
    number: np.ndarray  # [F] int64: which card, counted from 0 in the order of the faces
    middles: np.ndarray  # [K, 3] float64 mm: the mean of the corners of a card's faces
    texture: np.ndarray  # [S, S, 4] float32 linear, colour multiplied by alpha

    def order(self, camera: Camera) -> np.ndarray:
        """The faces of `cards` [F] as they are laid: the farthest card first."""
        toward = rotation.matrix(camera.rotation)[2]
        rank = np.empty(len(self.middles), np.int64)
        rank[np.argsort(self.middles @ toward, kind="stable")] = np.arange(len(rank))
        return np.argsort(rank[self.number], kind="stable")


def hair_cards(mesh: HairMesh | None, level: int = 0) -> HairCards:
    """The hair of a level of detail, 0 the finest, made once for each mesh; without one, none."""
    return NONE if mesh is None else _MADE[level](mesh)


def _make(level: int, mesh: HairMesh) -> HairCards:
    shown = mesh.shown(level)
    cap, cards = (np.flatnonzero(shown & kind) for kind in (mesh.kind == CAP, mesh.kind != CAP))
    cap = np.concatenate([cap, cap])
    corners = mesh.faces[cap]
    half = len(cap) // 2
    corners[half:] = corners[half:, ::-1]
    number = np.cumsum(np.diff(mesh.card[cards], prepend=mesh.card[cards[:1]]) != 0)
    middles = mesh.vertices[mesh.faces[cards]].astype(np.float64).mean(1)
    counts = np.bincount(number)
    sums = np.stack([np.bincount(number, middles[:, axis]) for axis in range(3)], 1)
    return HairCards(
        vertices=np.asarray(mesh.vertices, np.float32),
        normals=soft_normals(mesh),
        cap=corners,
        cap_uv=mesh.uv[corners],
        cards=mesh.faces[cards],
        cards_uv=mesh.uv[mesh.faces[cards]],
        number=number,
        middles=sums / np.maximum(counts, 1)[:, None],
        texture=np.asarray(mesh.texture, np.float32),
    )


_MADE = tuple(once_per_object(partial(_make, level)) for level in range(len(HAIR_TRIANGLES)))


def soft_normals(mesh: HairMesh) -> np.ndarray:
    """Normals [N, 3] float32 of the hair as a whole: away from a line that ends within the skull.

    Cards turn every way; a light that followed them would sparkle.
    """
    kept = mesh.vertices[mesh.faces[mesh.kind == CAP]].reshape(-1, 3)
    points = mesh.vertices.astype(np.float64)
    if not len(points):
        return np.zeros((0, 3), np.float32)
    kept = kept if len(kept) else points
    middle = (kept.min(0) + kept.max(0)) / 2
    foot = np.stack(
        np.broadcast_arrays(middle[0], np.minimum(points[:, 1], middle[1]), middle[2]), 1
    )
    away = points - foot
    length = np.linalg.norm(away, axis=1, keepdims=True)
    return np.where(length > 0, away / np.maximum(length, 1e-9), [0, 1, 0]).astype(np.float32)


def cap_color(texels: np.ndarray) -> np.ndarray:
    """The colour [..., 3] of an opaque cap: its texels [..., 4] without their alpha."""
    color: np.ndarray = texels[..., :3] / np.maximum(texels[..., 3:], np.float32(FAINT))
    return color


def paint_cap(
    color: np.ndarray,
    found: Fragments,
    first: int,
    uv: np.ndarray,
    hair: HairCards,
    shine: np.ndarray,
) -> None:
    """Colour what shows the cap.

    Args:
        color: [H, W, 3] float32 linear, changed.
        found: Fragments; the faces from `first` on are those of the cap.
        uv: [H, W, 2] float32.
        shine: [N, 3] float32: what the hair's colour is multiplied by at its vertices.
    """
    mine = found.face >= first
    if not mine.any():
        return
    corners = hair.cap[found.face[mine] - first]
    here = np.einsum("nkc,nk->nc", shine[corners], found.barycentric[mine])
    color[mine] = here * cap_color(bilinear(hair.texture, uv[mine] * len(hair.texture)))


def hair_layer(
    color: np.ndarray,
    capped: np.ndarray,
    depth: np.ndarray,
    camera: Camera,
    pixels: np.ndarray,
    distance: np.ndarray,
    hair: HairCards,
    shine: np.ndarray,
) -> np.ndarray:
    """Cap, cards and fringe as a picture of their own.

    Args:
        color: [H, W, 3] float32 linear; capped: [H, W] bool, where it shows the cap.
        depth: [H, W] mm of what is nearest, inf for nothing.
        pixels: [N, 2], distance: [N] mm in front of the camera: of the hair's vertices.
        shine: [N, 3] float32, as for `paint_cap`.

    Returns:
        [H, W, 4] float32 linear, premultiplied.
    """
    own, alpha = color * capped[..., None], capped.astype(np.float32)
    order = hair.order(camera)
    corners = hair.cards[order]
    share = np.concatenate([shine, np.ones_like(shine[:, :1])], 1)[corners]
    lay_faces(
        own, alpha, np.zeros_like(alpha), depth, pixels[corners], distance[corners],
        hair.cards_uv[order].astype(np.float64), hair.texture, share,
    )  # fmt: skip
    return np.dstack([own, alpha])


def over_picture(
    picture: np.ndarray, depth: np.ndarray, camera: Camera, mesh: HairMesh | None
) -> np.ndarray:
    """A picture of a head with its hair drawn over it, at one sample a pixel.

    Args:
        picture: [H, W, 3] float32 linear; depth: [H, W] mm in front of the camera, inf for nothing.
        camera: of the picture.
        mesh: the hair; None if there is none.

    Returns:
        [H, W, 3] float32 linear.
    """
    hair = hair_cards(mesh)
    color, depth = np.array(picture, np.float32), np.asarray(depth, np.float32)
    if not len(hair.vertices):
        return color
    points = to_camera(hair.vertices, camera)
    pixels, distance = project_camera(points, camera), -points[:, 2]
    found = rasterize(pixels, distance, hair.cap, depth.shape, cull=True)
    capped = (found.face >= 0) & (found.depth < depth)
    nearest = replace(found, face=np.where(capped, found.face, -1))
    shine = np.ones_like(hair.vertices)
    paint_cap(color, nearest, 0, interpolate(nearest, hair.cap_uv), hair, shine)
    depth = np.where(capped, found.depth, depth)
    own = hair_layer(color, capped, depth, camera, pixels, distance, hair, shine)
    lay_picture(color, np.ones_like(depth), own)
    return color


def _none() -> HairCards:
    """No hair: nothing to draw, and no case of its own."""
    bare = HairMesh(
        vertices=np.zeros((0, 3), np.float32), faces=np.zeros((0, 3), np.int32),
        uv=np.zeros((0, 2), np.float32), kind=np.zeros(0, np.uint8), card=np.zeros(0, np.int32),
        levels=np.zeros(0, np.uint8), hang=np.zeros(0, np.float32),
        texture=np.zeros((1, 1, 4), np.float16), direction=np.zeros((1, 1, 2), np.float16),
        root_to_tip=np.zeros((1, 1), np.float16), source=np.zeros((1, 1), np.uint8),
    )  # fmt: skip
    return _make(0, bare)


NONE = _none()
