"""Hair with volume as a file of its own."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pygltflib as gltf

from bakery.export.glb import METRES
from bakery.formats.files import write_bytes
from bakery.formats.image import encode_png
from bakery.geometry.color import to_encoded
from bakery.geometry.mesh import vertex_normals
from bakery.types import HAIR_KINDS, HairMesh

MATERIALS = ("hair_cap", "hair_cards", "hair_fringe")  # by kind
CUT_OFF = 0.4  # alpha below which a card is clear


@dataclass(frozen=True, eq=False)
class HairSurface:
    """The hair of one material, its faces from the skull outwards."""

    name: str
    vertices: np.ndarray  # [n, 3] mm
    normals: np.ndarray  # [n, 3] unit
    uv: np.ndarray  # [n, 2] 0..1 from the top left
    faces: np.ndarray  # [m, 3]


def hair_surfaces(mesh: HairMesh, level: int) -> list[HairSurface]:
    """What of the hair a level of detail shows: cap, cards and fringe, those that there are."""
    normals = vertex_normals(mesh.vertices.astype(float), mesh.faces)
    found = []
    for kind in range(len(HAIR_KINDS)):
        faces = mesh.faces[(mesh.kind == kind) & (mesh.levels >> level & 1 > 0)]
        if len(faces):
            used, index = np.unique(faces, return_inverse=True)
            found.append(
                HairSurface(
                    MATERIALS[kind], mesh.vertices[used], normals[used], mesh.uv[used],
                    index.reshape(-1, 3),
                )  # fmt: skip
            )
    return found
