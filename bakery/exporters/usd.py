"""The head as USD, for film tools and Apple's: one .usdz file."""

import importlib.util
from functools import partial
from pathlib import Path
from typing import Any

from bakery.errors import InputError
from bakery.export.lit import lit_pictures
from bakery.export.lod import head_surfaces
from bakery.export.rig import Rig
from bakery.export.skeleton import BONES, head_joints, head_weights
from bakery.exporters.glb import MAKER, pictures
from bakery.formats.mark import IPTC
from bakery.runtime.avatar import Avatar
from bakery.types import EXPRESSIONS


class UsdExporter:
    """The finest level of detail, 52 blend shapes, bones, two looks. See exporters.base.Exporter."""

    name, sha256, suffix, place = "usd", "", ".usdz", "exports/avatar.usdz"

    def export(self, avatar: Avatar, target: Path, size: int) -> dict[str, Any]:
        """See exporters.base.Exporter."""
        if importlib.util.find_spec("pxr") is None:
            raise InputError(
                "USD needs usd-core, which is not installed: pip install 'bakery[usd]'"
            )
        from bakery.export import usd, usd_materials

        atlas, cards, hair = pictures(avatar, size, 1)
        lit = lit_pictures(avatar, size)
        shown = {
            usd_materials.ATLAS: atlas,
            usd_materials.CARDS: cards,
            usd_materials.LOCKS: hair and hair.picture,
            usd_materials.COLOR: lit.color,
            usd_materials.ROUGHNESS: lit.roughness,
            usd_materials.NORMAL: lit.normal,
        }
        shares = partial(head_weights, avatar.head, avatar.neutral)
        contents = usd.Contents(
            surfaces=head_surfaces(avatar.head, avatar.neutral),
            shape_names=EXPRESSIONS,
            locks=hair.levels[0] if hair else (),
            rig=Rig(head_joints(avatar.head, avatar.neutral), BONES, shares),
            pictures={file: data for file, data in shown.items() if data},
            told={
                "generator": MAKER,
                "digitalSourceType": IPTC + avatar.textures.maker.source_type,
            },
        )
        usd.write_usd(target, contents)
        return {}
