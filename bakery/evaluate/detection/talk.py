"""How well lips are seen to move in clips of talking people whose points are known.

Each frame is looked at on its own, as `bakery detect` does, and followed, as `bakery track` does.
"""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from bakery.errors import InputError
from bakery.evaluate.detection.lips import SHUT, opening
from bakery.formats import npz
from bakery.formats.files import read_bytes
from bakery.formats.portraits import POINTS
from bakery.formats.video import Clip
from bakery.heads.base import HeadModel
from bakery.landmarks import face_size
from bakery.motion.follow import follow
from bakery.motion.track import track
from bakery.types import EXPRESSION_INDEX


def clips(folder: Path) -> Iterator[tuple[Path, np.ndarray]]:
    """The clips of a folder with their points [N, 478, 2] pixels.

    Args:
        folder: with dense478.npz (`names` [C], `points` [C, N, 478, 2]) and NAME.* for each name.

    Raises:
        InputError: the file or a clip is missing.
    """
    path = Path(folder) / POINTS
    if not path.is_file():
        raise InputError(f"{folder}: no {POINTS}; give the folder of clips that has it")
    table = npz.unpack_arrays(read_bytes(path))
    for name, points in zip(table["names"], table["points"]):
        found = sorted(Path(folder).glob(f"{name}.*"))
        if not found:
            raise InputError(f"{folder}: no clip {name}, which {POINTS} names")
        yield found[0], np.asarray(points, np.float64)


def measure(path: Path, reference: np.ndarray, detector, head: HeadModel) -> dict:
    """One clip's figures.

    Returns:
        `missed` frames, `error` of all points, `opening_error`, `correlation` of seen and true
        opening, `closed_seen` (mean opening where lips are closed), and of the take `jaw`: the
        correlation of jawOpen minus mouthClose with the true opening.
    """
    pictures = list(Clip(path).frames())[: len(reference)]
    reference = reference[: len(pictures)]
    eyes = np.array([face_size(points) for points in reference])
    truth = np.array([opening(points) for points in reference]) / eyes
    seen, errors = np.full(len(truth), np.nan), []
    for k, (_, picture) in enumerate(pictures):
        faces = detector.detect(picture)
        if faces:
            points = max(faces, key=lambda face: face.box[2] * face.box[3]).points
            seen[k] = opening(points) / eyes[k]
            errors.append(np.linalg.norm(points - reference[k], axis=1).mean() / eyes[k])
    there = np.isfinite(seen)
    closed = there & (truth < SHUT)
    take = track(follow(pictures, detector), head)
    weights = take.weights[: len(truth)]
    jaw = weights[:, EXPRESSION_INDEX["jawOpen"]] - weights[:, EXPRESSION_INDEX["mouthClose"]]
    return {
        "clip": Path(path).stem,
        "frames": len(truth),
        "missed": int((~there).sum()),
        "error": float(np.mean(errors)) if errors else None,
        "opening_error": float(np.abs(seen - truth)[there].mean()) if errors else None,
        "correlation": _correlation(seen[there], truth[there]) if errors else None,
        "closed": int(closed.sum()),
        "closed_seen": float(seen[closed].mean()) if closed.any() else None,
        "jaw": _correlation(jaw, truth[: len(jaw)]),
    }


def _correlation(one: np.ndarray, other: np.ndarray) -> float:
    """Pearson's; 0 where one of them stands still."""
    if min(np.ptp(one), np.ptp(other)) < 1e-9:
        return 0.0
    return float(np.corrcoef(one, other)[0, 1])


def summary(rows: list[dict]) -> dict:
    """All clips: missed frames, means, and the worst clip's correlations."""
    return {
        "clips": len(rows),
        "missed": sum(row["missed"] for row in rows),
        "error": float(np.mean([row["error"] for row in rows])),
        "opening_error": float(np.mean([row["opening_error"] for row in rows])),
        "correlation": float(np.mean([row["correlation"] for row in rows])),
        "correlation_worst": min(row["correlation"] for row in rows),
        "closed_seen": float(np.mean([row["closed_seen"] for row in rows if row["closed"]])),
        "jaw": float(np.mean([row["jaw"] for row in rows])),
        "jaw_worst": min(row["jaw"] for row in rows),
    }
