"""The albedo basis: low-frequency skin reflectance on a chart that every head model shares.

The chart is a cylinder around the head (angle and height), bent so that the 468 landmarks of any
head model fall where they lay on the head that the basis was learned with. So the basis outlives
changes of a head's topology and serves every head model.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from bakery import landmarks as marks
from bakery.formats.tensors import reading
from bakery.geometry.sample import bilinear
from bakery.memo import once_per_object
from bakery.paths import ASSETS
from bakery.stages.fit.warp import kernel, opened

FILE = ASSETS / "albedo" / "albedo.safetensors"
AXIS = -75.0  # mm, z of the cylinder's axis, behind the eyes
ANGLE = np.radians(80.0)  # half the chart's width
TOP, BOTTOM = 90.0, -105.0  # mm, the chart's height


@dataclass(frozen=True, eq=False)
class AlbedoBasis:
    """Mean and modes of skin albedo, linear Rec.709."""

    mean: np.ndarray  # [S, S, 3] float32
    modes: np.ndarray  # [A, S, S, 3] float32, for one standard deviation
    layout: np.ndarray  # [468, 2] where the landmarks lie on the chart, 0..1
    light: np.ndarray  # [9, 3] light of the studio it was learned in, a first guess elsewhere


@lru_cache(maxsize=4)
def load_albedo(path=FILE):
    """Read an AlbedoBasis.

    Raises:
        ModelError: the file is missing or damaged.
    """
    from safetensors.numpy import load_file

    with reading("albedo basis", path, "reinstall bakery"):
        arrays = load_file(path)
        return AlbedoBasis(
            **{key: arrays[key].astype(np.float32) for key in ("mean", "modes", "layout", "light")}
        )


def cylinder(points):
    """Chart coordinates [.., 2] in 0..1 (angle, height; origin top left) of head space [.., 3]."""
    angle = np.arctan2(points[..., 0], points[..., 2] - AXIS)
    return np.stack([(angle / ANGLE + 1) / 2, (TOP - points[..., 1]) / (TOP - BOTTOM)], -1)


def chart(head, layout):
    """Chart coordinates [V, 2] of every vertex of a head: its landmarks fall on the layout.

    Only skin is moved there; teeth, eyes and lashes stay where the cylinder has them.
    """
    mean = head.mean.astype(np.float64)
    apart = opened(head)  # lips and lids of the chart must not mix
    corners = head.landmark_vertices[: marks.FACE]
    weight = head.landmark_barycentric[: marks.FACE].astype(np.float64)

    def at_landmarks(values):
        return np.einsum("lkc,lk->lc", values[corners], weight)

    miss = layout - cylinder(at_landmarks(mean))
    points = at_landmarks(apart)
    gram = kernel(points, points) + 1e-2 * np.eye(marks.FACE)
    weight = np.linalg.solve(gram, miss).astype(np.float32)
    out, skin = cylinder(mean), head.part_vertices("skin")
    out[skin] += kernel(apart[skin].astype(np.float32), points) @ weight
    return out


@once_per_object
def vertex_chart(head, basis):
    """`chart` of a head on a basis's layout."""
    return chart(head, basis.layout)


def texel_chart(head, basis, atlas):
    """Chart coordinates [N, 2] of the texels of an atlas; -1 on faces that lie across its two ends, behind."""
    places = vertex_chart(head, basis)
    out = atlas.at(places)
    across = np.ptp(places[head.faces, 0], axis=1) > 0.5
    out[across[atlas.face]] = -1
    return out


@once_per_object
def vertex_albedo(head, basis):
    """The basis at the vertices of a head.

    Returns:
        mean [V, 3] and modes [A, V, 3], linear. Only skin means anything.
    """
    points = np.clip(vertex_chart(head, basis), 0, 1) * basis.mean.shape[0]
    mean = bilinear(basis.mean, points)
    return mean, np.stack([bilinear(mode, points) for mode in basis.modes])
