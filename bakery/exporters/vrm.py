"""The head as VRM 1.0, for virtual meetings, streaming and social worlds."""

from pathlib import Path
from typing import Any

import numpy as np

from bakery.export.lod import head_surfaces
from bakery.export.vrm import write_vrm
from bakery.exporters.glb import MAKER, QUALITY, pictures
from bakery.formats import image
from bakery.formats.mark import IPTC
from bakery.runtime.avatar import Avatar
from bakery.runtime.contact_sheet import portraits
from bakery.types import EXPRESSIONS

THUMBNAIL = 512  # pixels on a side


class VrmExporter:
    """The finest level of detail on a person's bones. See exporters.base.Exporter."""

    name, sha256, suffix, place = "vrm", "", ".vrm", "exports/avatar.vrm"

    def export(self, avatar: Avatar, target: Path, size: int) -> dict[str, Any]:
        """See exporters.base.Exporter."""
        still = np.zeros(len(EXPRESSIONS), np.float32)
        (portrait,) = portraits(avatar, [(still, (0, 0), 0)], THUMBNAIL)
        write_vrm(
            target,
            avatar.head,
            avatar.neutral,
            head_surfaces(avatar.head, avatar.neutral),
            pictures(avatar, size, 1),
            image.encode_image(portrait, ".jpg", QUALITY),
            MAKER,
            IPTC + avatar.textures.maker.source_type,
        )
        return {}
