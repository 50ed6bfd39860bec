"""Heads with hair as masks, depths and directions: what the measures of hair look at.

Hair that is made of cards is drawn as `runtime` draws it, single hairs as the painter draws them.
"""

from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np

from bakery.geometry import camera as cameras
from bakery.geometry.color import to_encoded, to_linear
from bakery.geometry.raster import rasterize
from bakery.geometry.sample import interpolate
from bakery.heads.base import HeadModel
from bakery.runtime.hair_cards import hair_cards, hair_layer, paint_cap
from bakery.synth.strands import Strands, draw_strands
from bakery.types import Camera, Fragments, HairMesh

SHOWN = ("skin", "eye_left", "eye_right")  # parts of a head that its outline has
HALF = 0.5  # of a pixel, from which hair covers it


@dataclass(frozen=True, eq=False)
class Seen:
    """Hair in a picture."""

    cover: np.ndarray  # [H, W] float32 0..1: how much of a pixel hair covers
    depth: np.ndarray  # [H, W] float32 mm to what is seen of it; any number where it covers nothing
    # [H, W] float32 radians 0..pi, anticlockwise from the right as y goes up; single hairs alone
    angle: np.ndarray | None = None

    @property
    def there(self) -> np.ndarray:
        """Where hair is [H, W] bool."""
        return self.cover > HALF


class Hair(Protocol):
    """Hair that can be looked at from any side."""

    def seen(self, camera: Camera, wall: np.ndarray) -> Seen:
        """The hair before a head that lies [H, W] mm away, inf where there is none."""


def draw_hair(
    mesh: HairMesh,
    camera: Camera,
    wall: np.ndarray,
    level: int = 0,
    shine: np.ndarray | None = None,
) -> np.ndarray:
    """Hair with volume as players draw it, apart from the head.

    Args:
        wall: [H, W] mm to the head, inf where there is none.
        level: of detail.
        shine: [N, 3] what the colour is multiplied by at the vertices; None for nothing.

    Returns:
        [H, W, 4] float32 linear, premultiplied.
    """
    hair = hair_cards(mesh, level)
    points = cameras.to_camera(hair.vertices.astype(np.float64), camera)
    pixels, distance = cameras.project_camera(points, camera), -points[:, 2]
    shine = np.ones_like(hair.vertices) if shine is None else np.asarray(shine, np.float32)
    found = rasterize(pixels, distance, hair.cap, wall.shape, cull=True)
    capped = found.depth < wall
    found = replace(found, face=np.where(capped, found.face, -1))
    color = np.zeros((*wall.shape, 3), np.float32)
    if capped.any():
        paint_cap(color, found, 0, interpolate(found, hair.cap_uv), hair, shine)
    nearest = np.where(capped, found.depth, wall)
    return hair_layer(color, capped, nearest, camera, pixels, distance, hair, shine)


class CardHair:
    """Hair with volume. See `Hair`."""

    def __init__(self, mesh: HairMesh) -> None:
        self.mesh = mesh
        self.white = replace(mesh, texture=np.repeat(mesh.texture[..., 3:], 4, 2))

    def seen(self, camera: Camera, wall: np.ndarray) -> Seen:
        """See `Hair`; depths are mixed as colours are: in sRGB, which they are given in."""
        distance = -cameras.to_camera(self.mesh.vertices.astype(np.float64), camera)[:, 2]
        low, high = distance.min(), distance.max()
        share = (distance - low) / max(high - low, 1e-6)
        told = np.repeat(to_linear(share)[:, None], 3, 1)
        picture = draw_hair(self.white, camera, wall, shine=told)
        cover = picture[..., 3]
        mixed = to_encoded(picture[..., 0] / np.maximum(cover, 1e-6))
        return Seen(cover, (low + mixed * (high - low)).astype(np.float32))


class StrandHair:
    """Single hairs that the painter drew. See `Hair`."""

    def __init__(self, strands: Strands) -> None:
        self.strands = strands

    def seen(self, camera: Camera, wall: np.ndarray) -> Seen:
        """See `Hair`."""
        points = cameras.to_camera(self.strands.points.astype(np.float64), camera)
        along = np.gradient(cameras.project_camera(points, camera), axis=1)
        double = 2 * np.arctan2(-along[..., 1], along[..., 0])
        told = np.stack([-points[..., 2], np.cos(double), np.sin(double)], -1)
        image, cover = np.zeros((*wall.shape, 3), np.float32), np.zeros(wall.shape, np.float32)
        moved = replace(self.strands, points=points.astype(np.float32))
        draw_strands([moved], [told], camera, wall.astype(np.float32), image, cover)
        depth = image[..., 0] / np.maximum(cover, 1e-6)
        angle = 0.5 * np.arctan2(image[..., 2], image[..., 1]) % np.pi
        return Seen(cover, depth, angle)


@dataclass(frozen=True, eq=False)
class Figure:
    """A head and its hair, in one space."""

    head: HeadModel
    vertices: np.ndarray  # [V, 3] mm, posed
    hair: Hair | None = field(default=None)

    def wall(self, camera: Camera) -> np.ndarray:
        """How far the head is [H, W] mm; inf where it is not."""
        return self.fragments(camera).depth

    def fragments(self, camera: Camera) -> Fragments:
        """What is seen of the head: Fragments of `faces`."""
        points = cameras.to_camera(np.asarray(self.vertices, np.float64), camera)
        size = (camera.height, camera.width)
        pixels = cameras.project_camera(points, camera)
        return rasterize(pixels, -points[:, 2], self.faces, size, cull=True)

    @property
    def faces(self) -> np.ndarray:
        """The triangles [F, 3] that `wall` is made of."""
        return self.head.faces[self.head.part_faces(*SHOWN)]

    def seen(self, camera: Camera, wall: np.ndarray) -> Seen:
        """The hair before the head; a bald one covers nothing."""
        if self.hair is None:
            return Seen(np.zeros(wall.shape, np.float32), np.zeros(wall.shape, np.float32))
        return self.hair.seen(camera, wall)
