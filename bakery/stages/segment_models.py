"""Colour statistics and the edge-aware filter of the segmentation."""

import cv2
import numpy as np

LAB_BINS = (24, 28, 28)  # lightness over 0..100, a and b over -28..44 where faces and hair lie
_LOW, _HIGH = -28.0, 44.0
_KERNEL = np.float32([1, 4, 6, 4, 1]) / 16


def lab_bins(lab):
    """Index of the colour bin of each pixel.

    Args:
        lab: [H, W, 3] float32 CIE Lab.

    Returns:
        [H, W] int32 into a histogram of `LAB_BINS`.
    """
    scale = np.float32([LAB_BINS[0] / 100, *(n / (_HIGH - _LOW) for n in LAB_BINS[1:])])
    bins = ((lab - np.float32([0, _LOW, _LOW])) * scale).astype(np.int32)
    lightness, a, b = (np.clip(bins[..., i], 0, LAB_BINS[i] - 1) for i in range(3))
    return (lightness * LAB_BINS[1] + a) * LAB_BINS[2] + b


def histogram(bins, weights, shape):
    """A smoothed probability per bin.

    Args:
        bins: [H, W] int into an array of `shape`.
        weights: [H, W] >= 0, how far each pixel belongs to the class.
        shape: bins along each axis.

    Returns:
        flat float32 array that sums to one, or to zero without weight.
    """
    counts = np.bincount(bins.ravel(), weights.ravel(), minlength=int(np.prod(shape)))
    counts = counts.astype(np.float32).reshape(shape)
    for axis in range(len(shape)):
        lines = np.moveaxis(counts, axis, -1)
        flat = np.ascontiguousarray(lines).reshape(-1, shape[axis])
        flat = cv2.filter2D(flat, -1, _KERNEL[None], borderType=cv2.BORDER_REPLICATE)
        counts = np.moveaxis(flat.reshape(lines.shape), -1, axis)
    return (counts / max(counts.sum(), 1e-6)).ravel()


class GuidedFilter:
    """Smooth maps so that their edges follow those of a colour picture.

    Args:
        guide: [H, W, 3] float32 0..1.
        radius: pixels, half the side of the window.
        epsilon: variance of the guide below which it counts as flat.

    References:
        He, Sun, Tang, "Guided Image Filtering", IEEE TPAMI 35(6), 2013.
    """

    def __init__(self, guide, radius, epsilon):
        self.guide = guide
        self.radius = radius
        self.mean = self._box(guide)
        products = guide[..., [0, 0, 0, 1, 1, 2]] * guide[..., [0, 1, 2, 1, 2, 2]]
        squares = self._box(np.ascontiguousarray(products[..., [0, 3, 5]]))
        crosses = self._box(np.ascontiguousarray(products[..., [1, 2, 4]]))
        m0, m1, m2 = (self.mean[..., i] for i in range(3))
        a, d, f = (squares[..., i] - self.mean[..., i] ** 2 + epsilon for i in range(3))
        b, c, e = crosses[..., 0] - m0 * m1, crosses[..., 1] - m0 * m2, crosses[..., 2] - m1 * m2
        rows = [d * f - e * e, c * e - b * f, b * e - c * d]
        rows += [a * f - c * c, b * c - a * e, a * d - b * b]
        determinant = a * rows[0] + b * rows[1] + c * rows[2]
        self.inverse = [row / determinant for row in rows]  # of the covariance; upper triangle

    def _box(self, picture):
        side = 2 * self.radius + 1
        blurred = cv2.blur(picture, (side, side), borderType=cv2.BORDER_REFLECT)
        return blurred.reshape(picture.shape)

    def coefficients(self, maps):
        """The local linear model of each map.

        Args:
            maps: [H, W, C] float32, C <= 4.

        Returns:
            three slopes [H, W, C], one a guide channel, and the offset [H, W, C].
        """
        mean = self._box(maps)
        x, y, z = (
            self._box(maps * self.guide[..., i, None]) - self.mean[..., i, None] * mean
            for i in range(3)
        )
        xx, xy, xz, yy, yz, zz = (entry[..., None] for entry in self.inverse)
        slopes = (xx * x + xy * y + xz * z, xy * x + yy * y + yz * z, xz * x + yz * y + zz * z)
        offset = mean - sum(slope * self.mean[..., i, None] for i, slope in enumerate(slopes))
        return [self._box(slope) for slope in slopes], self._box(offset)

    def __call__(self, maps):
        """Filter [H, W, C] maps, C <= 4."""
        slopes, offset = self.coefficients(maps)
        return offset + sum(slope * self.guide[..., i, None] for i, slope in enumerate(slopes))
