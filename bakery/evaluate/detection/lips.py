"""What a detector says of a mouth, and of whom: opening, width, and the tone of the skin.

Means over all points hide a mouth that never closes. Lengths are over the outer-eye-corner distance
of the true points.
"""

from itertools import compress

import cv2
import numpy as np

from bakery.landmarks import LIPS_INNER_LOWER, LIPS_INNER_UPPER, MOUTH_CORNERS, face_size

SHUT = 0.01  # a true opening below this is a closed mouth
WIDE = 0.05  # above this it is a wide smile, in photographs that are no talk
COLUMNS = slice(3, -3)  # of the inner rims: the middle half, where lips part first
CHEEKS = ((50, 101, 36, 205, 187, 123), (280, 330, 266, 425, 411, 352))
# Individual typology angle, degrees: Chardon, Cretois, Hourseau, "Skin colour typology and suntanning
# pathways", Int. J. Cosmetic Science 13, 1991. Its six classes are drawn together to three.
TONES = (("dark", -90.0), ("middle", 10.0), ("light", 41.0))


def _columns(points):
    along = points[MOUTH_CORNERS[1]] - points[MOUTH_CORNERS[0]]
    down = np.array([-along[1], along[0]]) / np.linalg.norm(along)
    return (points[LIPS_INNER_LOWER[COLUMNS]] - points[LIPS_INNER_UPPER[COLUMNS]]) @ down


def opening(points: np.ndarray) -> float:
    """Mean distance of the inner rims across the mouth, with its sign, pixels.

    Args:
        points: [478, 2] pixels.
    """
    return float(_columns(points).mean())


def gap(points: np.ndarray) -> float:
    """The opening that is seen, pixels: where rims overlap, lips touch.

    Args:
        points: [478, 2] pixels.
    """
    return float(np.maximum(_columns(points), 0).mean())


def width(points: np.ndarray) -> float:
    """Distance of the mouth's corners, pixels."""
    return float(np.linalg.norm(points[MOUTH_CORNERS[1]] - points[MOUTH_CORNERS[0]]))


def tone_angle(image: np.ndarray, points: np.ndarray) -> float:
    """Individual typology angle of the cheeks in degrees; above 41 light, below 10 dark.

    It is that of the photo: light and exposure are in it.

    Args:
        image: [H, W, 3] float sRGB-encoded 0..1.
        points: [478, 2] pixels.
    """
    mask = np.zeros(image.shape[:2], np.uint8)
    for cheek in CHEEKS:
        cv2.fillConvexPoly(mask, np.round(points[list(cheek)]).astype(np.int32), 1)
    if not mask.any():
        return float("nan")
    lab = cv2.cvtColor(image[mask > 0][None].astype(np.float32), cv2.COLOR_RGB2LAB)[0]
    lightness, _, yellow = np.median(lab, axis=0)
    return float(np.degrees(np.arctan2(lightness - 50, yellow)))


def tone_of(angle: float) -> str:
    """The group of `TONES` that an angle falls in; "" without an angle."""
    names = [name for name, least in TONES if angle >= least]
    return names[-1] if names else ""


def summary(rows: list[dict]) -> dict:
    """Means over photos.

    Args:
        rows: each with `opening`, `true_opening`, `width`, `true_width` (eye distances), `error`
            (all points) and `tone`; those of missed faces are None and count as missed alone.

    Returns:
        `opening_error`, of all and of `smiles_opening_error` (the wide ones), `closed_seen` (mean opening
        seen where lips are closed) and `closed_off` (its mean size: lips seen one through the other count
        too), `width_error` of wide smiles, `tones` (mean error a group), `tone_ratio` (the worst group's over the mean);
        None where no photo is of the kind.
    """
    rows = [row for row in rows if row["error"] is not None]
    opened = [abs(row["opening"] - row["true_opening"]) for row in rows]
    wide = [row["true_opening"] > WIDE for row in rows]
    closed = [row["opening"] for row in rows if row["true_opening"] < SHUT]
    widths = [abs(row["width"] / row["true_width"] - 1) for row in compress(rows, wide)]
    tones = {}
    for name, _ in TONES:
        of_group = [row["error"] for row in rows if row["tone"] == name]
        if of_group:
            tones[name] = {"photos": len(of_group), "error": float(np.mean(of_group))}
    mean = _mean([row["error"] for row in rows])
    worst = max((group["error"] for group in tones.values()), default=None)
    return {
        "opening_error": _mean(opened),
        "smiles_opening_error": _mean(list(compress(opened, wide))),
        "closed": len(closed),
        "closed_seen": _mean(closed),
        "closed_off": _mean([abs(opening) for opening in closed]),
        "wide": len(widths),
        "width_error": _mean(widths),
        "tones": tones,
        "tone_ratio": worst / mean if worst and mean else None,
    }


def _mean(values):
    return float(np.mean(values)) if values else None


def of_photo(image: np.ndarray, reference: np.ndarray, points: np.ndarray | None) -> dict:
    """One photo's row for `summary`.

    Args:
        image: [H, W, 3] float sRGB-encoded 0..1; reference, points: [478, 2] pixels; points None
            where the face was missed.
    """
    eyes = float(face_size(reference))
    row = {
        "true_opening": opening(reference) / eyes,
        "true_width": width(reference) / eyes,
        "tone": tone_of(tone_angle(image, reference)),
        "opening": None, "width": None, "error": None,
    }  # fmt: skip
    if points is not None:
        error = np.linalg.norm(points - reference, axis=1).mean() / eyes
        row |= {"opening": opening(points) / eyes, "width": width(points) / eyes}
        row["error"] = float(error)
    return row
