"""The looks of a head as UsdPreviewSurface materials.

Source: openusd.org, "UsdPreviewSurface Specification".
"""

from __future__ import annotations

import contextlib
from collections.abc import Mapping

from bakery.export.glb import CUT
from bakery.export.materials import HAIR_ROUGH, REFRACTION, RELIEF, ROUGH, VARIANTS, WET

with contextlib.suppress(ImportError):  # of the extra usd; without it exporters.usd says so
    from pxr import Gf, Sdf, Usd, UsdGeom, UsdShade

PHOTO, LIT = VARIANTS
# Files of a package, by what they show.
ATLAS, CARDS, LOCKS = "textures/photo.jpg", "textures/lashes.png", "textures/hair.png"
COLOR, ROUGHNESS, NORMAL = "textures/albedo.jpg", "textures/roughness.jpg", "textures/normal.png"
OWN = {"lashes": CARDS, WET: CARDS}  # materials off the atlas; hair has LOCKS
GLOSS = 0.1  # roughness of the tear line
CUT_OUT = "hair_cards"


class Looks:
    """Makes materials and binds them."""

    def __init__(self, stage: Usd.Stage, scope: str, pictures: Mapping[str, bytes]) -> None:
        self.stage, self.scope, self.pictures = stage, scope, pictures
        UsdGeom.Scope.Define(stage, scope)

    def bind(self, mesh: UsdGeom.Mesh, material: UsdShade.Material) -> None:
        """Bind a material to a mesh, in the layer or variant that is edited."""
        UsdShade.MaterialBindingAPI.Apply(mesh.GetPrim()).Bind(material)

    def material(self, look: str, name: str) -> UsdShade.Material:
        """The material of a surface in one of VARIANTS."""
        material = UsdShade.Material.Define(self.stage, f"{self.scope}/{name}_{look}")
        place = f"{material.GetPath()}/st"
        reader = UsdShade.Shader.Define(self.stage, place)
        reader.CreateIdAttr("UsdPrimvarReader_float2")
        reader.CreateInput("varname", Sdf.ValueTypeNames.String).Set("st")
        self.reader = reader.CreateOutput("result", Sdf.ValueTypeNames.Float2)
        shader = UsdShade.Shader.Define(self.stage, f"{material.GetPath()}/surface")
        shader.CreateIdAttr("UsdPreviewSurface")
        hair = name.startswith("hair")
        own = LOCKS if hair else OWN.get(name)
        color = self._texture(material, own or (ATLAS if look == PHOTO else COLOR), "sRGB")
        if own:
            _opacity(shader, color, name)
        if look == PHOTO or name == WET:
            _give_off(shader, color, name)
        else:
            self._shone_on(material, shader, color, name)
        surface = shader.CreateOutput("surface", Sdf.ValueTypeNames.Token)
        material.CreateSurfaceOutput().ConnectToSource(surface)
        return material

    def _shone_on(self, material, shader, color, name):
        _join(shader, "diffuseColor", Sdf.ValueTypeNames.Color3f, color, "rgb")
        _set(shader, "ior", REFRACTION.get(name, 1.5))
        if name != RELIEF:
            _set(shader, "roughness", ROUGH.get(name, HAIR_ROUGH))
            return
        rough = self._texture(material, ROUGHNESS, "raw")
        _join(shader, "roughness", Sdf.ValueTypeNames.Float, rough, "g")
        normal = self._texture(material, NORMAL, "raw")
        normal.CreateInput("scale", Sdf.ValueTypeNames.Float4).Set(Gf.Vec4f(2, 2, 2, 1))
        normal.CreateInput("bias", Sdf.ValueTypeNames.Float4).Set(Gf.Vec4f(-1, -1, -1, 0))
        _join(shader, "normal", Sdf.ValueTypeNames.Normal3f, normal, "rgb")

    def _texture(self, material, file, space):
        name = file.partition("/")[2].partition(".")[0]
        texture = UsdShade.Shader.Define(self.stage, f"{material.GetPath()}/{name}")
        texture.CreateIdAttr("UsdUVTexture")
        texture.CreateInput("file", Sdf.ValueTypeNames.Asset).Set(file)
        texture.CreateInput("st", Sdf.ValueTypeNames.Float2).ConnectToSource(self.reader)
        for wrap in ("wrapS", "wrapT"):
            texture.CreateInput(wrap, Sdf.ValueTypeNames.Token).Set("clamp")
        texture.CreateInput("sourceColorSpace", Sdf.ValueTypeNames.Token).Set(space)
        return texture


def _give_off(shader, color, name):
    """Show a texture as it is: nothing is mirrored but by the tear line."""
    _join(shader, "emissiveColor", Sdf.ValueTypeNames.Color3f, color, "rgb")
    shader.CreateInput("diffuseColor", Sdf.ValueTypeNames.Color3f).Set(Gf.Vec3f(0))
    _set(shader, "roughness", GLOSS if name == WET else 1.0)
    if name != WET:
        shader.CreateInput("useSpecularWorkflow", Sdf.ValueTypeNames.Int).Set(1)
        shader.CreateInput("specularColor", Sdf.ValueTypeNames.Color3f).Set(Gf.Vec3f(0))


def _opacity(shader, color, name):
    _join(shader, "opacity", Sdf.ValueTypeNames.Float, color, "a")
    if name == CUT_OUT:
        _set(shader, "opacityThreshold", CUT)


def _join(shader, name, kind, texture, channel):
    """Read an input of a shader from a channel of a texture."""
    made = Sdf.ValueTypeNames.Float3 if channel == "rgb" else Sdf.ValueTypeNames.Float
    shader.CreateInput(name, kind).ConnectToSource(texture.CreateOutput(channel, made))


def _set(shader, name, value):
    shader.CreateInput(name, Sdf.ValueTypeNames.Float).Set(float(value))
