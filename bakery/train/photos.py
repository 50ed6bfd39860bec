"""Training photos: pictures whose 478 points are known, and who in them is the person."""

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from bakery.detectors import frames
from bakery.errors import InputError
from bakery.train.backgrounds import IMAGE_SUFFIXES

FACE = 190  # size of the face in a stored photo at most, pixels


@dataclass(frozen=True)
class Photo:
    """A training photo before it becomes a relief."""

    name: str
    image: np.ndarray  # [H, W, 3] uint8 BGR
    mask: np.ndarray  # [H, W] uint8, 255 where the person is
    points: np.ndarray  # [478, 3] pixels of the image


def read_photos(folder, dense, limit=None):
    """Photos of a folder whose points stand in a dense478 file.

    Args:
        folder: of pictures.
        dense: npz with `names` (relative paths) and `points` [n, 478, 3] pixels.
        limit: how many to read at most.

    Returns:
        list of Photo, by name

    Raises:
        InputError: no picture of the folder has points.
    """
    table = np.load(dense)
    known = dict(zip(table["names"].tolist(), table["points"]))
    photos = []
    for path in sorted(Path(folder).iterdir())[:limit]:
        parts = path.parts
        ends = ("/".join(parts[-n:]) for n in range(1, min(len(parts), 5) + 1))
        name = next((end for end in ends if end in known), None)
        if name is None or path.suffix.lower() not in IMAGE_SUFFIXES:
            continue
        photos.append(_shrunk(path, known[name]))
    if not photos:
        raise InputError(f"{folder}: no picture with points in {dense}; give the folder it names")
    return photos


def _shrunk(path, points):
    image = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    if image is None:
        raise InputError(f"{path}: cannot be read as a picture; remove it from the folder")
    if image.ndim == 2:
        image = cv2.cvtColor(image, cv2.COLOR_GRAY2BGR)
    points = np.asarray(points, np.float32)
    scale = min(FACE / frames.frame_of_points(points).size, 1.0)
    size = np.round(np.multiply(image.shape[1::-1], scale)).astype(int)
    points = points * np.append(size / image.shape[1::-1], scale).astype(np.float32)
    image = cv2.resize(image, size.tolist(), interpolation=cv2.INTER_AREA)
    mask = image[..., 3] if image.shape[2] == 4 else person_mask(image, points)
    return Photo(path.stem, np.ascontiguousarray(image[..., :3]), mask, points)


def person_mask(image, points):
    """Tell a person from a plain backdrop by graph cut, started from the face.

    Args:
        image: [H, W, 3] uint8 BGR.
        points: [478, 2+] pixels.

    Returns:
        [H, W] uint8, 255 where the person is, soft at the rim.
    """
    height, width = image.shape[:2]
    half = cv2.resize(image, (width // 2, height // 2), interpolation=cv2.INTER_AREA)
    points = points[:, :2] / 2
    labels = np.full(half.shape[:2], cv2.GC_PR_BGD, np.uint8)
    frame = frames.frame_of_points(points)
    x, y = frame.center
    s = frame.size
    axes = (int(0.6 * s), int(0.85 * s))
    cv2.ellipse(labels, (int(x), int(y - 0.1 * s)), axes, 0, 0, 360, cv2.GC_PR_FGD, -1)
    chin = points[152]
    body = [[x - 0.3 * s, chin[1]], [x + 0.3 * s, chin[1]], [x + s, 9e3], [x - s, 9e3]]
    cv2.fillPoly(labels, [np.array(body, np.int32)], cv2.GC_PR_FGD)
    rows = int(max(y - 1.2 * s, 2))
    labels[:rows] = cv2.GC_BGD
    labels[: int(y), : int(max(x - 1.0 * s, 2))] = cv2.GC_BGD
    labels[: int(y), int(min(x + 1.0 * s, width / 2 - 2)) :] = cv2.GC_BGD
    hull = cv2.convexHull(points.astype(np.int32))
    cv2.fillConvexPoly(labels, hull, cv2.GC_FGD)
    cv2.setRNGSeed(0)
    models = np.zeros((1, 65)), np.zeros((1, 65))
    cv2.grabCut(half, labels, None, *models, 4, cv2.GC_INIT_WITH_MASK)
    mask = np.isin(labels, (cv2.GC_FGD, cv2.GC_PR_FGD)).astype(np.uint8) * 255
    mask = cv2.resize(mask, (width, height), interpolation=cv2.INTER_LINEAR)
    return cv2.GaussianBlur(mask, (0, 0), 1.2)
