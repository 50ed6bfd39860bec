"""The drawn folds of `wrinkles` in a picture, kept for each subject."""

import numpy as np

from bakery.generators.wrinkles import wrinkle_map, wrinkle_shading
from bakery.geometry.raster import rasterize
from bakery.geometry.sample import bilinear, interpolate
from bakery.memo import once_per_object

TEXELS = 512  # side of the map that holds the folds
# Blood is pressed aside in folds, so they redden: blue and green lose more than red.
TINT = np.array([0.86, 1.04, 1.08], np.float32)


class FoldMaps:
    """Folds of some kinds (`wrinkles.Line.name`; None: all) of any number of subjects."""

    def __init__(self, kinds=None):
        self.kinds, self._folds = kinds, once_per_object(self._drawn)

    def at(self, subject, conditions):
        """Log-ratio [H, W] of the folds in a target; to be multiplied by TINT."""
        head = subject.head
        index, folds = self._folds(subject)
        flat = np.zeros(TEXELS**2, np.float32)
        flat[index] = wrinkle_shading(folds, conditions.vertices)
        uv = interpolate(conditions.fragments, head.uv[head.uv_faces])
        return bilinear(flat.reshape(TEXELS, TEXELS), uv * TEXELS)

    def _drawn(self, subject):
        """The texels of a subject's face, by their number in the map, and the folds at them."""
        head, skin = subject.head, subject.head.part_faces("skin")
        found = rasterize(head.uv * TEXELS, None, head.uv_faces[skin], (TEXELS, TEXELS))
        index = np.flatnonzero(found.face.ravel() >= 0)
        corners = head.faces[skin[found.face.ravel()[index]]]
        weights = found.barycentric.reshape(-1, 3)[index]
        points = np.einsum("nk,nkc->nc", weights, subject.neutral[corners])
        near = np.linalg.norm(points, axis=1) < 160  # mm: the face, not the scalp's far side
        return index[near], wrinkle_map(head, subject.neutral, points[near], kinds=self.kinds)
