"""Proxy meshes: the mouth proxy and the eye proxies, and how pictures are unwrapped onto them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from bakery.geometry.raster import rasterize
from bakery.geometry.sample import at_corners
from bakery.heads.base import EYES, HeadModel


@dataclass(frozen=True)
class Proxy:
    """The texels of one proxy at one resolution."""

    shape: tuple[int, int]  # h, w texels
    index: np.ndarray  # [N] flat texel numbers
    corners: np.ndarray  # [N, 3] vertices
    barycentric: np.ndarray  # [N, 3] float32

    def at(self, values: ArrayLike) -> np.ndarray:
        """Per-vertex values [V, C] at the texels: [N, C] float32."""
        return at_corners(values, self.corners, self.barycentric)

    def paint(self, values: np.ndarray) -> np.ndarray:
        """Texel values [N, C] as a picture [h, w, C]; texels off the proxy are 0."""
        out = np.zeros((self.shape[0] * self.shape[1],) + values.shape[1:], np.float32)
        out[self.index] = values
        return out.reshape(self.shape + values.shape[1:])

    @property
    def inside(self) -> np.ndarray:
        """[h, w] float32: 1 on the proxy."""
        return self.paint(np.ones(len(self.index), np.float32))


def make_proxy(head: HeadModel, name: str, size: int) -> Proxy:
    """The proxy `name` at the resolution it has in an atlas of `size` texels a side."""
    left, top, width, height = head.uv_rectangles[name]
    shape = (max(round(height * size), 8), max(round(width * size), 8))
    faces = head.part_faces(name)
    scale = np.array([shape[1] / width, shape[0] / height])
    uv = (head.uv - [left, top]) * scale
    found = rasterize(uv, None, head.uv_faces[faces], shape)
    index = np.flatnonzero(found.face.ravel() >= 0)
    return Proxy(
        shape,
        index,
        head.faces[faces[found.face.ravel()[index]]],
        found.barycentric.reshape(-1, 3)[index],
    )


def eye_proxies(head: HeadModel, size: int) -> list[Proxy]:
    """Both eye proxies, left first."""
    return [make_proxy(head, "eye_cap_" + eye, size) for eye in EYES]
