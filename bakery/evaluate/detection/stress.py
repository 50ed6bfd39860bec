"""The detector under changes whose right answer is known: smaller, tilted, off-centre, doubled.

Each test changes a photo by a similarity that carries its reference points along.
"""

from dataclasses import dataclass

import cv2
import numpy as np

from bakery.detectors import frames
from bakery.evaluate.detection import SETS, point_error
from bakery.formats.image import read_photo
from bakery.formats.portraits import reference_points
from bakery.stages.detect import detect_faces


@dataclass(frozen=True)
class StressResult:
    """One change, over all photos."""

    name: str
    photos: int
    right_count: int  # photos in which as many faces were found as there are
    found: int  # faces found, of all there are
    faces: int  # faces there are
    error: float  # mean over the found faces, eye distances
    error_worst: float


def placed(image, points, size, roll, center, canvas):
    """A photo resampled so that its face has a given size, roll and place.

    Args:
        image: [H, W, 3] uint8.
        points: [478, 2] pixels.
        size: of the face frame, pixels.
        roll: radians added to the face's own.
        center: [2] pixels of the canvas.
        canvas: [h, w, 3] uint8, shows where the photo does not reach.

    Returns:
        picture [h, w, 3] uint8, points [478, 2] in it
    """
    frame = frames.frame_of_points(points)
    shrink = max(int(frame.size / size), 1)
    small = cv2.resize(image, None, fx=1 / shrink, fy=1 / shrink, interpolation=cv2.INTER_AREA)
    linear = frames.rotation(roll) * (size / frame.size)
    matrix = np.concatenate([linear, (center - linear @ frame.center)[:, None]], 1)
    scale = np.array(image.shape[1::-1]) / small.shape[1::-1]
    shifted = np.concatenate([linear * scale, matrix[:, 2:]], 1)
    shifted[:, 2] += shifted[:, :2].sum(1) * 0.5 - 0.5
    size = canvas.shape[1::-1]
    picture = cv2.warpAffine(
        small, shifted, size, canvas.copy(), flags=1, borderMode=cv2.BORDER_TRANSPARENT
    )
    return picture, frames.apply_affine(matrix, points)


def stress_folder(portraits, detector, sets=SETS):
    """`stress` with the photos of a folder; see `detection.measure_folder`.

    Raises:
        InputError: dense478.npz is missing or names no photo of the sets.
    """
    photos = [
        (np.round(read_photo(path).encoded * 255).astype(np.uint8), points)
        for path, points in reference_points(portraits, sets).items()
    ]
    yield from stress(photos, detector)


def stress(photos, detector, seed=0, changes=None):
    """Run changes over some photos.

    Args:
        photos: list of (image [H, W, 3] uint8, points [478, 2] pixels), one face each.
        detector: see `bakery.detectors.base.Detector`.
        seed: of the random places.
        changes: names of CHANGES; None is all of them.

    Yields:
        StressResult
    """
    rng = np.random.default_rng(seed)
    for name in changes or CHANGES:
        errors, right, faces = [], 0, 0
        for image, points in photos:
            picture, truths = CHANGES[name](rng, image, points)
            found = detect_faces(picture, detector)
            right += len(found) == len(truths)
            faces += len(truths)
            for truth in truths:
                each = [point_error(face.points, truth).mean() for face in found]
                if each and min(each) < 0.5:
                    errors.append(min(each))
        yield StressResult(
            name,
            len(photos),
            right,
            len(errors),
            faces,
            float(np.mean(errors)) if errors else float("nan"),
            float(max(errors, default=np.nan)),
        )


def _turned(degrees):
    def change(rng, image, points):
        frame = frames.frame_of_points(points)
        side = round(2.2 * frame.size)
        canvas = np.full((side, side, 3), 200, np.uint8)
        center = np.array([side / 2, side / 2])
        roll = np.radians(degrees) - frame.roll
        picture, moved = placed(image, points, frame.size, roll, center, canvas)
        return picture, [moved]

    return change


def _small_in(width, height, size):
    def change(rng, image, points):
        canvas = np.full((height, width, 3), rng.integers(40, 220), np.uint8)
        center = rng.uniform(0.7 * size, (width - 0.7 * size, height - 0.7 * size))
        picture, moved = placed(image, points, size, 0, center, canvas)
        return picture, [moved]

    return change


def _whole_frame(share):
    """Crop to `share` of the face frame's side."""

    def change(rng, image, points):
        frame = frames.frame_of_points(points)
        side = round(share * frame.size)
        canvas = np.full((side, side, 3), 127, np.uint8)
        center = np.array([side / 2, side / 2])
        picture, moved = placed(image, points, frame.size, 0, center, canvas)
        return picture, [moved]

    return change


def _two(rng, image, points):
    size = 260
    canvas = np.full((700, 1100, 3), rng.integers(40, 220), np.uint8)
    picture, left = placed(image, points, size, 0.1, np.array([280, 350]), canvas)
    half = picture[:, :550].copy()
    other, right = placed(image, points, size * 0.6, -0.15, np.array([280, 380]), canvas[:, :550])
    return np.concatenate([half, other], 1), [left, right + (550, 0)]


CHANGES = {
    "96 px face in 1350x1350": _small_in(1350, 1350, 96),
    "96 px face in 6000x4000": _small_in(6000, 4000, 96),
    "48 px face in 900x700": _small_in(900, 700, 48),
    "36 px face in 900x700": _small_in(900, 700, 36),
    "roll +30": _turned(30),
    "roll -30": _turned(-30),
    "whole frame": _whole_frame(1.1),
    "chin and forehead cut": _whole_frame(0.92),
    "two faces": _two,
}
