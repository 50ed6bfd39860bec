"""Hair with volume: cards over a cap, and the colour of the scalp below them on the skin."""

import cv2
import numpy as np

from bakery.geometry.fill import smoothstep, sparse_blur
from bakery.hair.layer import HairLayer
from bakery.heads.base import HeadModel
from bakery.stages.atlas import Atlas, Visibility
from bakery.stages.hair import make_hair
from bakery.stages.hair.presence import SQUARE
from bakery.stages.segment import Segmentation
from bakery.stages.texture.growth import before_ears, forehead, growth_on
from bakery.stages.texture.hair import Mattes, loose
from bakery.types import Fit, HairMesh, Photo

LOOSE = 64  # share of the atlas around what is cut off that goes with it
BESIDE = 30  # share of the atlas over which the layer fades out beside the scalp


class CardHair(HairLayer):
    """See bakery.hair.base.Hair."""

    name = "cards"
    square = SQUARE  # cards lie over what the layer has at a slant

    def layer(
        self,
        linear: np.ndarray,
        mattes: Mattes,
        head: HeadModel,
        atlas: Atlas,
        visibility: Visibility,
    ) -> np.ndarray:
        """See bakery.hair.base.Hair; what hangs before cheeks, ears and neck is left to the cards.

        A fringe lies on the forehead, which is seen squarely: there the photo shows it best. Sideburns
        are short, and end softly.
        """
        growth = growth_on(head, atlas)
        near = sparse_blur(growth, atlas.size / BESIDE)
        kept = np.maximum(growth, smoothstep(0.05, 0.3, near))
        kept = np.maximum(kept, forehead(head, atlas.size))
        kept = np.maximum(kept, before_ears(head, atlas)).astype(np.float32)
        layer: np.ndarray = super().layer(linear, mattes, head, atlas, visibility)
        layer = layer * kept[..., None]
        cut_off = loose(layer[..., 3], growth)  # ends of locks whose rest hangs from the cards
        cut_off = cv2.dilate(cut_off, np.ones((atlas.size // LOOSE,) * 2, np.uint8))
        return layer * (1 - cv2.GaussianBlur(cut_off, (0, 0), atlas.size / LOOSE / 4))[..., None]

    def mesh(
        self,
        photo: Photo,
        segmentation: Segmentation,
        fit: Fit,
        head: HeadModel,
        neutral: np.ndarray,
    ) -> HairMesh | None:
        """See bakery.hair.base.Hair."""
        return make_hair(photo.encoded, segmentation, fit, head, neutral)
