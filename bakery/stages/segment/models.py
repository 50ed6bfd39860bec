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
        guide: three planes [3, H, W] float32 0..1.
        radius: pixels, half the side of the window.
        epsilon: variance of the guide below which it counts as flat.

    References:
        He, Sun, Tang, "Guided Image Filtering", IEEE TPAMI 35(6), 2013.
    """

    def __init__(self, guide, radius, epsilon):
        self.guide = guide
        self.radius = radius
        self.mean = [self._box(plane) for plane in guide]
        a, b, c, d, e, f = (
            self._box(guide[i] * guide[j]) - self.mean[i] * self.mean[j] + epsilon * (i == j)
            for i, j in ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))
        )
        first = [d * f - e * e, c * e - b * f, b * e - c * d]
        rest = [a * f - c * c, b * c - a * e, a * d - b * b]
        scale = 1 / (a * first[0] + b * first[1] + c * first[2])
        self.inverse = [entry * scale for entry in first + rest]  # covariance, upper triangle

    def _box(self, plane):
        side = 2 * self.radius + 1
        return cv2.blur(plane, (side, side), borderType=cv2.BORDER_REFLECT)

    def coefficients(self, plane):
        """The local linear model of one map.

        Args:
            plane: [H, W] float32.

        Returns:
            [4, H, W]: three slopes, one a guide plane, and the offset.
        """
        mean = self._box(plane)
        x, y, z = (
            self._box(plane * guide) - center * mean for guide, center in zip(self.guide, self.mean)
        )
        xx, xy, xz, yy, yz, zz = self.inverse
        slopes = [xx * x + xy * y + xz * z, xy * x + yy * y + yz * z, xz * x + yz * y + zz * z]
        offset = mean - sum(slope * center for slope, center in zip(slopes, self.mean))
        return np.stack([self._box(entry) for entry in (*slopes, offset)])

    def __call__(self, plane):
        """Filter one map [H, W]."""
        model = self.coefficients(plane)
        return model[3] + sum(slope * guide for slope, guide in zip(model, self.guide))
