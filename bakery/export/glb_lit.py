"""The lit variant of a glTF file's materials: KHR_materials_variants, KHR_materials_specular."""

from copy import deepcopy

import pygltflib as gltf

from bakery.export.glb_data import Writer
from bakery.export.materials import HAIR_ROUGH, REFRACTION, RELIEF, ROUGH, VARIANTS, WET, Lit


def add_variants(document: gltf.GLTF2, made: Writer, lit: Lit) -> None:
    """Give each primitive a second material, that lamps shine on; the unlit one stays its default."""
    first = len(document.textures)
    for name, kind in (("color", "jpeg"), ("roughness", "jpeg"), ("normal", "png")):
        document.textures.append(gltf.Texture(source=len(document.images), sampler=0))
        view = made.view(getattr(lit, name))
        picture = gltf.Image(name=f"lit_{name}", mimeType=f"image/{kind}", bufferView=view)
        document.images.append(picture)
    for material in document.materials:
        if material.name.startswith("hair"):
            material.doubleSided = False  # see export.hair.both_sides
    count = len(document.materials)
    document.materials += [_lit(material, first) for material in document.materials]
    for mesh in document.meshes:
        for primitive in mesh.primitives:
            materials = primitive.material, primitive.material + count
            primitive.extensions = {
                "KHR_materials_variants": {
                    "mappings": [
                        {"material": index, "variants": [number]}
                        for number, index in enumerate(materials)
                    ]
                }
            }
    document.extensionsUsed += ["KHR_materials_variants", "KHR_materials_specular"]
    document.extensions["KHR_materials_variants"] = {"variants": [{"name": v} for v in VARIANTS]}


def _lit(unlit: gltf.Material, first: int) -> gltf.Material:
    """A material as lamps shine on it; `first` of the textures of a Lit."""
    material, name = deepcopy(unlit), unlit.name
    material.name = f"{name}_{VARIANTS[1]}"
    if name == WET:
        return material
    material.extensions.pop("KHR_materials_unlit")
    surface = material.pbrMetallicRoughness
    if surface.baseColorTexture.index == 0:  # the atlas, and no picture of its own
        surface.baseColorTexture.index = first
    surface.roughnessFactor = ROUGH.get(name, HAIR_ROUGH)
    if name == RELIEF:
        surface.roughnessFactor = surface.metallicFactor = 1.0
        surface.metallicRoughnessTexture = gltf.TextureInfo(index=first + 1)
        material.normalTexture = gltf.NormalMaterialTexture(index=first + 2)
    if name in REFRACTION:
        material.extensions["KHR_materials_specular"] = {
            "specularFactor": _mirrored(REFRACTION[name])
        }
    return material


def _mirrored(refraction):
    """How much light a surface mirrors at normal incidence, of the 4% that glTF takes for all."""
    return round(((refraction - 1) / (refraction + 1)) ** 2 / 0.04, 3)
