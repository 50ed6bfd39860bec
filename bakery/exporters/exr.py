"""The textures as OpenEXR files: scene-linear half float, one part each."""

from pathlib import Path
from typing import Any

from bakery.export.bundle import write_textures
from bakery.runtime.avatar import Avatar


class ExrExporter:
    """A folder with the EXR files of a bundle. See exporters.base.Exporter."""

    name, sha256, suffix, place = "exr", "", "", "."

    def export(self, avatar: Avatar, target: Path, size: int) -> dict[str, Any]:
        """See exporters.base.Exporter."""
        target.mkdir(exist_ok=True)
        write_textures(target, avatar.textures, avatar.masks)
        return {}
