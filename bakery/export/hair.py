"""Hair with volume as glTF: the surfaces of each level of detail, and a file of its own."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pygltflib as gltf

from bakery.export import glb
from bakery.export.glb import Surface
from bakery.export.glb_data import Writer
from bakery.export.web.files import straight_alpha
from bakery.formats import image
from bakery.geometry.mesh import face_normals
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
        faces = mesh.faces[(mesh.kind == kind) & mesh.shown(level)]
        if not len(faces):
            continue
        faces = _facing(mesh.vertices, faces, normals)
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


def _facing(vertices, faces, normals):
    """Triangles [F, 3] turned over where they face away from the normals [V, 3] of their vertices.

    Programs turn the normal over on the back of a triangle: lit cards were black in patches.
    """
    away = (face_normals(vertices, faces) * normals[faces].sum(1)).sum(1) < 0
    return np.where(away[:, None], faces[:, ::-1], faces)


def both_sides(hair: Hair) -> Hair:
    """Hair with each triangle a second time, turned over: seen from both sides in the same light.

    Its materials must not be double-sided then. Those turn normals over: lit edges were black.
    """
    levels = [
        [
            replace(piece, faces=np.concatenate([piece.faces, piece.faces[:, ::-1]]))
            for piece in level
        ]
        for level in hair.levels
    ]
    return replace(hair, levels=levels)


def write_hair(path: Path, mesh: HairMesh, generator: str, level: int = 0) -> None:
    """Write hair alone: one node, with the materials that it has in `glb.write_glb`.

    Args:
        generator: name and version of the program.
        level: of detail.
    """
    made = Writer()
    document = gltf.GLTF2(asset=gltf.Asset(version="2.0", generator=generator))
    picture = image.encode_image(straight_alpha(np.asarray(mesh.texture, np.float32)), ".png")
    document.images = [gltf.Image(name="hair", mimeType="image/png", bufferView=made.view(picture))]
    document.samplers = [gltf.Sampler(magFilter=gltf.LINEAR, minFilter=gltf.LINEAR_MIPMAP_LINEAR)]
    document.textures = [gltf.Texture(source=0, sampler=0)]
    document.extensionsUsed = ["KHR_materials_unlit"]
    pieces = surfaces(mesh, level)
    names = [piece.name for piece in pieces]
    document.materials = [glb.hair_material(name, 0) for name in names]
    glb.add_mesh(document, made, "hair", pieces, names, [])
    document.scenes = [gltf.Scene(name="hair", nodes=[0])]
    glb.write_document(path, document, made)
