"""The plug-in point for generators; entry point group `bakery.generators`."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from bakery.generators.eyes import EyeMaps
from bakery.generators.lids import LidSkin
from bakery.heads.base import HeadModel
from bakery.types import Conditions, Generated


@dataclass(frozen=True, eq=False)  # compared and hashed by identity: generators cache by it
class Subject:
    """One person, ready to be deformed."""

    head: HeadModel
    neutral: np.ndarray  # [V, 3] mm, the neutral shape with its residual warp
    texture: np.ndarray  # [T, T, 3] float32 linear, T_0 with its light; the whole atlas
    eyes: EyeMaps
    lids: LidSkin
    light: np.ndarray  # [9, 3] irradiance in the photo's camera space
    light_rotation: np.ndarray  # [3, 3] head space -> the photo's camera space
    # [S, S, 3] uint8 sRGB: the neutral face where the photo shows it, head only
    photo: np.ndarray | None = None


class Generator(Protocol):
    """Turns conditions into a picture of the subject. One instance serves any number of subjects.

    A generator may also have `get_ready(head)`: what its first picture of a person on this head would
    wait for. A bake calls it in a thread of its own while the neutral texture is made, maybe still
    while `generate` is called.
    """

    name: str
    source_type: str  # IPTC digital source type of what it makes
    sha256: str  # over the weights that its pictures depend on; "" without any

    def generate(
        self, subject: Subject, conditions: Conditions, interior_only: bool = False
    ) -> Generated:
        """Paint one target; same size and camera as the conditions.

        With `interior_only` the caller looks at eyes and mouth alone: skin may stay as it is.
        """
