"""The plug-in point for hair; entry point group `bakery.hair`."""

from typing import Protocol

import numpy as np

from bakery.heads.base import HeadModel
from bakery.stages.atlas import Atlas, Visibility
from bakery.stages.segment import Segmentation
from bakery.stages.texture.hair import Mattes
from bakery.types import Fit, HairMesh, Photo


class Hair(Protocol):
    """Makes what lies over the skin of a head. One instance serves any number of people."""

    name: str
    sha256: str  # over the data that its answers depend on; "" without any

    def layer(
        self,
        linear: np.ndarray,
        mattes: Mattes,
        head: HeadModel,
        atlas: Atlas,
        visibility: Visibility,
    ) -> np.ndarray:
        """The hair on the atlas: [T, T, 4] float32, scene-linear, colour multiplied by alpha.

        Args:
            linear: [H, W, 3] float32, the photo cut to the head, scene-linear.
            mattes: what of the photo is skin and hair.
            head: the head of the person.
            atlas: Atlas of the head's skin; T is its size.
            visibility: where the photo's camera sees the texels of that atlas.
        """

    def mesh(
        self,
        photo: Photo,
        segmentation: Segmentation,
        fit: Fit,
        head: HeadModel,
        neutral: np.ndarray,
    ) -> HairMesh | None:
        """The hair that stands off the head; None: the layer is all there is.

        Args:
            photo: the whole photo.
            segmentation: of the photo.
            fit: of the photo.
            head: the head of the person.
            neutral: [V, 3] mm, the person's neutral shape.
        """
