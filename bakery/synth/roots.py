"""Where hair grows: densities on the chart, roots on the mesh, the skull that hair lies on."""

import cv2
import numpy as np

from bakery.geometry.mesh import face_normals, vertex_normals
from bakery.geometry.sample import bilinear
from bakery.synth.chart import RADIUS, smoothstep


def scalp_mask(chart, subject):
    """Density [H, W] 0..1 of hair on the scalp: the hairline around face and ears, uneven."""
    rng = subject.rng("hairline")
    spot = chart.spot
    back = subject.hairline + (14.0 if subject.hair == "receding" else 0.0)
    front, behind, low, high = chart.ear
    top = spot(10)[1]
    brow, eye = spot(293)[1], spot(263)[1]
    end = np.pi * RADIUS + 5
    line = np.array(
        [
            [0, top + 9 + 0.35 * back],
            [16, top + 8 + 0.55 * back],
            [32, top + 5 + 1.3 * back],
            [48, top - 4 + 1.1 * back],
            [63, top - 17 + 0.6 * back],
            [77, brow + 6],
            [front - 27, brow - 6],
            [front - 21, eye - 1],
            [front - 17, eye - 13],
            [front - 3, eye - 16],
            [front + 1, high - 1],
            [front + 12, high + 7],
            [front + 30, high + 6],
            [behind + 2, high - 8],
            [behind + 5, low + 12],
            [behind + 22, low - 12],
            [end, low - 18],
        ]
    )
    top_left = [end, chart.top + 20]
    left = np.concatenate([line, [top_left]])
    ring = np.concatenate([left, left[::-1] * [-1, 1]])
    x = chart.blur(rng.normal(size=(chart.height, chart.width)).astype(np.float32), 2.6)
    broad = chart.blur(rng.normal(size=x.shape).astype(np.float32), 9.0)
    mask = chart.polygon(ring, 3.4)
    mask = smoothstep(
        0.15, 0.92, mask + 0.12 * x / x.std() * (mask > 0.02) + 0.05 * broad / broad.std()
    )
    if subject.hair == "thinning":
        gx, gy = chart.grid()
        bare = np.outer(
            smoothstep(spot(10)[1] - 8, spot(10)[1] + 6, gy), smoothstep(88, 52, np.abs(gx))
        )
        mask *= 1 - 0.88 * bare
    if subject.hair == "bald":
        gx, gy = chart.grid()
        mask *= 0.55 * (1 - np.outer(smoothstep(brow + 6, brow + 34, gy), np.ones_like(gx)))
    return mask


def ear_faces(chart, head):
    """True for faces [F] of the ears, where no scalp hair grows."""
    middle = chart.flat(head.mean[head.faces].mean(1))
    left, right, bottom, top = chart.ear
    across = (np.abs(middle[:, 0]) - (left + right) / 2) / ((right - left) / 2 + 2)
    up = (middle[:, 1] - (bottom + top) / 2) / ((top - bottom) / 2 + 3)
    return np.abs(across) ** 8 + np.abs(up) ** 8 < 1


def sample_roots(head, chart, density, count, rng, avoid=None):
    """Random places on the skin, drawn by density per area of the mean head.

    Args:
        density: [H, W] on the chart.
        count: how many to draw.
        avoid: [F] faces left out.

    Returns:
        faces [n], barycentric [n, 3], places [n, 3] on the mean head.
    """
    faces = head.part_faces("skin")
    if avoid is not None:
        faces = faces[~avoid[faces]]
    corners = head.mean[head.faces[faces]]
    peak = np.max([chart.sample(density, corners[:, k]) for k in range(3)], 0)
    middle = chart.sample(density, corners.mean(1))
    weight = np.linalg.norm(face_normals(head.mean, head.faces[faces]), axis=1) * np.maximum(
        np.maximum(peak, middle), 0
    )
    if weight.sum() <= 0:
        return np.zeros(0, int), np.zeros((0, 3)), np.zeros((0, 3), np.float32)
    pick = rng.choice(len(faces), count, p=weight / weight.sum())
    a, b = rng.random(count), rng.random(count)
    a, b = np.where(a + b > 1, 1 - a, a), np.where(a + b > 1, 1 - b, b)
    barycentric = np.stack([1 - a - b, a, b], 1)
    places = np.einsum("nk,nkc->nc", barycentric, corners[pick])
    limit = np.maximum(np.maximum(peak, middle)[pick], 1e-6)
    keep = rng.random(count) < chart.sample(density, places) / limit
    return faces[pick][keep], barycentric[keep], places[keep]


def roots_on(head, vertices, faces, barycentric):
    """Roots on a posed shape: places [n, 3] and unit normals [n, 3]."""
    skin = head.part_faces("skin")
    normals = vertex_normals(vertices, head.faces[skin])
    corners = head.faces[faces]
    place = np.einsum("nk,nkc->nc", barycentric, vertices[corners])
    normal = np.einsum("nk,nkc->nc", barycentric, normals[corners])
    return place, normal / np.linalg.norm(normal, axis=1, keepdims=True)


class Skull:
    """The head as a smooth ball of varying radius, on which combed hair lies."""

    ROWS, COLUMNS = 90, 180

    def __init__(self, head, chart, vertices):
        skin = vertices[
            np.unique(
                head.faces[head.part_faces("skin")][
                    ~ear_faces(chart, head)[head.part_faces("skin")]
                ]
            )
        ]
        upper = skin[skin[:, 1] > 15]
        self.center = np.array([0.0, 22.0, (upper[:, 2].min() + upper[:, 2].max()) / 2])
        skin = skin[skin[:, 1] > self.center[1] - 130]
        relative = skin - self.center
        radius = np.linalg.norm(relative, axis=1)
        row, column = self._cell(relative, radius)
        flat = row.astype(int) * self.COLUMNS + column.astype(int)
        size = self.ROWS * self.COLUMNS
        total = np.bincount(flat, radius, size).reshape(self.ROWS, self.COLUMNS)
        number = np.bincount(flat, None, size).reshape(self.ROWS, self.COLUMNS).astype(float)
        for sigma in (2.0, 5.0, 12.0):
            pad = 40
            wide_t = cv2.GaussianBlur(np.pad(total, ((0, 0), (pad, pad)), "wrap"), (0, 0), sigma)
            wide_n = cv2.GaussianBlur(np.pad(number, ((0, 0), (pad, pad)), "wrap"), (0, 0), sigma)
            smooth_t, smooth_n = wide_t[:, pad:-pad], wide_n[:, pad:-pad]
            if sigma == 2.0:
                result = smooth_t / np.maximum(smooth_n, 1e-9)
                strength = smooth_n
            else:
                weak = np.clip(0.02 / np.maximum(strength, 1e-9), 0, 1)
                result = result * (1 - weak) + weak * smooth_t / np.maximum(smooth_n, 1e-9)
        self.radius = np.pad(np.minimum(result, 125), ((0, 0), (1, 1)), "wrap").astype(np.float32)

    def _cell(self, relative, radius):
        up = np.arccos(np.clip(relative[..., 1] / np.maximum(radius, 1e-6), -1, 1)) / np.pi
        around = np.arctan2(relative[..., 0], relative[..., 2]) / (2 * np.pi) + 0.5
        return np.clip(up * self.ROWS, 0, self.ROWS - 1e-3), np.clip(
            around * self.COLUMNS, 0, self.COLUMNS - 1e-3
        )

    def height(self, points):
        """How far [N] points lie above the skull, and the outward direction [N, 3]."""
        relative = points - self.center
        radius = np.linalg.norm(relative, axis=-1)
        row, column = self._cell(relative, radius)
        surface = bilinear(self.radius, np.stack([column + 1, row], -1))
        return radius - surface, relative / radius[..., None]
