"""The head as binary glTF, and the proxies that a player shows in place of mouth and eyes."""

from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from bakery import __version__
from bakery.export.glb import write_glb, write_proxies
from bakery.export.hair import Hair, both_sides, hair_levels
from bakery.export.lit import lit_pictures
from bakery.export.lod import RATIOS, proxy_surfaces
from bakery.export.manifest import describe_levels, levels_of_detail
from bakery.export.mouth import mouth_light
from bakery.export.rig import Rig
from bakery.export.skeleton import BONES, head_joints, head_weights
from bakery.export.web.files import card_picture, small_layer, small_picture
from bakery.formats import image
from bakery.formats.targets import OTHERS, other_weights
from bakery.heads.lashes import card_rectangle, card_texels
from bakery.runtime.avatar import Avatar
from bakery.runtime.blend import lay_hair
from bakery.types import EXPRESSIONS

QUALITY = 95  # of the JPEG inside
STEPS = np.array([63, 63, 63, 15])  # of colour and alpha of hair: half the bytes of 255, and unseen
MAKER = f"bakery {__version__}"


class GlbExporter:
    """Four levels of detail, 52 morph targets, bones, one texture. See exporters.base.Exporter."""

    name, sha256, suffix, place = "glb", "", ".glb", "head.glb"
    others: tuple[str, ...] = ()  # further morph targets, of formats.targets.OTHERS
    ratios: tuple[float, ...] = RATIOS  # of the triangles, a level of detail
    lit = False  # whether each surface has a second material, that lamps shine on

    def export(self, avatar: Avatar, target: Path, size: int) -> dict[str, Any]:
        """See exporters.base.Exporter."""
        mixes = [other_weights()[list(OTHERS).index(name)] for name in self.others]
        lit = lit_pictures(avatar, size) if self.lit else None
        levels = levels_of_detail(avatar.head, avatar.neutral, mixes, self.ratios, self.lit)
        picture, cards, hair = pictures(avatar, size, len(levels))
        if lit and hair:
            hair = both_sides(hair)
        shares = partial(head_weights, avatar.head, avatar.neutral)
        rig = Rig(head_joints(avatar.head, avatar.neutral), BONES, shares)
        write_glb(target, levels, EXPRESSIONS + self.others, picture, cards, MAKER, hair, rig, lit)
        return {"lods": describe_levels(levels, hair.levels if hair else ())}


class SpeechGlbExporter(GlbExporter):
    """The same with visemes and what else other programs ask for, as morph targets.

    The finest level has fewer triangles, so that the file stays below 10 MB.
    """

    name = "glb-speech"
    ratios = (0.8, 0.4, 0.15, 0.05)
    others = tuple(OTHERS)


class LitGlbExporter(GlbExporter):
    """The same with a lit variant of each material, a normal map, and tangents for it."""

    name = "glb-lit"
    lit = True


class FullGlbExporter(SpeechGlbExporter):
    """Both: visemes and the lit variant. Fewer triangles again, for the same 10 MB."""

    name = "glb-full"
    ratios = (0.6, 0.3, 0.12, 0.05)
    lit = True


def pictures(avatar: Avatar, size: int, levels: int) -> tuple[bytes, bytes | None, Hair | None]:
    """What a head's surfaces show: JPEG of the atlas, PNG of the lashes, hair; None where it has none.

    Args:
        size: texels on a side, at most.
        levels: how many levels of detail the hair is for.
    """
    head, textures = avatar.head, avatar.textures
    lit = textures.neutral * mouth_light(head, avatar.neutral, len(textures.neutral))
    atlas = small_picture(lay_hair(lit, textures.hair), size)
    cards = None
    if card_rectangle(head) is not None:
        sheet = textures.hair[card_texels(head, len(textures.hair))]
        cards = image.encode_image(card_picture(sheet), ".png")
    hair = None
    if textures.hair_mesh is not None:
        sheet = small_layer(textures.hair_mesh.texture, size)
        locks = hair_levels(textures.hair_mesh, levels)
        stepped = np.rint(card_picture(sheet) * STEPS) / STEPS
        hair = Hair(locks, image.encode_image(stepped.astype(np.float32), ".png"))
    return image.encode_image(atlas, ".jpg", QUALITY), cards, hair


class ProxiesExporter:
    """The mouth and eye proxies. See exporters.base.Exporter."""

    name, sha256, suffix, place = "proxies", "", ".glb", "proxies.glb"

    def export(self, avatar: Avatar, target: Path, size: int) -> dict[str, Any]:
        """See exporters.base.Exporter."""
        proxies = proxy_surfaces(avatar.head, avatar.neutral)
        write_proxies(target, proxies, EXPRESSIONS, MAKER)
        return {}
