"""Hair as a layer on the skin: photographed where it shows, continued over the scalp."""

import numpy as np

from bakery.heads.base import HeadModel
from bakery.stages.atlas import Atlas, Visibility
from bakery.stages.texture.hair import Mattes, hair_layer


class HairLayer:
    """See bakery.hair.base.Hair."""

    name = "layer"
    sha256 = ""

    def layer(
        self,
        linear: np.ndarray,
        mattes: Mattes,
        head: HeadModel,
        atlas: Atlas,
        visibility: Visibility,
    ) -> np.ndarray:
        """See bakery.hair.base.Hair."""
        return hair_layer(linear, mattes, head, atlas, visibility)


class NoHair:
    """A bald head, for hair that is made elsewhere. See bakery.hair.base.Hair."""

    name = "none"
    sha256 = ""

    def layer(
        self,
        linear: np.ndarray,
        mattes: Mattes,
        head: HeadModel,
        atlas: Atlas,
        visibility: Visibility,
    ) -> np.ndarray:
        """See bakery.hair.base.Hair."""
        return np.zeros((atlas.size, atlas.size, 4), np.float32)
