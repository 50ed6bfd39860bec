"""Which folds an expression is expected to bring, as channels for the network.

Where folds form is anatomy, how deep is tension (`folds`); what one person has is not known before it
shows. The mean over people of all ages is: a height, and how it would shade in the light of the photo.
What is made of it the network says, which has seen the photo. Drawn over the triangles of the landmarks,
as strain is. Whoever changes the lines of `fold_lines` changes what shipped weights were trained on.
"""

from dataclasses import dataclass, field

import numba
import numpy as np

from bakery.generators.folds import Folds, joined, make_folds
from bakery.generators.strain import landmark_faces
from bakery.geometry import harmonics
from bakery.geometry.color import LUMA
from bakery.geometry.mesh import vertex_normals
from bakery.geometry.raster import rasterize
from bakery.geometry.sample import bilinear, interpolate
from bakery.heads.base import once_a_mean
from bakery.landmarks import FACE
from bakery.parallel import side_by_side

CHANNELS = 2  # height, and log of its shading
FULL = np.array([0.8, 0.5], np.float32)  # mm, and log-ratio, that a byte reaches
AGES = tuple(range(20, 80, 5))  # years, of those whose mean is taken
TEXELS = 384  # a side of the map
REACH = 30.0  # mm from the nearest landmark to where folds are kept
DARK = 0.05  # least light that a slope's change is divided by


@dataclass(frozen=True, eq=False)
class _Mean:
    """The folds of a mean head, as many people have them."""

    index: np.ndarray  # [N] flat texel numbers of the face
    corners: np.ndarray | None  # [N, 3] vertices around the texels; None for a piece of a head
    folds: Folds
    shine: np.ndarray  # [N, 9] spherical harmonics at the texels' normals
    bent: np.ndarray  # [N, 2, 9] their change for a slope of 1 mm a texel along u and along v
    seen: dict = field(default_factory=dict)  # what was asked of `lit` last

    def lit(self, light):
        """Log of the shading [N, 2] that a slope along u and along v makes in a light [9]."""
        key = light.tobytes()
        kept = self.seen.get(key)
        if kept is None:
            kept = (self.bent @ light) / np.maximum(self.shine @ light, DARK)[:, None]
            self.seen.clear()  # one bake has one light
            self.seen[key] = kept = kept.astype(np.float32)
        return kept

    def cut(self, vertices):
        """That of a piece of the head, which has some of the vertices [v]."""
        rows = np.flatnonzero(np.isin(self.corners, vertices).all(1))
        folds = self.folds.cut(rows, vertices)
        return _Mean(self.index[rows], None, folds, self.shine[rows], self.bent[rows])


def fold_channels(head, expression, light, found):
    """Expected height and log-shading of folds: [H, W, 2] uint8, 128 where there are none.

    Args:
        head: HeadModel.
        expression: [E] weights.
        light: [9, 3] irradiance in head space.
        found: Fragments of the landmarks' triangles (`strain.landmark_fragments`).
    """
    model = _mean(head)
    depths = model.folds.depths(head.vertices(head.mean, np.asarray(expression, np.float32)))
    if depths.max() < 0.01:
        return np.full((*found.face.shape, CHANNELS), 128, np.uint8)
    drawn = np.zeros((TEXELS, TEXELS, CHANNELS), np.float32)
    _draw(model.index, model.folds.relief(depths), model.lit(light @ LUMA), drawn)
    uv = head.landmark_uv()[:FACE].astype(np.float32)
    texel = interpolate(found, uv[landmark_faces(head)]) * TEXELS
    drawn = bilinear(drawn, texel) * (found.face >= 0)[..., None]
    return np.round(128 + 127 * np.clip(drawn / FULL, -1, 1)).astype(np.uint8)


def shaded_reference(height, index, lit):
    """The shading [N] of a height [T, T] mm at some texels, in plain numpy; arguments as of `_draw`."""
    slope = np.stack(np.gradient(height)[::-1], -1).reshape(-1, 2)[index]
    return np.einsum("nk,nk->n", lit, slope)


@numba.njit(cache=True, nogil=True)
def _draw(index, relief, lit, out):
    """Draw heights [N] mm and their shading, of `lit` [N, 2], at flat texels [N]: out [T, T, 2]."""
    side = len(out)
    for n in range(len(index)):
        out[index[n] // side, index[n] % side, 0] = relief[n]
    for n in range(len(index)):
        y, x = index[n] // side, index[n] % side
        left, right = max(x - 1, 0), min(x + 1, side - 1)
        above, below = max(y - 1, 0), min(y + 1, side - 1)
        along = (out[y, right, 0] - out[y, left, 0]) / np.float32(right - left)
        down = (out[below, x, 0] - out[above, x, 0]) / np.float32(below - above)
        out[y, x, 1] = lit[n, 0] * along + lit[n, 1] * down


def get_ready(head):
    """Draw a head's people now, in place of when its first picture is painted."""
    _mean(head)


@once_a_mean
def _mean(head):
    """The _Mean of a head, or of a piece of one."""
    return _mean(head.whole).cut(head.whole_vertices) if head.whole else _built(head)


def _built(head):
    skin = head.part_faces("skin")
    found = rasterize(head.uv * TEXELS, None, head.uv_faces[skin], (TEXELS, TEXELS))
    index = np.flatnonzero(found.face.ravel() >= 0)
    number = skin[found.face.ravel()[index]]
    weight = found.barycentric.reshape(-1, 3)[index]
    points = np.einsum("nk,nkc->nc", weight, head.mean[head.faces[number]]).astype(np.float32)
    nearest = np.full(len(points), np.inf)
    for mark in head.landmarks(head.mean)[:FACE:4]:
        nearest = np.minimum(nearest, ((points - mark) ** 2).sum(1))
    rows = np.flatnonzero(nearest < REACH**2)
    index, number, weight, points = (part[rows] for part in (index, number, weight, points))
    people = list(
        side_by_side(
            lambda age: make_folds(head, head.mean, points, np.random.default_rng(age), age), AGES
        )
    )
    normals = np.einsum(
        "nk,nkc->nc", weight, vertex_normals(head.mean, head.faces)[head.faces[number]]
    )
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-6)
    bent = -np.einsum("nsc,nkc->nks", harmonics.basis_jacobian(normals), _duals(head)[number])
    corners = head.faces[number]
    bent = np.ascontiguousarray(bent)
    return _Mean(index, corners, joined(people), harmonics.basis(normals), bent)


def _duals(head):
    """Vectors [F, 2, 3] that a slope of 1 mm a texel along u, and along v, tilts each face by."""
    a, b, c = head.mean[head.faces].transpose(1, 0, 2)
    edges = np.stack([b - a, c - a], 1).astype(float)
    a, b, c = (head.uv[head.uv_faces] * TEXELS).transpose(1, 0, 2)
    steps = np.stack([b - a, c - a], 1).astype(float)  # texels along each edge
    along = np.linalg.pinv(steps) @ edges  # mm along u and along v
    gram = along @ along.transpose(0, 2, 1) + 1e-6 * np.eye(2)
    return np.linalg.solve(gram, along)
