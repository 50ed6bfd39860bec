"""Hair as a layer on the skin: photographed where it shows, continued over the scalp."""

import numpy as np

from bakery.heads.base import HeadModel
from bakery.stages.atlas import Atlas, Sight
from bakery.stages.texture.hair import Cover, hair_layer


class HairLayer:
    """See bakery.hair.base.Hair."""

    name = "layer"
    sha256 = ""

    def layer(
        self, linear: np.ndarray, cover: Cover, head: HeadModel, atlas: Atlas, sight: Sight
    ) -> np.ndarray:
        """See bakery.hair.base.Hair."""
        return hair_layer(linear, cover, head, atlas, sight)


class NoHair:
    """A bald head, for hair that is made elsewhere. See bakery.hair.base.Hair."""

    name = "none"
    sha256 = ""

    def layer(
        self, linear: np.ndarray, cover: Cover, head: HeadModel, atlas: Atlas, sight: Sight
    ) -> np.ndarray:
        """See bakery.hair.base.Hair."""
        return np.zeros((atlas.size, atlas.size, 4), np.float32)
