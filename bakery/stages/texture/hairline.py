"""The hair's layer on the skin beside hair with volume: its colours go on, and its hairline thins out."""

from dataclasses import dataclass

import cv2
import numpy as np
from scipy.spatial import cKDTree

from bakery.geometry import camera as cameras
from bakery.geometry.fill import normalized_blur, smoothstep
from bakery.geometry.mesh import vertex_normals
from bakery.geometry.sample import bilinear
from bakery.heads.base import HeadModel
from bakery.stages.atlas import Atlas, make_atlas
from bakery.stages.texture.growth import before_ears, beside_scalp, growth_on, on_ears
from bakery.stages.texture.hair import HAIRS, locks, ranked, single_hairs, strands
from bakery.types import HAIR_KINDS, Camera, HairMesh

CAP = HAIR_KINDS.index("cap")
THINS = 9.0, 1.0  # mm from the cap, from which no hair grows, up to which all does
SIDE = 512  # texels a side at which distances are found
ALONG = 3  # points along an edge of the cap's triangles: 3 mm from one to the next
VARIED = 0.18  # log brightness by which hairs differ
UNSEEN = 0.0, 0.12  # cosine to the camera up to which the photo shows no skin beside hair, and all
GOES_ON = 45.0, 25.0  # mm from the cap, from which its colours do not go on, up to which they do
MOST = 1.5  # log by which a colour is changed at most
MIXED = 80  # share of the atlas over which the layer's own colour is taken
TONE = 40  # share of the cap's width over which its colour is taken


@dataclass(frozen=True, eq=False)
class Cap:
    """The cap of a mesh, sampled, and a coarse atlas of the head's skin below and around it."""

    points: cKDTree  # of [n, 3] mm all over the cap
    tones: np.ndarray  # [n, 3] log colour of the hair around them
    atlas: Atlas
    skin: np.ndarray  # [m, 3] mm, at the atlas's texels

    def nearest(self, skin: np.ndarray, most: float) -> tuple[np.ndarray, np.ndarray]:
        """How far the cap is from places [k, 3], up to `most` [k] mm, and its tones there [k, 3]."""
        away, nearest = self.points.query(skin, distance_upper_bound=most)
        return np.minimum(away, most), self.tones[np.minimum(nearest, len(self.tones) - 1)]


def cap_of(
    mesh: HairMesh | None, head: HeadModel, neutral: np.ndarray, size: int = SIDE
) -> Cap | None:
    """The cap of a mesh; None without any.

    Args:
        mesh: hair with volume of the same head.
        head: as the person has it.
        neutral: [V, 3] mm.
        size: of the texture; the coarse atlas has SIDE texels a side at most.
    """
    faces = None if mesh is None else mesh.faces[(mesh.kind == CAP) & mesh.shown(0)]
    if faces is None or not len(faces):
        return None
    points, tones = _sampled(mesh, faces)
    atlas = make_atlas(head, min(SIDE, size)).take("skin")
    return Cap(cKDTree(points), tones, atlas, atlas.at(neutral))


def beside_mesh(
    layer: np.ndarray, mesh: HairMesh | None, head: HeadModel, neutral: np.ndarray, camera: Camera
) -> np.ndarray:
    """The hair's layer [T, T, 4] as it goes with a mesh: in its tones, with short hairs around it.

    Args:
        layer: [T, T, 4] linear, colour multiplied by alpha.
        mesh: hair with volume of the same head; without a cap, or None, the layer comes back.
        head: as the person has it.
        neutral: [V, 3] mm.
        camera: the photo's.
    """
    cap = cap_of(mesh, head, neutral, len(layer))
    if cap is None:
        return layer
    normals = cap.atlas.at(vertex_normals(neutral, head.faces))
    return with_short_hair(in_tones_of(layer, cap, normals, camera), cap, head)


def in_tones_of(layer: np.ndarray, cap: Cap, normals: np.ndarray, camera: Camera) -> np.ndarray:
    """The hair's layer [T, T, 4] in the tones of the cap nearby, where the photo sees the skin at a slant.

    Both are made up there, each from its own samples of the photo; where they meet, the difference shows.

    Args:
        normals: [m, 3] of the skin at the texels of the cap's atlas.
        camera: the photo's.
    """
    size, small = len(layer), cap.atlas
    out = layer.astype(np.float32)
    coarse = cv2.resize(out, (small.size,) * 2, interpolation=cv2.INTER_AREA)
    alpha = np.clip(coarse[..., 3], 0, 1)
    own = np.log(np.maximum(coarse[..., :3] / np.maximum(alpha, 1e-3)[..., None], 2e-3))
    own = normalized_blur(own, alpha, small.size / MIXED).reshape(-1, 3)[small.index]
    slant = 1 - smoothstep(*UNSEEN, cameras.facing(cap.skin, normals, camera))
    rows = np.flatnonzero((alpha.reshape(-1)[small.index] > 0.02) & (slant > 0))
    away, tones = cap.nearest(cap.skin[rows], GOES_ON[0])
    share = slant[rows] * smoothstep(*GOES_ON, away)
    change = np.zeros((len(cap.skin), 3), np.float32)
    change[rows] = share[:, None] * np.clip(tones - own[rows], -MOST, MOST)
    grid = cv2.GaussianBlur(small.paint(change), (0, 0), small.size / MIXED / 2)
    out[..., :3] *= np.exp(cv2.resize(grid, (size, size), interpolation=cv2.INTER_LINEAR))
    return out


def with_short_hair(layer: np.ndarray, cap: Cap, head: HeadModel) -> np.ndarray:
    """The hair's layer [T, T, 4] with single short hairs on the skin around the cap of a mesh.

    What the layer shows already lies over them: the photo tells of its own hairline.
    """
    size, small = len(layer), cap.atlas
    away, tones = cap.nearest(cap.skin, THINS[0])
    grows = np.maximum(beside_scalp(growth_on(head, small)), before_ears(head, small))
    grows = grows.reshape(-1)[small.index]  # what hangs beside cheeks does not grow out of them
    thick = smoothstep(*THINS, away) * (1 - on_ears(head, small)) * grows
    told = np.concatenate([tones, thick[:, None]], 1)
    grid = small.fill_gutter(small.paint(told.astype(np.float32)))
    grid = cv2.resize(grid, (size, size), interpolation=cv2.INTER_LINEAR)
    atlas = make_atlas(head, size).take("skin")
    rows = grid.reshape(-1, 4)[atlas.index]
    chosen = np.flatnonzero(rows[:, 3] > 0)
    rows, index = rows[chosen], atlas.index[chosen]
    rank = ranked(locks(strands(head, atlas)[chosen], *HAIRS))
    out = layer.reshape(-1, 4).astype(np.float32)
    alpha = single_hairs(rows[:, 3], rank) * (1 - out[index, 3])
    color = np.exp(rows[:, :3] + VARIED * (2 * rank[:, None] - 1))
    out[index] += np.concatenate([color, np.ones_like(color[:, :1])], 1) * alpha[:, None]
    return out.reshape(layer.shape)


def _sampled(mesh, cap):
    """Points [n, 3] mm all over the cap's faces [m, 3], and the log colour [n, 3] of the hair around."""
    a, b = (x.ravel() for x in np.mgrid[: ALONG + 1, : ALONG + 1])
    inside = a + b <= ALONG
    weights = np.stack([a, b, ALONG - a - b], -1)[inside] / ALONG
    points, uv = (
        np.einsum("kc,ncd->nkd", weights, each[cap]).reshape(-1, each.shape[1])
        for each in (mesh.vertices, mesh.uv)
    )
    side = len(mesh.texture)
    lowest = int(np.ceil(uv[:, 1].max() * side)) + 1  # cards lie below
    texture = np.float32(mesh.texture[:lowest])
    colors = np.log(np.maximum(texture[..., :3], 2e-3))
    known = (texture[..., 3] > 0.5).astype(np.float32)
    return points, bilinear(normalized_blur(colors, known, side / TONE), uv * side)
