"""A contact sheet on which a person can judge the avatar."""

from pathlib import Path
from typing import Any

from bakery.export.layout import PREVIEW
from bakery.formats import image
from bakery.runtime.avatar import Avatar
from bakery.runtime.contact_sheet import contact_sheet


class PreviewExporter:
    """The preview.png of a bundle. See exporters.base.Exporter."""

    name, sha256, suffix, place = "preview", "", ".png", PREVIEW

    def export(self, avatar: Avatar, target: Path, size: int) -> dict[str, Any]:
        """See exporters.base.Exporter."""
        image.write_image(target, contact_sheet(avatar))
        return {}
