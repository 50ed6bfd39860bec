"""Hair with volume: cards over a cap, and the colour of the scalp below them on the skin."""

import cv2
import numpy as np

from bakery.geometry.fill import smoothstep
from bakery.hair.layer import HairLayer
from bakery.heads.base import HeadModel
from bakery.heads.scalp import BROW, EYE
from bakery.landmarks import OVAL
from bakery.stages.atlas import Atlas, Visibility, uv_polygon
from bakery.stages.hair import make_hair
from bakery.stages.segment import Segmentation
from bakery.stages.texture.hair import Mattes, growth_on
from bakery.types import Fit, HairMesh, Photo

BESIDE = 30  # share of the atlas over which the layer fades out beside the scalp
UP_TO_SCALP = 1.08  # of the face's contour: between it and the scalp nothing gapes


class CardHair(HairLayer):
    """See bakery.hair.base.Hair."""

    name = "cards"

    def layer(
        self,
        linear: np.ndarray,
        mattes: Mattes,
        head: HeadModel,
        atlas: Atlas,
        visibility: Visibility,
    ) -> np.ndarray:
        """See bakery.hair.base.Hair; what hangs before cheeks, ears and neck is left to the cards.

        A fringe lies on the forehead, which is seen squarely: there the photo shows it best.
        """
        growth = growth_on(head, atlas)
        near = cv2.GaussianBlur(growth, (0, 0), atlas.size / BESIDE)
        kept = np.maximum(growth, smoothstep(0.05, 0.3, near))
        kept = np.maximum(kept, _forehead(head, atlas.size)).astype(np.float32)
        layer: np.ndarray = super().layer(linear, mattes, head, atlas, visibility)
        return layer * kept[..., None]

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


def _forehead(head: HeadModel, size: int) -> np.ndarray:
    """1 within the face's contour above the brows [T, T], 0 from the eyes down."""
    eye, brow = (head.landmark_uv()[mark, 1] for mark in (EYE, BROW))
    down = (np.arange(size) + 0.5) / size
    inside = cv2.GaussianBlur(uv_polygon(head, OVAL, UP_TO_SCALP, size), (0, 0), size / 200)
    out: np.ndarray = inside * smoothstep(eye, brow, down)[:, None]
    return out
