"""Picture measures: arrays in, numbers out."""

import cv2
import numpy as np

from bakery.geometry.color import LUMA
from bakery.geometry.delaunay import delaunay
from bakery.geometry.fill import diffuse
from bakery.geometry.raster import rasterize
from bakery.geometry.sample import bilinear, interpolate


def psnr(a, b, mask):
    """Peak signal-to-noise ratio in dB of two sRGB-encoded pictures [H, W, 3] 0..1 inside a mask."""
    return float(-10 * np.log10(max(mse(a, b, mask), 1e-12)))


def mse(a, b, mask):
    """Mean squared error inside a mask, of values 0..1."""
    inside = np.asarray(mask, bool)
    return float(((np.asarray(a, np.float64) - b)[inside] ** 2).mean())


def ssim(a, b, mask):
    """Mean structural similarity of the luma inside a mask.

    References:
        Wang, Bovik, Sheikh and Simoncelli, IEEE TIP 13(4), 2004: 11x11 Gaussian of sigma 1.5,
        K1 = 0.01, K2 = 0.03.
    """
    x, y = (np.asarray(picture, np.float64) @ LUMA for picture in (a, b))

    def blur(values):
        return cv2.GaussianBlur(values, (11, 11), 1.5)

    mx, my = blur(x), blur(y)
    vx, vy, cov = blur(x * x) - mx**2, blur(y * y) - my**2, blur(x * y) - mx * my
    value = (2 * mx * my + 1e-4) * (2 * cov + 9e-4) / ((mx**2 + my**2 + 1e-4) * (vx + vy + 9e-4))
    return float(value[np.asarray(mask, bool)].mean())


def hull_mask(points, height, width):
    """Boolean [H, W]: inside the convex hull of points [n, 2] pixels."""
    mask = np.zeros((height, width), np.uint8)
    hull = cv2.convexHull(np.ascontiguousarray(points, np.float32))
    cv2.fillConvexPoly(mask, np.round(hull * 16).astype(np.int32), 1, shift=4)
    return mask.astype(bool)


def face_crop(points, size=512, ratio=0.78):
    """Affine [2, 3] from a photo to a square crop in which the points' height takes `ratio`."""
    low, high = points.min(0), points.max(0)
    scale = ratio * size / (high[1] - low[1])
    shift = size / 2 - scale * (low + high) / 2
    return np.array([[scale, 0, shift[0]], [0, scale, shift[1]]])


def warp_pixels(image, matrix, size):
    """Resample a picture by an affine of pixel coordinates whose centres lie at +0.5."""
    matrix = np.asarray(matrix, float).copy()
    matrix[:, 2] += 0.5 * matrix[:, :2].sum(1) - 0.5
    shrink = np.sqrt(abs(np.linalg.det(matrix[:, :2])))
    if shrink < 1:  # what is made smaller is blurred first, or it aliases
        image = cv2.GaussianBlur(image, (0, 0), 0.5 * np.sqrt(1 / shrink**2 - 1) + 1e-3)
    return cv2.warpAffine(image, matrix, (size, size), flags=cv2.INTER_LINEAR)


def piecewise_affine(image, source, target):
    """Warp a picture so that source points [n, 2] land on target points; Delaunay triangles.

    The baseline every avatar has to beat. The triangles' border is continued outside, since a hull
    drawn to whole pixels reaches a little beyond them.
    """
    height, width = image.shape[:2]
    faces = delaunay(target)
    found = rasterize(np.asarray(target, float), None, faces, (height, width))
    where = interpolate(found, np.asarray(source, np.float32)[faces])
    inside = (found.face >= 0).astype(np.float32)
    return diffuse(bilinear(image, where) * inside[..., None], inside)
