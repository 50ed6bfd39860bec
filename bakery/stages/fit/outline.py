"""Ears, skull, jaw corners and neck of a person, by what the photo's labels show outside the face.

One rule for the whole outline: it may lie neither in the background nor within bare skin. Hair and
clothes hide where it is: there the statistics of people decide, and weaker rules of skull and neck.
A bare ear's own edge pulls as well.

References:
    Blanz and Vetter, "A Morphable Model for the Synthesis of 3D Faces", SIGGRAPH 1999: maximum a
    posteriori; Keller, Knothe and Vetter, "3D Reconstruction of Human Faces from Occluding Contours",
    MIRAGE 2007: distance to the contour.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from bakery.geometry import camera as cameras
from bakery.geometry import rotation
from bakery.geometry.fill import smoothstep
from bakery.geometry.raster import rasterize
from bakery.geometry.solve import minimize_box
from bakery.heads.base import HeadModel
from bakery.heads.outline import CHIN, JAW_CORNER, NAMES, TRAGUS, outline_basis
from bakery.stages.segment.classes import BACKGROUND, BEARD, EARS, HAIR, NECK, SKIN
from bakery.stages.segment.frame import frame_box
from bakery.stages.segment.prior import face_frame
from bakery.types import Camera, Fit

# Mean, standard deviation and bounds of people's coefficients, mm (`heads.outline.NAMES`): learned by
# expectation and maximisation from 48 photos of london/train and 60 of congress/train, but for the skull,
# which hair hides: a head is 1.7 times as broad as its outer eye corners are apart.
STATISTICS = {
    "skull_width": (3.0, 3.5, -5, 11),
    "crown_width": (2.0, 3.0, -6, 10),
    "skull_height": (0.0, 6.0, -14, 14),
    "skull_depth": (0.0, 6.0, -14, 14),
    "jaw_width": (0.2, 3.5, -7, 8),
    "neck_width": (8.5, 4.6, -8, 22),
    "neck_taper": (-4.0, 5.0, -10, 15),
    "shoulder_drop": (24.0, 10.0, -10, 45),
    "shoulder_width": (8.2, 8.0, -15, 20),
    "ear_size": (9.5, 5.5, -6, 18),
    "ear_out": (4.2, 4.8, -8, 13),
    "ear_drop": (4.6, 3.3, -6, 10),
    "ear_lobe": (0.5, 2.8, -4, 6),
}  # fmt: skip
LEARNED_WITH = "makehuman"
ALIKE = 0.9  # correlation of a person's two ears
STEPS = 5
PIXEL = 1.0  # mm at the face, of the picture in which outlines are compared
SAMPLE = 2  # pixels between the points of an outline
NOISE, PATCH = 1.8, 10.0  # mm, error of an outline, and length over which its errors are alike
FAR = 5.0  # mm; errors beyond count in proportion, not squared
THIN_HAIR = 4.0  # mm that hair stands off the skull's outline at least
CROPPED, STUBBLE = 9.0, 1.0  # mm; hair less high is drawn on the skin: the skull goes up to its rim
HIDDEN_NECK, HIDDEN_NOISE = 25.0, 4.0  # mm of a neck that hair may hide, error of what is seen
FARTHEST = np.float32(80)  # pixels; nothing is looked for farther away
LEAST_EAR = 12  # pixels of an ear's edge before background; fewer are a guess


@dataclass(frozen=True, eq=False)
class Seen:
    """One photo of a person, for `fit_outline`."""

    fit: Fit
    shape: np.ndarray  # [V, 3] mm, as the photo shows it, without outline
    labels: np.ndarray  # [H, W] uint8 into segment.LABELS
    points: np.ndarray  # [L, 2] pixels, the landmarks


def population(head: HeadModel) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Mean [O], covariance [O, O], lower and upper bounds [O] of people's outlines, mm.

    How the mean head differs from people was learned of the built-in one; another is taken as it is.
    """
    table = np.array([STATISTICS[name.rsplit("_left")[0].rsplit("_right")[0]] for name in NAMES])
    alike = np.eye(len(NAMES))
    for here, name in enumerate(NAMES):
        if name.endswith("_left"):
            there = NAMES.index(name.removesuffix("left") + "right")
            alike[here, there] = alike[there, here] = ALIKE
    mean = table[:, 0] * (head.name == LEARNED_WITH)
    return mean, alike * np.outer(table[:, 1], table[:, 1]), table[:, 2], table[:, 3]


def fit_outline(head: HeadModel, photos: Sequence[Seen]) -> np.ndarray:
    """The outline of one person: [O] mm, see `heads.outline`.

    What no photo shows is that of the average person; a side that is not seen follows the other.

    Args:
        head: HeadModel; photos: of one person, at least one.
    """
    mean, covariance, low, high = population(head)
    precision = np.linalg.inv(covariance)
    scenes = [_Scene(head, photo) for photo in photos]
    outline = mean.copy()
    for _ in range(STEPS):
        hessian, gradient = precision.copy(), precision @ (outline - mean)
        for scene in scenes:
            rows, misses, weights = scene.rows(outline)
            hessian += rows.T @ (rows * weights[:, None])
            gradient += rows.T @ (misses * weights)
        outline = outline + minimize_box(hessian, gradient, low - outline, high - outline)
    return np.clip(outline, low, high)


class _Scene:
    """What one photo's labels say of outlines, in a picture of its own."""

    def __init__(self, head, photo):
        self.head, self.photo, self.basis = head, photo, outline_basis(head)
        self.fields = np.zeros((len(head.mean), len(NAMES), 3), np.float32)
        self.fields[self.basis.rows] = self.basis.fields.transpose(1, 0, 2)
        self.faces = head.faces[head.part_faces("skin")]
        self.marks = head.landmarks(head.mean)
        camera = photo.fit.camera
        ends = cameras.project(photo.shape[np.unique(self.faces)].astype(np.float64), camera)
        scale = 1 / (PIXEL * cameras.pixels_per_mm(camera))
        corner = ends.min(0) - 40 / scale
        size = np.ceil(np.ptp(ends, axis=0) * scale + 80).astype(int).clip(8, 1500)
        self.camera: Camera = cameras.crop(camera, *corner, *size, scale)
        self._read_labels(corner, scale)

    def _read_labels(self, corner, scale):
        """Signed distances to what an outline may not enter."""
        height, width = self.photo.labels.shape
        seen = np.zeros((height, width), np.uint8)
        left, top, right, bottom = frame_box(face_frame(self.photo.points), (height, width))
        seen[top:bottom, left:right] = 1
        size = (self.camera.width, self.camera.height)
        affine = np.array([[scale, 0, -corner[0] * scale], [0, scale, -corner[1] * scale]])
        affine[:, 2] += 0.5 * scale - 0.5  # pixel centres lie at +0.5
        labels, known = (
            cv2.warpAffine(plane, affine, size, flags=cv2.INTER_NEAREST)
            for plane in (self.photo.labels, seen)
        )
        self.labels = np.where(known > 0, labels, 255)
        empty = self.labels == BACKGROUND
        self.ear_edge = (self.labels == EARS) & (
            cv2.dilate(empty.astype(np.uint8), np.ones((3, 3))) > 0
        )
        outside, self.cover = _distance(empty), _distance(~empty)
        self.bounds = {  # of an ear, of the jaw, of anything else
            kind: _slope(outside - np.maximum(_distance(np.isin(self.labels, bare)) - 1, 0))
            for kind, bare in (
                ("ear", (SKIN, EARS, NECK)), ("jaw", (SKIN,)), ("other", (SKIN, NECK, BEARD)),
            )
        }  # fmt: skip
        self.hair = _slope(-self.cover)
        self.beside = _slope(_distance(~np.isin(self.labels, (SKIN, NECK, BEARD))))

    def rows(self, outline):
        """What the labels ask of the outline's coefficients.

        Returns:
            Jacobian [N, O], misses [N] mm, weights [N].
        """
        moved = self.photo.shape.astype(np.float64)
        moved[self.basis.rows] += np.tensordot(outline, self.basis.fields, 1)
        inside = cameras.to_camera(moved, self.camera)
        pixels = cameras.project_camera(inside, self.camera)
        size = (self.camera.height, self.camera.width)
        drawn = rasterize(pixels, -inside[:, 2], self.faces, size)
        x, y = _rim(drawn.face >= 0).T
        corners, share = self.faces[drawn.face[y, x]], drawn.barycentric[y, x].astype(np.float64)
        place = np.einsum("nk,nkc->nc", share, inside[corners])
        moves = np.einsum("nk,nkoc->noc", share, self.fields[corners])
        turned = moves @ rotation.matrix(self.camera.rotation).T
        slide = np.einsum("nac,noc->nao", cameras.projection_jacobian(place, self.camera), turned)
        mean = np.einsum("nk,nkc->nc", share, self.head.mean[corners])
        ear = np.einsum("nk,nk->n", share, self.basis.ear[corners]) > 0.5
        rules = (self._kept_out, self._under_hair, self._beside_hair)
        found = [rule(x, y, slide, mean, ear) for rule in rules]
        found += [self._ear(x, y, slide, ear & (side * mean[:, 0] > 0), side) for side in (1, -1)]
        return tuple(np.concatenate(parts) for parts in zip(*found))

    def _kept_out(self, x, y, slide, mean, ear):
        """Points of the outline that lie in the background or within bare skin."""
        chin, corner = self.marks[CHIN, 1], self.marks[JAW_CORNER[0]]
        jaw = ~ear & (mean[:, 1] > corner[1] - 12) & (mean[:, 2] > corner[2] - 30)
        miss, slope = np.zeros(len(x)), np.zeros((len(x), 2))
        for kind, these in (("ear", ear), ("jaw", jaw), ("other", ~ear & ~jaw)):
            values, grown = self.bounds[kind]
            miss[these], slope[these] = values[y, x][these], grown[y, x][these]
        # The bust ends where a person does not: that its rim lies on bare skin is no fault.
        weight = np.where(miss > 0, 1, smoothstep(chin - 70, chin - 35, mean[:, 1]))
        return _weighed(slide, miss, slope, weight * (self.labels[y, x] != 255), NOISE)

    def _under_hair(self, x, y, slide, mean, ear):
        """Points of the skull's outline that lie too near to the edge of the hair.

        Cropped hair hides next to nothing: it ends where the skull does.
        """
        values, slope = self.hair[0][y, x], self.hair[1][y, x]
        there = ~ear & (self.labels[y, x] == HAIR) & (mean[:, 1] > self.marks[TRAGUS[0], 1])
        if there.any() and np.percentile(-values[there], 80) < CROPPED / PIXEL:
            miss = values + STUBBLE / PIXEL
        else:
            miss = np.maximum(values + THIN_HAIR / PIXEL, 0)
        return _weighed(slide, miss, slope, there * 1.0, NOISE)

    def _beside_hair(self, x, y, slide, mean, ear):
        """Points of the neck's outline within hair: the neck that is seen is most of it as a rule."""
        values, slope = self.beside[0][y, x], self.beside[1][y, x]
        neck = ~ear & (mean[:, 1] < self.marks[JAW_CORNER[0], 1])
        there = neck & (self.labels[y, x] == HAIR) & (values < HIDDEN_NECK / PIXEL)
        return _weighed(slide, values, slope, there * 1.0, HIDDEN_NOISE)

    def _ear(self, x, y, slide, rim, side):
        """The photo's edge of an ear that the head's ear shall reach."""
        middle = cameras.project(np.zeros(3), self.camera)
        across = cameras.project(np.array([20.0 * side, 0, 0]), self.camera) - middle
        down, right = np.nonzero(self.ear_edge)
        edge = np.column_stack([right, down])[::SAMPLE]
        edge = edge[(edge - middle) @ across > 0]
        if len(edge) * SAMPLE < LEAST_EAR or not rim.any():
            return _weighed(slide[:0], np.zeros(0), np.zeros((0, 2)), np.zeros(0), NOISE)
        points, slide = np.column_stack([x, y])[rim], slide[rim]
        apart = edge[:, None] - points[None]
        nearest = (apart**2).sum(-1).argmin(1)
        apart = apart[np.arange(len(edge)), nearest].astype(np.float64)
        miss = np.linalg.norm(apart, axis=1)
        slope = apart / np.maximum(miss, 1e-9)[:, None]
        return _weighed(slide[nearest], -miss, slope, np.ones(len(edge)), NOISE)


def _weighed(slide, miss, slope, weight, noise):
    """Rows [N, O], misses [N] mm and weights [N] of points that shall move along slopes [N, 2]."""
    length = np.abs(miss) * PIXEL
    robust = np.minimum(1, FAR / np.maximum(length, 1e-9))
    rows = np.einsum("nao,na->no", slide, slope) * PIXEL
    per_point = SAMPLE * PIXEL / PATCH / noise**2
    return rows, miss * PIXEL, weight * robust * per_point * (miss != 0)


def _rim(mask):
    """Every SAMPLE-th pixel [N, 2] (column, row) of a mask's outline."""
    lines, _ = cv2.findContours(mask.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    return np.concatenate([line[::SAMPLE, 0] for line in lines] or [np.zeros((0, 2), int)])


def _distance(mask):
    """Pixels from each pixel of a mask to the nearest that is not of it, FARTHEST at most; 0 outside."""
    return np.minimum(cv2.distanceTransform(mask.astype(np.uint8), cv2.DIST_L2, 5), FARTHEST)


def _slope(values):
    """Values [H, W] and their gradient [H, W, 2] (right, down), of unit length."""
    smooth = cv2.GaussianBlur(values, (0, 0), 1.0)
    slope = np.stack([cv2.Sobel(smooth, cv2.CV_32F, 1, 0), cv2.Sobel(smooth, cv2.CV_32F, 0, 1)], -1)
    return values, slope / np.maximum(np.linalg.norm(slope, axis=-1, keepdims=True), 1e-6)
