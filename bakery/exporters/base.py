"""The plug-in point for exporters; entry point group `bakery.exporters`."""

from pathlib import Path
from typing import Any, Protocol

from bakery.runtime.avatar import Avatar


class Exporter(Protocol):
    """Writes an avatar in one format. One instance serves any number of avatars.

    `bakery export` runs it over a bundle that is there; `bakery build` runs those that the preset's
    `bundle.formats` names while it writes a bundle.
    """

    name: str
    sha256: str  # over the data that its files depend on; "" without any
    suffix: str  # of the file that it writes, as ".glb"; "" if it writes a folder
    place: str  # where a bundle keeps it, as "head.glb" or "web"; of plug-ins "exports/..."

    def export(self, avatar: Avatar, target: Path, size: int) -> dict[str, Any]:
        """Write the avatar.

        The same avatar and size give the same bytes: no time, no path, no name of a user.

        Args:
            avatar: what is written; its head has the lashes of the person.
            target: the file, or the folder; its parent is there, it is not.
            size: texels on a side of textures, at most.

        Returns:
            what the manifest of a bundle says of it, by the manifest's own keys (`lods`, `web`); a
            plug-in gives {} or {"extras": {name: ...}}.

        Raises:
            BakeryError: the avatar cannot be written in this format.
        """
