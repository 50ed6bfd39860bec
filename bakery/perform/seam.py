"""The seam between footage and a face that is put into it: a minimum cut over a mesh and over time.

Each vertex of the patch in each frame shows either the footage (source) or the drawn face (target). Edges
of the mesh are dear where either picture changes along them, so that the seam runs through plain skin;
edges from a frame to the next are dear where nothing changes in time, so that it stays there.

References:
    Olszewski et al., ICCV 2017, section 6.1, equations 9 and 10.
    Kwatra et al., "Graphcut Textures", SIGGRAPH 2003: also what both pictures differ by.
"""

from dataclasses import dataclass

import numpy as np

from bakery.geometry.cut import SURELY, minimum_cut
from bakery.perform.patch import Patch

UNIT = 1000  # of the cut's whole numbers, for a difference of 1 in sRGB
LEAST = 0.02  # sRGB-encoded: what changes by less in time stays as it is
LAMBDA = 0.004  # of equation 10
MATCH = 1.0  # of the difference of both pictures at both ends (Kwatra), beside equation 9
HIDDEN = 0.02  # of an edge that something before the face hides: a seam there is not seen


@dataclass(frozen=True, eq=False)
class Seen:
    """What n frames show at the P vertices of a patch."""

    source: np.ndarray  # [n, P, 3] float32 sRGB-encoded: the footage
    target: np.ndarray  # [n, P, 3] float32: the drawn face
    sight: (
        np.ndarray
    )  # [n, P] bool: turned to the camera, in the picture, and drawn of what is known
    hidden: np.ndarray  # [n, P] float32 0..1: behind what is before the face
    feature: np.ndarray  # [n, P] bool: the footage shows its own brows, eyes or mouth here


def seam(patch: Patch, seen: Seen) -> np.ndarray:
    """Which vertices show the drawn face: [n, P] bool, by one cut over all frames."""
    free = ~(patch.inner | patch.outer)
    inside = (patch.inner | seen.feature) & ~patch.outer
    outside = (patch.outer | ~seen.sight) & ~inside
    labels = np.broadcast_to(patch.inner, outside.shape).copy()
    if not free.any():
        return labels
    number = np.full(len(free), -1)
    number[free] = np.arange(free.sum())
    across, between = weights(patch, seen)
    count, width = len(outside), int(free.sum())
    one, other = number[patch.surface.edges].T
    both = (one >= 0) & (other >= 0)
    step = (np.arange(count) * width)[:, None]
    spatial = np.stack([one[both] + step, other[both] + step], -1).reshape(-1, 2)
    nodes = np.arange(count * width).reshape(count, width)
    temporal = np.stack([nodes[:-1], nodes[1:]], -1).reshape(-1, 2)
    face, footage = np.zeros((count, width), np.int64), np.zeros((count, width), np.int64)
    # Edges to vertices that are settled for good are capacities of terminals.
    for near, far in (patch.surface.edges.T, patch.surface.edges.T[::-1]):
        border = (number[near] >= 0) & (number[far] < 0)
        for frame in range(count):
            held = number[near[border]], across[frame, border]
            inner = patch.inner[far[border]]
            np.add.at(face[frame], held[0][inner], held[1][inner])
            np.add.at(footage[frame], held[0][~inner], held[1][~inner])
    face[inside[:, free]] = footage[outside[:, free]] = SURELY
    edges = np.concatenate([spatial, temporal])
    capacity = np.concatenate([across[:, both].ravel(), between[:, free].ravel()])
    found = minimum_cut(edges, capacity, face.ravel(), footage.ravel())
    labels[:, free] = found.reshape(count, width)
    return labels


def weights(patch: Patch, seen: Seen) -> tuple[np.ndarray, np.ndarray]:
    """Equation 9 of the edges of the mesh [n, M] and equation 10 of each vertex to the next frame
    [n - 1, P], in whole numbers of 1 / UNIT.
    """
    one, other = patch.surface.edges.T

    def length(values: np.ndarray) -> np.ndarray:
        found: np.ndarray = np.linalg.norm(values, axis=-1)
        return found

    apart = length(seen.source - seen.target)  # [n, P]
    across = MATCH * (apart[:, one] + apart[:, other])
    for picture in (seen.source, seen.target):
        across += length(picture[:, one] - picture[:, other])
    shown = 1 - np.maximum(seen.hidden[:, one], seen.hidden[:, other])
    across *= HIDDEN + (1 - HIDDEN) * shown
    between = np.zeros((max(len(apart) - 1, 0), apart.shape[1]), np.float32)
    for picture in (seen.source, seen.target):
        between += LAMBDA / np.maximum(length(np.diff(picture, axis=0)), LEAST)
    return tuple(np.round(UNIT * x).astype(np.int64) + 1 for x in (across, between))
