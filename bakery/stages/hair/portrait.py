"""The photo around a head, at the scale that hair is measured at."""

from dataclasses import dataclass

import cv2
import numpy as np

from bakery.geometry import camera as cameras
from bakery.geometry.color import to_linear
from bakery.geometry.fill import diffuse
from bakery.geometry.raster import rasterize
from bakery.heads.base import HeadModel
from bakery.stages.segment import BACKGROUND, CLOTHES, EARS, HAIR, HAT, Segmentation
from bakery.types import Camera, Fit

FINE = 1.6  # pixels a millimetre at most
ASIDE, ABOVE, BELOW = 190.0, 160.0, 330.0  # mm around the middle of the head that are looked at
SPECK = 60.0  # mm2: smaller patches of hair are mistakes
WISP = 5.0  # mm around the outline in which the photo says what is hair
INNER, HALO = 0.8, 3.0  # mm from what is no hair, and from the backdrop: nearer, colours are mixed
NOTHING = 1e5  # mm, depth where no head is


@dataclass(frozen=True, eq=False)
class Portrait:
    """What hair is made from; all pictures [H, W] of one camera."""

    camera: Camera
    scale: float  # pixels a millimetre, at the head
    hair: np.ndarray  # float32 0..1, how much of a pixel is hair
    solid: np.ndarray  # bool, what the labels call hair
    linear: np.ndarray  # [H, W, 3] float32, the photo
    color: np.ndarray  # [H, W, 3] float32 linear, hair continued beyond its outline
    behind: np.ndarray  # bool, background
    clothes: np.ndarray  # bool
    ears: np.ndarray  # bool
    known: np.ndarray  # bool, inside the photo and where it was labelled
    depth: np.ndarray  # float32 mm to the bare head, NOTHING where it is not

    def pixels(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Pixels [..., 2] and depths [...] mm of points [..., 3] in head space."""
        seen = cameras.to_camera(points, self.camera)
        depth = np.maximum(-seen[..., 2], 1.0)
        flat = cameras.project_camera(
            np.stack([seen[..., 0], seen[..., 1], -depth], -1), self.camera
        )
        return flat.astype(np.float32), depth

    def inside(self, pixels: np.ndarray) -> np.ndarray:
        """Whether pixels [..., 2] are known [...] bool."""
        height, width = self.known.shape
        x, y = pixels[..., 0], pixels[..., 1]
        return (x > 0) & (y > 0) & (x < width) & (y < height) & at(self.known, pixels)


def at(picture: np.ndarray, pixels: np.ndarray) -> np.ndarray:
    """The nearest values of a picture [H, W, ...] at pixels [..., 2]; its border goes on."""
    height, width = picture.shape[:2]
    column = np.clip(pixels[..., 0], 0, width - 1).astype(int)
    row = np.clip(pixels[..., 1], 0, height - 1).astype(int)
    found: np.ndarray = picture[row, column]
    return found


def look(
    encoded: np.ndarray, segmentation: Segmentation, fit: Fit, head: HeadModel, neutral: np.ndarray
) -> Portrait:
    """Cut the surroundings of a head out of its photo.

    Args:
        encoded: [H, W, 3] float32 sRGB-encoded photo.
        neutral: [V, 3] mm.
    """
    middle = neutral[head.part_vertices("skin")]
    middle = np.array([0.0, 0.0, (middle[:, 2].min() + middle[:, 2].max()) / 2])
    camera = fit.camera
    mm = float(camera.focal / max(-cameras.to_camera(middle, camera)[2], 1.0))
    x, y = cameras.project(middle, camera)
    scale = min(1.0, FINE / mm)
    corner = np.floor([x - ASIDE * mm, y - ABOVE * mm])
    size = np.ceil(np.array([2 * ASIDE, ABOVE + BELOW]) * mm * scale).astype(int)
    cut = cameras.crop(camera, *corner, *np.maximum(size, 8), scale)
    matrix = np.array([[scale, 0, -corner[0] * scale], [0, scale, -corner[1] * scale]])
    matrix[:, 2] += 0.5 * scale - 0.5
    frame = (cut.width, cut.height)

    def warped(plane, how=cv2.INTER_LINEAR):
        if scale < 1 and how == cv2.INTER_LINEAR:
            plane = cv2.GaussianBlur(plane, (0, 0), 0.5 * np.sqrt(1 / scale**2 - 1) + 1e-3)
        return cv2.warpAffine(plane, matrix, frame, flags=how)

    labels = warped(segmentation.labels, cv2.INTER_NEAREST)
    regions = warped(segmentation.regions, cv2.INTER_NEAREST)
    rows, columns = (np.flatnonzero(segmentation.labels.any(axis)) for axis in (1, 0))
    known = np.zeros(segmentation.labels.shape, np.uint8)
    if len(rows):  # labels end at a box around the face
        known[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1] = 1
        known[: rows[-1] + 1] = 1
    picture = np.clip(warped(np.ascontiguousarray(encoded, np.float32)), 0, 1)
    scale_mm = mm * scale
    solid = _large((regions == HAIR) & (labels != HAT), SPECK * scale_mm**2)
    hair = _matte(picture, solid, regions, scale_mm)
    linear = to_linear(picture)
    points = cameras.to_camera(neutral, cut)
    faces = head.faces[head.part_faces("skin", "eye_left", "eye_right")]
    found = rasterize(
        cameras.project_camera(points, cut),
        -points[:, 2],
        faces,
        (cut.height, cut.width),
        cull=True,
    )
    return Portrait(
        cut, scale_mm, hair, solid, linear,
        _continued(linear, hair, regions == BACKGROUND, scale_mm),
        regions == BACKGROUND, regions == CLOTHES, labels == EARS,
        warped(known, cv2.INTER_NEAREST) > 0,
        np.where(np.isfinite(found.depth), found.depth, NOTHING).astype(np.float32),
    )  # fmt: skip


def _large(mask, area):
    _, number, found, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8))
    return mask & (found[:, cv2.CC_STAT_AREA] > area)[number]


def _matte(picture, solid, regions, scale):
    """How much of each pixel is hair: as labelled, and near the outline as the photo says."""
    radius = max(int(WISP * scale), 1)
    mask = solid.astype(np.float32)
    soft = cv2.ximgproc.guidedFilter(picture, mask, radius, 1e-3)
    soft = np.clip(1.3 * soft - 0.15, 0, 1)
    # Skin beside hair may be as dark: there the labels are surer than the colours.
    backdrop = cv2.GaussianBlur((regions == BACKGROUND).astype(np.float32), (0, 0), radius)
    trust = np.clip(2 * backdrop, 0, 1)
    plain = cv2.GaussianBlur(mask, (0, 0), max(0.6 * scale, 0.3))
    return (trust * soft + (1 - trust) * plain).astype(np.float32)


def _continued(linear, hair, backdrop, scale):
    """The hair's colours, continued over what is not hair: nothing of skin or backdrop bleeds in."""
    off = cv2.distanceTransform((~backdrop).astype(np.uint8), cv2.DIST_L2, 3) / scale
    inner = cv2.distanceTransform((hair > 0.9).astype(np.uint8), cv2.DIST_L2, 3) / scale
    sure = (inner > INNER) & (off > HALO)
    if not sure.any():
        sure = hair >= min(0.9, float(hair.max()))
    spread = diffuse(linear, sure.astype(np.float32))
    keep = cv2.GaussianBlur(sure.astype(np.float32), (0, 0), max(0.5 * scale, 0.3))[..., None]
    return (spread + keep * (linear - spread)).astype(np.float32)
