"""The avatar for browsers: small sRGB pictures, a packed head, one description."""

from pathlib import Path
from typing import Any

from bakery.export.layout import WEB
from bakery.export.web import WebOptions, web_files
from bakery.formats.files import write_bytes
from bakery.runtime.avatar import Avatar


class WebExporter:
    """The folder web/ of a bundle. See exporters.base.Exporter."""

    name, sha256, suffix, place = "web", "", "", WEB

    def __init__(self, options: WebOptions | None = None) -> None:
        self.options = options or WebOptions()

    def export(self, avatar: Avatar, target: Path, size: int) -> dict[str, Any]:
        """See exporters.base.Exporter."""
        files, table = web_files(avatar, self.options)
        for name, data in files.items():
            write_bytes(target / Path(name).relative_to(WEB), data)
        return {"web": table}
