"""Hair with volume as a binary glTF file of its own."""

from pathlib import Path

import numpy as np
import pygltflib as gltf

from bakery.export import glb
from bakery.export.web.files import straight_alpha
from bakery.formats import image
from bakery.geometry.mesh import vertex_normals
from bakery.types import HAIR_KINDS, HairMesh

MATERIALS = ("hair_cap", "hair_cards", "hair_fringe")  # by kind
CUT_OFF = 0.4  # alpha below which a card is clear


def hair_surfaces(mesh: HairMesh, level: int) -> list[glb.Surface]:
    """What of the hair a level of detail shows: cap, cards and fringe, those that there are.

    Faces keep their order, from the skull outwards.
    """
    normals = vertex_normals(mesh.vertices.astype(float), mesh.faces)
    found = []
    for kind, name in enumerate(MATERIALS[: len(HAIR_KINDS)]):
        faces = mesh.faces[(mesh.kind == kind) & (mesh.levels >> level & 1 > 0)]
        if len(faces):
            used, index = np.unique(faces, return_inverse=True)
            still = np.zeros((0, len(used), 3), np.float32)
            corners = index.reshape(-1, 3)
            found.append(
                glb.Surface(name, mesh.vertices[used], normals[used], mesh.uv[used], corners, still)
            )
    return found


def write_hair(path: Path, mesh: HairMesh, generator: str, level: int = 0) -> None:
    """Write hair alone: one node, the cap opaque, cards cut out by alpha, from both sides.

    Args:
        generator: name and version of the program.
        level: of detail.
    """
    made = glb._Writer()
    document = gltf.GLTF2(asset=gltf.Asset(version="2.0", generator=generator))
    picture = image.encode_image(straight_alpha(np.asarray(mesh.texture, np.float32)), ".png")
    document.images = [gltf.Image(name="hair", mimeType="image/png", bufferView=made.view(picture))]
    document.samplers = [gltf.Sampler(magFilter=gltf.LINEAR, minFilter=gltf.LINEAR_MIPMAP_LINEAR)]
    document.textures = [gltf.Texture(source=0, sampler=0)]
    document.extensionsUsed = ["KHR_materials_unlit"]
    pieces = hair_surfaces(mesh, level)
    names = [piece.name for piece in pieces]
    document.materials = [_material(name) for name in names]
    glb._add_mesh(document, made, "hair", pieces, names, [])
    document.scenes = [gltf.Scene(name="hair", nodes=[0])]
    glb._write(path, document, made)


def _material(name: str) -> gltf.Material:
    material = glb._unlit(name)
    material.pbrMetallicRoughness.baseColorTexture = gltf.TextureInfo(index=0)
    if name != MATERIALS[0]:
        material.alphaMode, material.alphaCutoff, material.doubleSided = gltf.MASK, CUT_OFF, True
    return material
