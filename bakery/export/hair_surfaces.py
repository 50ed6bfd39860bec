"""Hair with volume as surfaces for glTF."""

from dataclasses import dataclass

import numpy as np

from bakery.export.glb import Surface
from bakery.runtime.hair_cards import soft_normals
from bakery.types import HAIR_KINDS, HAIR_TRIANGLES, HairMesh

MATERIALS = ("hair_cap", "hair_cards", "hair_fringe")  # by kind


@dataclass(frozen=True, eq=False)
class Hair:
    """Hair as `glb.write_glb` takes it."""

    levels: list[list[Surface]]  # one for each level of detail of the head
    picture: bytes  # a PNG with alpha, its colour not multiplied by it


def hair_levels(mesh: HairMesh, count: int) -> list[list[Surface]]:
    """The hair of each of `count` levels of detail of the head; behind its own levels the cap alone."""
    last = len(HAIR_TRIANGLES) - 1
    return [
        surfaces(mesh, min(level, last), HAIR_KINDS if level <= last else HAIR_KINDS[:1])
        for level in range(count)
    ]


def surfaces(mesh: HairMesh, level: int, kinds: tuple[str, ...] = HAIR_KINDS) -> list[Surface]:
    """The surfaces of one level of detail, by kind, in the order of the faces; without shapes."""
    normals, found = soft_normals(mesh), []
    for kind in range(len(kinds)):
        faces = mesh.faces[(mesh.kind == kind) & (mesh.levels >> level & 1).astype(bool)]
        if not len(faces):
            continue
        used, index = np.unique(faces, return_inverse=True)
        found.append(
            Surface(
                name=MATERIALS[kind],
                vertices=mesh.vertices[used],
                normals=normals[used],
                uv=mesh.uv[used],
                faces=index.reshape(-1, 3),
                shapes=np.zeros((0, len(used), 3), np.float32),
            )
        )
    return found
