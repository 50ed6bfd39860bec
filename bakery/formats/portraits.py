"""Folders of portraits whose 478 landmarks are known: photos and one dense478.npz that names them."""

from pathlib import Path

import numpy as np

from bakery.errors import InputError
from bakery.formats import npz
from bakery.formats.files import read_bytes
from bakery.types import LANDMARKS, Landmarks

POINTS = "dense478.npz"


def reference_points(portraits, starts, part=""):
    """Photos with their reference points: path -> [478, 2] pixels.

    Args:
        portraits: folder with dense478.npz (`names` [N], paths within the folder; `points`
            [N, 478, 2 or 3] pixels) and the photos that it names.
        starts: how the names of the wanted photos begin, one text or several.
        part: what their file names must hold, as "neutral".

    Raises:
        InputError: dense478.npz is missing or no such file, or names no such photo.
    """
    portraits = Path(portraits)
    path = portraits / POINTS
    if not path.is_file():
        raise InputError(f"{portraits}: no {POINTS}; give the folder of portraits that has it")
    try:
        table = npz.unpack_arrays(read_bytes(path))
    except npz.NpzError as error:
        raise InputError(f"{path}: {error}; needs arrays `names` and `points`") from None
    missing = [name for name in ("names", "points") if name not in table]
    if missing:
        raise InputError(f"{path}: lacks {missing[0]}")
    names, points = [str(name) for name in table["names"]], table["points"]
    if points.ndim != 3 or points.shape[:2] != (len(names), LANDMARKS):
        raise InputError(
            f"{path}: `points` has shape {list(points.shape)}, needs [{len(names)}, 478, 2 or 3]"
        )
    starts = (starts,) if isinstance(starts, str) else tuple(starts)
    found = {
        portraits / name: np.array(where[:, :2], np.float64)
        for name, where in zip(names, points)
        if name.startswith(starts) and part in Path(name).name
    }
    if not found:
        wanted = " ".join(filter(None, (part, "photo of", ", ".join(starts))))
        raise InputError(f"{path}: names no {wanted}")
    return found


def landmarks_of(points: np.ndarray, confidence: np.ndarray | None = None) -> Landmarks:
    """Landmarks record of points [478, >= 2] in pixels, fully trusted unless told."""
    points = np.asarray(points, np.float64)[:, :2]
    low, high = points.min(0), points.max(0)
    sure = np.ones(len(points)) if confidence is None else np.asarray(confidence, np.float64)
    return Landmarks(np.concatenate([low, high - low]), 1.0, points, sure)
