"""A neutral texture from several photos of one person: each region from the photo that sees it best.

The leading photo gives the face. Where it sees the skin at a slant or not at all, as a cheek or an
ear, a photo from that side takes over, in the leading photo's colours.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np

from bakery.geometry.fill import diffuse, smoothstep
from bakery.heads.base import HeadModel
from bakery.stages.atlas import make_atlas, make_view, soften, visibility_of
from bakery.stages.segment import Segmentation
from bakery.stages.texture.complete import OBSERVED, log_ratio
from bakery.stages.texture.neutral import Prepared
from bakery.types import Fit, Landmarks, Photo

# Degrees from which on skin is seen badly, and up to which it is seen well.
GRAZING, FULL = 75.0, 50.0
BETTER = (0.05, 0.35)  # how much better another photo must see a texel to take part, to take over
SEAM = 1 / 150  # of the atlas's side: blur of the border between two photos


@dataclass(frozen=True, eq=False)
class PhotoView:
    """One photo of a person with what was found in it."""

    photo: Photo
    landmarks: Landmarks
    fit: Fit
    segmentation: Segmentation


def quality(
    head: HeadModel, neutral: np.ndarray, prepared: Prepared, fit: Fit, resolution: int
) -> np.ndarray:
    """How well a photo sees each texel of the skin: [T, T] float32 0..1.

    Args:
        prepared: of this photo; what it did not observe counts 0.
    """
    on_skin = make_atlas(head, resolution).take("skin")
    vertices = head.vertices(neutral, fit.expression, fit.gaze)
    visibility = visibility_of(on_skin, make_view(vertices, head, fit.camera, edge=0.75))
    facing = on_skin.paint(visibility.weight(GRAZING, FULL))
    good: np.ndarray = facing * prepared.facing * (prepared.source == OBSERVED)
    return good


def merged(lead: Prepared, others: Sequence[Prepared], qualities: Sequence[np.ndarray]) -> Prepared:
    """The leading photo's texture, filled by the others where they see better.

    Args:
        lead: of the leading photo; others: of the others, of the same head.
        qualities: [T, T] of the leading photo and of each other, see `quality`.
    """
    texture, source, facing = lead.subject.texture, lead.source.copy(), lead.facing
    best = qualities[0]
    skin = (lead.source > 0).astype(np.float32)
    for other, good in zip(others, qualities[1:]):
        share = smoothstep(*BETTER, good - best).astype(np.float32)
        share = soften(cv2.GaussianBlur(share, (0, 0), SEAM * len(share)), skin)
        share = np.where(good > 0, share, 0).astype(np.float32)
        # Light and lens differ between photos: what both see says by how much, and the seam most.
        both = np.minimum(np.minimum(good, best) * 4, 1)
        if not both.any():
            continue
        ratio = log_ratio(_smooth(texture, both), _smooth(other.subject.texture, both))
        matched = other.subject.texture * np.exp(diffuse(ratio, both))
        texture = texture + share[..., None] * (matched - texture)
        source[share >= 0.5] = OBSERVED
        facing = np.maximum(facing, share * other.facing)
        best = np.maximum(best, share * good)
    return replace(
        lead, subject=replace(lead.subject, texture=texture), source=source, facing=facing
    )


def _smooth(texture: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Colours without detail, of texels of some weight [T, T] alone: [T, T, 3]."""
    sigma = len(weight) / 60
    total = cv2.GaussianBlur(texture * weight[..., None], (0, 0), sigma)
    mass = cv2.GaussianBlur(weight, (0, 0), sigma)
    out: np.ndarray = total / np.maximum(mass, 1e-4)[..., None]
    return out
