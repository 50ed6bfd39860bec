"""How open skin lies: what light from everywhere leaves of it in folds, as those of ears.

A photo has that shade in what it shows. Skin that is made up has a smooth tone: without it ears are
flat slabs, and a neck starts at the jaw without a shade. The light of portraits comes from above: below
a jaw it is dark.
"""

from typing import NamedTuple

import numpy as np

from bakery.geometry.mesh import vertex_normals
from bakery.geometry.raster import rasterize
from bakery.heads.base import HeadModel

DIRECTIONS = 64  # that light is looked for in
SCALE = 1.25  # pixels a mm of the depth maps: folds of ears are 3 mm wide
SLACK = 1.0  # mm that a vertex may lie behind a depth map, and see its light
DARKEST = 0.05
# Light from above is as bright as its height over the horizon, and this. Necks that people's photos show
# are half as bright as their lower cheeks; 0.1 leaves 0.70 of the light there, 0.05 0.61, this 0.52.
AROUND = 0.02
# Powers of openness: light that leaves a fold was reflected in it, and skin reflects red best.
TINT = np.array([0.8, 1.1, 1.15], np.float32)


class Openness(NamedTuple):
    """How much light reaches each vertex of the skin; 1 off the skin."""

    everywhere: (
        np.ndarray
    )  # [V] float32 0..1, share of the light from everywhere, by the cosine to the normal
    above: (
        np.ndarray
    )  # [V] float32, of the light from above, over what an upright wall in the open has


def openness(head: HeadModel, vertices: np.ndarray) -> Openness:
    """What the head leaves of the light on its skin.

    Args:
        vertices: [V, 3] mm, the head upright.

    References:
        Zhukov, Iones and Kronin, "An ambient light illumination model", Rendering Techniques 1998.
    """
    skin, faces = head.part_vertices("skin"), head.faces[head.part_faces("skin")]
    normals = vertex_normals(vertices, head.faces)[skin]
    middle = vertices[skin].mean(0)
    points = vertices - middle
    radius = np.linalg.norm(points[skin], axis=1).max()
    size = int(np.ceil(2 * radius * SCALE)) + 4
    reached, all_light = np.zeros((2, len(skin))), np.zeros(len(skin))
    directions = _directions()
    sky = np.maximum(directions[:, 1], 0) + AROUND
    for direction, brightness in zip(directions, sky):
        across = np.cross(direction, np.eye(3)[np.abs(direction).argmin()])
        across /= np.linalg.norm(across)
        frame = np.stack([across, np.cross(across, direction)], 1)
        pixels = points @ frame * SCALE + size / 2
        depth = 2 * radius - points @ direction
        found = rasterize(pixels, depth, faces, (size, size))
        nearest = np.where(found.face >= 0, found.depth, np.inf)
        cosine = np.maximum(normals @ direction, 0)
        column, row = pixels[skin].astype(int).T
        # A pixel's middle lies up to half a pixel beside the vertex, on a surface at a slant.
        slope = np.sqrt(np.maximum(1 - cosine**2, 0)) / np.maximum(cosine, 0.15)
        light = cosine * (depth[skin] < nearest[row, column] + SLACK + slope / SCALE)
        reached += np.outer([1, brightness], light)
        all_light += cosine
    everywhere, above = np.ones((2, len(vertices)), np.float32)
    everywhere[skin] = reached[0] / np.maximum(all_light, 1e-6)
    above[skin] = reached[1] / (np.maximum(directions[:, 2], 0) @ sky)
    return Openness(everywhere, above)


def shade_of(open_to: np.ndarray) -> np.ndarray:
    """What of a colour [..., 3] is left in a fold that is open by `open_to` [...] 0..1."""
    out: np.ndarray = np.maximum(open_to, DARKEST)[..., None] ** TINT
    return out


def _directions() -> np.ndarray:
    """Unit vectors [DIRECTIONS, 3] spread evenly over the sphere, by Fibonacci's spiral."""
    number = np.arange(DIRECTIONS) + 0.5
    up = 1 - 2 * number / DIRECTIONS
    turn = np.pi * (1 + np.sqrt(5)) * number
    around = np.sqrt(1 - up**2)
    return np.stack([around * np.cos(turn), up, around * np.sin(turn)], 1)
