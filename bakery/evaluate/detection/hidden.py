"""Whether confidence tells which points are hidden: painted portraits, whose truth is known."""

from pathlib import Path

import numpy as np

from bakery.detectors import portrait
from bakery.detectors.base import Detector
from bakery.evaluate.detection import point_error
from bakery.evaluate.segmenting import painted_portraits
from bakery.stages.detect import detect_faces

LOW = 0.7  # confidence below which a point is counted as said to be hidden


def measure(folder: Path, detector: Detector, limit: int | None = None) -> dict[str, float | int]:
    """Compare confidence at points behind a hand or another thing with that at points in view.

    Args:
        folder: of `bakery synth portraits`.
        detector: see `bakery.detectors.base.Detector`.
        limit: pictures to look at.

    Returns:
        pictures, undetected (no face found), hidden (share of the points), the mean `confidence_`
        and `error_` (eye distances) of both groups, `low_`: shares below LOW, and `auc`: how often
        a hidden point has less confidence than one in view (area under the ROC curve).
    """
    confidence, errors, hidden, pictures, undetected = [], [], [], 0, 0
    for picture, label, _, _, points in painted_portraits(folder, limit):
        pictures += 1
        faces = detect_faces(picture, detector)
        if not faces:
            undetected += 1
            continue
        errors.append(point_error(faces[0].points, points))
        confidence.append(faces[0].confidence)
        columns, rows = np.clip(points.astype(int), 0, np.array(label.shape[::-1]) - 1).T
        hidden.append(label[rows, columns] == portrait.THING)
    out: dict[str, float | int] = {"pictures": pictures, "undetected": undetected}
    if not hidden:
        return out
    sure, off, behind = map(np.concatenate, (confidence, errors, hidden))
    out |= {"hidden": round(float(behind.mean()), 4), "auc": auc(sure[behind], sure[~behind])}
    for name, group in (("hidden", behind), ("seen", ~behind)):
        out |= {
            f"confidence_{name}": round(float(sure[group].mean()), 4),
            f"error_{name}": round(float(off[group].mean()), 4),
            f"low_{name}": round(float((sure[group] < LOW).mean()), 4),
        }
    return out


def auc(low: np.ndarray, high: np.ndarray) -> float:
    """How often a value of `low` is below one of `high`, ties counted half; 0.5 says nothing."""
    ordered = np.sort(high)
    below, upto = (np.searchsorted(ordered, low, side=side) for side in ("left", "right"))
    return round(float(1 - (below + upto).mean() / 2 / len(high)), 4)
