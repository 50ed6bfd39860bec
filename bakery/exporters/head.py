"""The person as a head model of their own, for the reference player and for `--head`."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from bakery.export.layout import RIG
from bakery.heads.file import save_head
from bakery.runtime.avatar import Avatar


class HeadExporter:
    """The head.npz of a bundle: no identity modes, lids that close on these eyes."""

    name, sha256, suffix, place = "head", "", ".npz", RIG

    def export(self, avatar: Avatar, target: Path, size: int) -> dict[str, Any]:
        """See exporters.base.Exporter."""
        modes = np.zeros((0, *avatar.neutral.shape), np.float32)
        save_head(target, replace(avatar.head, mean=avatar.neutral, identity_basis=modes))
        return {}
