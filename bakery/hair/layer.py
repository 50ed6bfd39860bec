"""Hair as a layer on the skin: photographed where it shows, continued over the scalp."""

import numpy as np

from bakery.heads.base import HeadModel
from bakery.stages.atlas import Atlas, Visibility
from bakery.stages.segment import Segmentation
from bakery.stages.texture.hair import SQUARE, Mattes, hair_layer
from bakery.types import Fit, HairMesh, Photo


class HairLayer:
    """See bakery.hair.base.Hair."""

    name = "layer"
    sha256 = ""
    square = SQUARE

    def layer(
        self,
        linear: np.ndarray,
        mattes: Mattes,
        head: HeadModel,
        atlas: Atlas,
        visibility: Visibility,
    ) -> np.ndarray:
        """See bakery.hair.base.Hair."""
        return hair_layer(linear, mattes, head, atlas, visibility, self.square)

    def mesh(
        self,
        photo: Photo,
        segmentation: Segmentation,
        fit: Fit,
        head: HeadModel,
        neutral: np.ndarray,
    ) -> HairMesh | None:
        """None: what there is is on the skin."""
        return None


class NoHair(HairLayer):
    """A bald head, for hair that is made elsewhere. See bakery.hair.base.Hair."""

    name = "none"

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
