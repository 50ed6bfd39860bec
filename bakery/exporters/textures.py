"""Textures for film renderers: one OpenEXR file an expression, tiled, with mipmaps."""

from pathlib import Path
from typing import Any

import numpy as np

from bakery.formats.texture import ACESCG, REC709_COLORS, write_texture
from bakery.runtime.avatar import Avatar
from bakery.runtime.blend import lay_hair
from bakery.types import EXPRESSIONS

MASKS = "masks"  # folder of what says where each expression acts


class TexturesExporter:
    """A folder of textures. See exporters.base.Exporter.

    `neutral.exr` and one of each key expression, as `smile.exr`, with the lashes and the hair that lies
    on the skin; `albedo.exr` where the bundle has it; masks/jawOpen.exr and so on, one channel each.
    """

    name, sha256, suffix, place = "textures", "", "", "exports/textures"
    colors = REC709_COLORS

    def export(self, avatar: Avatar, target: Path, size: int) -> dict[str, Any]:
        """See exporters.base.Exporter."""
        textures = avatar.textures
        (target / MASKS).mkdir(parents=True, exist_ok=True)
        for name, texture in zip(
            ("neutral", *textures.key_names), (textures.neutral, *textures.keys)
        ):
            laid = lay_hair(np.asarray(texture, np.float32), textures.hair)
            write_texture(target / f"{name}.exr", laid, size, self.colors)
        if len(textures.albedo):
            write_texture(target / "albedo.exr", textures.albedo, size, self.colors)
        for name, mask in zip(EXPRESSIONS, avatar.masks):
            write_texture(target / MASKS / f"{name}.exr", mask, size)
        return {}


class AcesTexturesExporter(TexturesExporter):
    """The same in ACEScg."""

    name, place = "textures-acescg", "exports/textures-acescg"
    colors = ACESCG
