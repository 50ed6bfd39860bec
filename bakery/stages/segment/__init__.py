"""Tell skin from hair, clothes, glasses and background in a portrait.

By the segmentation network or, without it, by colour rules; both say what they found in the face
frame (`prior`), and `enlarge` brings it to the photo's pixels, whose colours say what lenses hide and
where frames of glasses go on beyond their labels (`refine`). In doubt a pixel is not skin: what is left
out is filled with the person's own skin later, what is let in by mistake shows as a smear.
"""

import cv2
import numpy as np

from bakery import landmarks
from bakery.check import check_array
from bakery.stages.segment import colours, kernels, network, prior
from bakery.stages.segment.classes import (
    BACKGROUND,
    BEARD,
    BROWS,
    CLOTHES,
    EARS,
    EYES,
    GLASSES,
    HAIR,
    HAT,
    HIDDEN,
    LABELS,
    LENS,
    LIPS,
    MOUTH,
    NECK,
    REGION_OF,
    REGIONS,
    SKIN,
    THING,
    Found,
    Segmentation,
    SegmentOptions,
)
from bakery.stages.segment.enlarge import Window, enlarge, in_bytes
from bakery.stages.segment.frame import apply, frame_box, warp_down
from bakery.stages.segment.refine import refined

__all__ = [
    "BACKGROUND", "BEARD", "BROWS", "CLOTHES", "EARS", "EYES", "GLASSES", "HAIR", "HAT", "HIDDEN",
    "LABELS", "LENS", "LIPS", "MOUTH", "NECK", "REGIONS", "SKIN", "THING", "SegmentOptions",
    "Segmentation", "made_by", "occlusion", "segment", "window_of",
]  # fmt: skip


# Regions that a label may lie in besides its own: a clear lens shows skin and eyes, hair and clothes
# are taken with a third of their edge.
WITHIN = {LENS: (SKIN, EYES), THING: (CLOTHES,), BACKGROUND: (HAIR, CLOTHES)}


def made_by(options: SegmentOptions) -> str:
    """What the labels depend on besides the options: SHA-256 of the weights, "" without any."""
    return network.digest() if options.method == "network" else ""


def segment(
    encoded: np.ndarray, points: np.ndarray, options: SegmentOptions | None = None
) -> Segmentation:
    """Label a portrait and find the skin that can be unwrapped.

    Args:
        encoded: [H, W, 3] float32 sRGB-encoded 0..1.
        points: [478, 2] pixels; more columns are ignored.

    Returns:
        Segmentation: labels are background wherever more than about 1.4 face sizes from the face.

    Raises:
        ValueError: a wrong shape.
        FitError: points without extent, or none near the photo.
        ModelError: the network's weights are missing or damaged.
    """
    options = options or SegmentOptions()
    check_array("encoded", encoded, (None, None, 3))
    points = np.asarray(points, np.float64)[:, :2]
    check_array("points", points, (478, 2))
    window, box = window_of(encoded, points)
    if options.method == "network":
        found = network.classify(window)
    else:
        found = colours.classify(window, options.rounds)
    return refined(_on_whole(window, box, found, options, encoded.shape[:2]), encoded, points)


def _on_whole(
    window: Window,
    box: tuple[slice, slice],
    found: Found,
    options: SegmentOptions,
    shape: tuple[int, ...],
) -> Segmentation:
    """The classes found in a window (`window_of`) as the labels of its whole photo [H, W]."""
    regions, skin = enlarge(window, found, options)

    def whole(plane):
        if plane.shape == tuple(shape):
            return plane
        out = np.zeros(shape, plane.dtype)
        out[box] = plane
        return out

    labels = _named(window, regions, found.labels)
    shadow = None
    if found.shadow is not None:  # the network learned it on skin alone
        shadow = whole(np.where(regions == SKIN, window.back(found.shadow), np.float32(0)))
    return Segmentation(whole(labels), whole(skin), whole(regions), shadow)


def window_of(encoded: np.ndarray, points: np.ndarray) -> tuple[Window, tuple[slice, slice]]:
    """The part of a photo around the face, and the rows and columns where it lies.

    Args:
        encoded: [H, W, 3] float32 sRGB-encoded 0..1.
        points: [478, 2] pixels.

    Raises:
        FitError: points without extent, or none near the photo.
    """
    to_frame = prior.face_frame(points)
    left, top, right, bottom = frame_box(to_frame, encoded.shape)
    part = np.ascontiguousarray(encoded[top:bottom, left:right], np.float32)
    to_frame = np.column_stack([to_frame[:, :2], to_frame @ [left, top, 1]])
    small = np.clip(warp_down(part, to_frame), 0, 1)
    box = (slice(top, bottom), slice(left, right))
    return Window(part, small, to_frame, points - [left, top]), box


def _named(window, regions, fine):
    """Regions [h, w] with the labels that the face frame [S, S] tells apart within them."""
    if fine is None:
        return regions
    labels = regions.copy()
    told = [BACKGROUND, *range(len(REGIONS), len(LABELS))]
    there = [label for label in np.unique(fine).tolist() if label in told]
    for i in range(0, len(there), 4):
        # OpenCV takes two or three at once twice as long as four: the last one is told again.
        four = [there[min(k, len(there) - 1)] for k in range(i, i + 4)]
        planes = window.back(*(in_bytes(fine == label) for label in four))
        fits = [
            np.isin(range(len(REGIONS)), WITHIN.get(label, (REGION_OF[label],))) for label in four
        ]
        kernels.name(planes, np.uint8(four), np.array(fits), regions, labels)
    # What is left out with a margin, or lies before the face, is called what it is.
    covered = np.isin(regions, (GLASSES, HIDDEN))
    if covered.any():
        labels[covered] = window.nearest(fine)[covered]
    return labels


def occlusion(segmentation, points):
    """How much of the face is hidden.

    Args:
        segmentation: of the photo.
        points: [478, 2] pixels.

    Returns:
        dict of shares 0..1: `hair` and `hidden` (but for things, which have a finding of their own) of
        the face contour's inside, `forehead_hair` of its part above the brows, `glasses` of the
        region of the eyes, from brow to mid-nose.
    """
    points = np.asarray(points, np.float64)[:, :2]
    height, width = segmentation.regions.shape
    to_frame = prior.face_frame(points)
    size = (prior.SIZE, prior.SIZE)
    labels, regions = (
        cv2.warpAffine(plane, to_frame, size, flags=cv2.INTER_NEAREST)
        for plane in (segmentation.labels, segmentation.regions)
    )
    points = apply(to_frame, points)
    _, radius = prior.polar(points[landmarks.OVAL])
    rows = np.arange(prior.SIZE)[:, None] + 0.5
    face = radius < 0.92
    brows = points[landmarks.BROWS, 1]
    forehead = face & (rows < brows.min())
    eyes = face & (rows > brows.mean()) & (rows < points[195, 1])

    def share(label, where, of=regions):
        return float((of[where] == label).mean()) if where.any() else 0.0

    return {
        "hair": share(HAIR, face),
        "hidden": share(True, face, (regions == HIDDEN) & (labels != THING)),
        "forehead_hair": share(HAIR, forehead),
        "glasses": share(GLASSES, eyes),
    }
