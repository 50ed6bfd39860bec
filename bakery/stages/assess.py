"""What may spoil an avatar, measured in the portrait."""

from dataclasses import dataclass

import cv2
import numpy as np

from bakery.geometry import rotation
from bakery.geometry.color import LUMA, to_linear
from bakery.stages.segment import SKIN, occlusion
from bakery.types import EXPRESSION_INDEX

FACE = 256  # pixels that the face is scaled to, so that measures do not depend on its size
SIDES = {  # eye: outer corner, inner corner, two points of the upper lid and two of the lower
    "right": (33, 133, (159, 158), (145, 153)),
    "left": (263, 362, (386, 385), (374, 380)),
}


@dataclass(frozen=True)
class Limits:
    """Where warnings begin: beyond what neutral, evenly lit portraits of london/train measure."""

    expression: float = 0.3  # weight of what is not neutral, see `_expression`; neutral: up to 0.2
    open_mouth: float = 0.06  # gap between the lips over the mouth's width; neutral: up to 0.01
    yaw: float = 20.0  # degrees
    pitch: float = 20.0  # degrees
    closed_eyes: float = 0.13  # at least: lid opening over the eye's width; neutral: from 0.21
    glasses: float = 0.04  # share of the eye region
    hair: float = 0.05  # share of the face; neutral: up to 0.01
    shadow: float = 1.0  # stops between the halves of the face; neutral: up to 0.3
    blur: float = (
        0.06  # at least: see `sharpness`; sharp: from 0.19, blurred by 0.8% of the face: 0.06
    )


@dataclass(frozen=True)
class Finding:
    """One finding."""

    code: str
    message: str  # what was found, and what it does
    value: float  # as measured
    limit: float


def assess(photo, landmarks, fit, segmentation, limits=Limits()):
    """Measure what may spoil an avatar.

    Args:
        photo: Photo.
        landmarks: Landmarks of the face.
        fit: Fit.
        segmentation: Segmentation.

    Returns:
        list of Finding, empty for a good portrait.
    """
    measured = measure(photo, landmarks, fit, segmentation)
    checks = (  # code, too much or too little, what it means
        ("expression", 1, "the face is not neutral; its folds stay in the neutral texture"),
        ("open_mouth", 1, "the mouth is open; teeth stay in the neutral texture"),
        ("yaw", 1, "the head is turned; one side of the face is made up from the other"),
        ("pitch", 1, "the head is tilted up or down; chin or forehead is made up"),
        ("closed_eyes", -1, "an eye is nearly closed; its iris cannot be read"),
        ("glasses", 1, "glasses cover the eyes; they would be baked into the skin"),
        ("hair", 1, "hair covers the face; the skin below it is made up"),
        ("shadow", 1, "one side of the face is in shadow; the shadow stays in the texture"),
        ("blur", -1, "the face is blurred or small; the texture has no pores"),
    )
    found = []
    for code, sign, message in checks:
        value, limit = measured[code], getattr(limits, code)
        if sign * (value - limit) > 0:
            found.append(Finding(code, message, round(float(value), 4), limit))
    return found


def measure(photo, landmarks, fit, segmentation):
    """The numbers behind the warnings, by the names of `Limits`."""
    forward = rotation.matrix(fit.camera.rotation)[:, 2]
    hidden = occlusion(segmentation, landmarks.points)
    return {
        "expression": _expression(fit.expression),
        "open_mouth": _gap(landmarks.points),
        "yaw": abs(float(np.degrees(np.arctan2(forward[0], forward[2])))),
        "pitch": abs(float(np.degrees(np.arcsin(np.clip(forward[1], -1, 1))))),
        "closed_eyes": min(_opening(landmarks.points, side) for side in SIDES.values()),
        "glasses": hidden["glasses"],
        "hair": hidden["hair"],
        **_pixels(photo, landmarks, segmentation),
    }


def _expression(weights):
    """How far from neutral: the shapes of a smile together, or the strongest other shape.

    Other shapes count half, for fits use them to mend the identity; brows that are up count for
    nothing, since they cannot be told from high brows.
    """

    def sides(name):
        return float(sum(weights[EXPRESSION_INDEX[name + side]] for side in ("Left", "Right"))) / 2

    smile = sum(map(sides, ("mouthSmile", "mouthDimple", "mouthUpperUp")))
    others = [sides(name) for name in ("mouthFrown", "browDown", "noseSneer")]
    others += [
        float(weights[EXPRESSION_INDEX[n]]) for n in ("mouthPucker", "mouthFunnel", "cheekPuff")
    ]
    return max(smile, max(others) / 2)


def _gap(points):
    """Gap between the inner lips over the mouth's width."""
    return float(np.linalg.norm(points[13] - points[14]) / np.linalg.norm(points[61] - points[291]))


def _opening(points, side):
    outer, inner, upper, lower = side
    gaps = [np.linalg.norm(points[u] - points[v]) for u, v in zip(upper, lower)]
    return float(np.mean(gaps) / np.linalg.norm(points[outer] - points[inner]))


def _pixels(photo, landmarks, segmentation):
    """Shadow and sharpness of the face."""
    points = landmarks.points[:468]
    low, high = points.min(0), points.max(0)
    scale = FACE / float((high - low).max())
    matrix = np.array([[scale, 0, -low[0] * scale], [0, scale, -low[1] * scale]])
    reduce = cv2.INTER_AREA if scale < 1 else cv2.INTER_LINEAR
    left, top = np.maximum(np.floor(low).astype(int), 0)
    right, bottom = np.ceil(high).astype(int)
    cut = (slice(top, max(bottom, top + 2)), slice(left, max(right, left + 2)))
    face = np.ascontiguousarray(photo.encoded[cut], np.float32)
    size = tuple(max(8, int(round(n * scale))) for n in face.shape[1::-1])
    face = cv2.resize(face, size, interpolation=reduce)
    skin = cv2.resize((segmentation.labels[cut] == SKIN).astype(np.uint8), size) > 0
    hull = np.zeros(skin.shape, np.uint8)
    outline = cv2.convexHull(((points - [left, top]) * scale).astype(np.int32))
    cv2.fillConvexPoly(hull, outline, 1)
    inside = cv2.erode(hull, np.ones((9, 9), np.uint8)) > 0
    return {
        "shadow": _shadow(face, skin & inside, landmarks.points @ matrix[:, :2].T + matrix[:, 2]),
        "blur": sharpness(face, inside),
    }


def _shadow(face, skin, points):
    """Stops between the mean light on the two halves of the face."""
    luma = to_linear(face) @ LUMA
    nose, chin = points[168], points[152]
    axis = (chin - nose) / np.linalg.norm(chin - nose)
    y, x = np.mgrid[: luma.shape[0], : luma.shape[1]]
    side = (x - nose[0]) * axis[1] - (y - nose[1]) * axis[0]
    halves = [luma[skin & (side > 0)], luma[skin & (side < 0)]]
    if min(len(half) for half in halves) < 50:
        return 0.0
    one, other = (float(np.median(half)) + 1e-4 for half in halves)
    return abs(float(np.log2(one / other)))


def sharpness(face, inside):
    """Fine detail of a face scaled to 256 pixels: what a blur of one pixel takes away, over contrast."""
    grey = cv2.cvtColor(face, cv2.COLOR_RGB2GRAY)
    detail = grey - cv2.GaussianBlur(grey, (0, 0), 1.0)
    if not inside.any():
        return 0.0
    return float(np.percentile(np.abs(detail[inside]), 95) / max(np.std(grey[inside]), 0.02))
