"""How open skin lies: what light from everywhere leaves of it in folds, as those of ears.

A photo has that shade in what it shows. Skin that is made up has a smooth tone: without it ears are
flat slabs, and a neck starts at the jaw without a shade.
"""

import numpy as np

from bakery.geometry.mesh import vertex_normals
from bakery.geometry.raster import rasterize
from bakery.heads.base import HeadModel

DIRECTIONS = 64  # that light is looked for in
SCALE = 1.25  # pixels a mm of the depth maps: folds of ears are 3 mm wide
SLACK = 1.0  # mm that a vertex may lie behind a depth map, and see its light
DARKEST = 0.05
# Powers of openness: light that leaves a fold was reflected in it, and skin reflects red best.
TINT = np.array([0.8, 1.1, 1.15], np.float32)


def openness(head: HeadModel, vertices: np.ndarray) -> np.ndarray:
    """Share [V] float32 0..1 of the light from everywhere that reaches each vertex of the skin.

    Weighted by the cosine to the normal; 1 on whatever nothing stands before, and off the skin.

    Args:
        vertices: [V, 3] mm.

    References:
        Zhukov, Iones and Kronin, "An ambient light illumination model", Rendering Techniques 1998.
    """
    skin, faces = head.part_vertices("skin"), head.faces[head.part_faces("skin")]
    normals = vertex_normals(vertices, head.faces)[skin]
    middle = vertices[skin].mean(0)
    points = vertices - middle
    radius = np.linalg.norm(points[skin], axis=1).max()
    size = int(np.ceil(2 * radius * SCALE)) + 4
    reached, all_light = np.zeros(len(skin)), np.zeros(len(skin))
    for direction in _directions():
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
        reached += cosine * (depth[skin] < nearest[row, column] + SLACK + slope / SCALE)
        all_light += cosine
    out = np.ones(len(vertices), np.float32)
    out[skin] = reached / np.maximum(all_light, 1e-6)
    return out


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
