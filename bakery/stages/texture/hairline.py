"""The hair's layer on the skin beside hair with volume: its colours go on, and its hairline thins out."""

import cv2
import numpy as np
from scipy.spatial import cKDTree

from bakery.geometry import camera as cameras
from bakery.geometry.fill import normalized_blur, smoothstep
from bakery.geometry.mesh import vertex_normals
from bakery.geometry.sample import bilinear
from bakery.heads.base import HeadModel
from bakery.stages.atlas import make_atlas
from bakery.stages.texture.hair import locks, on_ears
from bakery.types import HAIR_KINDS, Camera, HairMesh

CAP = HAIR_KINDS.index("cap")
THINS = 9.0, 1.0  # mm from the cap, from which no hair grows, up to which all does
SIDE = 512  # texels a side at which distances are found
ALONG = 3  # points along an edge of the cap's triangles: 3 mm from one to the next
HAIRS = 0.8, 8.0  # mm, width and length
SOFT = 0.22  # share of the hairs that are half there
VARIED = 0.18  # log brightness by which hairs differ
UNSEEN = (
    0.0,
    0.12,
)  # cosine to the camera from which the photo shows skin beside hair, up to which none
GOES_ON = 45.0, 25.0  # mm from the cap, from which its colours do not go on, up to which they do
MOST = 1.5  # log by which a colour is changed at most
MIXED = 80  # share of the atlas over which the layer's own colour is taken
TONE = 40  # share of the cap's width over which its colour is taken


def in_tones_of(
    layer: np.ndarray, mesh: HairMesh | None, head: HeadModel, neutral: np.ndarray, camera: Camera
) -> np.ndarray:
    """The hair's layer [T, T, 4] in the colours of a mesh's cap nearby, where the photo sees the skin at a slant.

    Both are made up there, each from its own samples of the photo; where they meet, the difference shows.

    Args:
        layer: [T, T, 4] linear, colour multiplied by alpha.
        mesh: hair with volume of the same head; without a cap, or None, the layer comes back.
        head: as the person has it.
        neutral: [V, 3] mm.
        camera: the photo's.
    """
    cap = _cap(mesh)
    if cap is None:
        return layer
    points, tones = _sampled(mesh, cap)
    size = len(layer)
    small = make_atlas(head, min(SIDE, size)).take("skin")
    coarse = cv2.resize(np.float32(layer), (small.size,) * 2, interpolation=cv2.INTER_AREA)
    alpha = np.clip(coarse[..., 3], 0, 1)
    own = np.log(np.maximum(coarse[..., :3] / np.maximum(alpha, 1e-3)[..., None], 2e-3))
    own = normalized_blur(own, alpha, small.size / MIXED).reshape(-1, 3)[small.index]
    skin, normals = small.at(neutral), small.at(vertex_normals(neutral, head.faces))
    toward = cameras.position(camera) - skin
    lengths = np.linalg.norm(toward, axis=1) * np.linalg.norm(normals, axis=1)
    slant = 1 - smoothstep(*UNSEEN, (toward * normals).sum(1) / np.maximum(lengths, 1e-6))
    rows = np.flatnonzero((alpha.reshape(-1)[small.index] > 0.02) & (slant > 0))
    away, nearest = cKDTree(points).query(skin[rows], distance_upper_bound=GOES_ON[0])
    share = slant[rows] * smoothstep(*GOES_ON, np.minimum(away, GOES_ON[0]))
    change = np.zeros((len(skin), 3), np.float32)
    off = tones[np.minimum(nearest, len(tones) - 1)] - own[rows]
    change[rows] = share[:, None] * np.clip(off, -MOST, MOST)
    grid = cv2.GaussianBlur(small.paint(change), (0, 0), small.size / MIXED / 2)
    out = np.float32(layer)
    out[..., :3] *= np.exp(cv2.resize(grid, (size, size), interpolation=cv2.INTER_LINEAR))
    return out


def with_short_hair(
    layer: np.ndarray, mesh: HairMesh | None, head: HeadModel, neutral: np.ndarray
) -> np.ndarray:
    """The hair's layer [T, T, 4] with single short hairs on the skin around the cap of a mesh.

    What the layer shows already lies over them: the photo tells of its own hairline.

    Args:
        layer: [T, T, 4] linear, colour multiplied by alpha.
        mesh: hair with volume of the same head; without a cap, or None, the layer comes back.
        head: as the person has it.
        neutral: [V, 3] mm.
    """
    cap = _cap(mesh)
    if cap is None:
        return layer
    points, tones = _sampled(mesh, cap)
    size = len(layer)
    small = make_atlas(head, min(SIDE, size)).take("skin")
    away, nearest = cKDTree(points).query(small.at(neutral), distance_upper_bound=THINS[0])
    thick = smoothstep(*THINS, np.minimum(away, THINS[0]))
    thick *= 1 - on_ears(head, small)
    told = np.concatenate([tones[np.minimum(nearest, len(tones) - 1)], thick[:, None]], 1)
    grid = small.fill_gutter(small.paint(told.astype(np.float32)))
    grid = cv2.resize(grid, (size, size), interpolation=cv2.INTER_LINEAR)
    atlas = make_atlas(head, size).take("skin")
    rows = grid.reshape(-1, 4)[atlas.index]
    chosen = np.flatnonzero(rows[:, 3] > 0)
    rows, index = rows[chosen], atlas.index[chosen]
    noise = locks(head, atlas, *HAIRS)[chosen]
    rank = np.empty(len(noise), np.float32)  # of all hairs: so that a share of them is there
    rank[np.argsort(noise, kind="stable")] = np.linspace(0, 1, len(noise))
    least = 1 - (1 + SOFT) * rows[:, 3]
    out = layer.reshape(-1, 4).astype(np.float32)
    alpha = smoothstep(least, least + SOFT, rank) * (1 - out[index, 3])
    color = np.exp(rows[:, :3] + VARIED * (2 * rank[:, None] - 1))
    out[index] += np.concatenate([color, np.ones_like(color[:, :1])], 1) * alpha[:, None]
    return out.reshape(layer.shape)


def _cap(mesh):
    """The faces [m, 3] of a mesh's cap, None without any."""
    cap = None if mesh is None else mesh.faces[(mesh.kind == CAP) & mesh.shown(0)]
    return cap if cap is not None and len(cap) else None


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
