"""What may spoil an avatar, measured in the portrait."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from bakery import landmarks as marks
from bakery.geometry import rotation
from bakery.geometry.color import LUMA, to_linear
from bakery.settings import Settings, setting
from bakery.stages.detect import share_outside
from bakery.stages.hair.signs import hair_signs
from bakery.stages.segment import EYES, GLASSES, HIDDEN, LENS, SKIN, Segmentation, occlusion
from bakery.types import EXPRESSION_INDEX, Fit, Landmarks, Photo

FACE = 256  # pixels that the face is scaled to, so that measures do not depend on its size
SIDES = {  # eye: outer corner, inner corner, two points of the upper lid and two of the lower
    "right": (33, 133, (159, 158), (145, 153)),
    "left": (263, 362, (386, 385), (374, 380)),
}
# Shapes of a smile, and how much each counts: mouthSmile at 1 is a strong one.
SMILE = {"mouthSmile": 1.67, "mouthDimple": 1.0, "mouthUpperUp": 1.0}
RESTING_MOUTH = 0.602  # of the distance of the outer eye corners, the widest of london/train
PARTS = (  # of the face, each hidden by itself, and the side it lies on: +1 left, -1 right
    (np.concatenate([marks.EYE_LEFT, marks.BROW_LEFT]), 1),
    (np.concatenate([marks.EYE_RIGHT, marks.BROW_RIGHT]), -1),
    (marks.LIPS, 0),
    (np.array([397, 365, 379, 378, 400, 377, 152]), 1),
    (np.array([172, 136, 150, 149, 176, 148, 152]), -1),
)
EXPLAINS = {"mirrored": "landmarks", "cut": "covered"}  # finding: what it is also measured as
LINES = np.concatenate(  # what is where for everybody who looks: unlike jaw and cheeks
    [marks.EYE_RIGHT, marks.EYE_LEFT, marks.BROW_RIGHT, marks.BROW_LEFT]
    + [marks.LIPS_OUTER_UPPER, marks.LIPS_OUTER_LOWER]
)
IN_MIRROR = np.concatenate(  # what each of LINES is in a mirror
    [marks.EYE_LEFT, marks.EYE_RIGHT, marks.BROW_LEFT, marks.BROW_RIGHT]
    + [marks.LIPS_OUTER_UPPER[::-1], marks.LIPS_OUTER_LOWER[::-1]]
)
AGREE = 0.01  # of the eye corners' distance: nearer than this landmarks are the same
ASIDE, AWAY = 0.2, 0.34  # sine of a head's turn from which its far side, its whole jaw is unsure


@dataclass(frozen=True)
class Limits(Settings):
    """Where warnings begin: beyond what neutral, evenly lit portraits of london/train measure."""

    # See `_expression`; neutral: up to 0.4.
    expression: float = setting(0.42, "weight of what is not neutral", 0, 52)
    # Neutral: up to 0.11 (full dark lips), most 0.05.
    open_mouth: float = setting(0.12, "gap between the lips over the mouth's width", 0, 10)
    yaw: float = setting(20.0, "turn of the head to a side", 0, 90, unit="degrees")
    pitch: float = setting(20.0, "turn of the head up or down", 0, 90, unit="degrees")
    # Neutral: from 0.21.
    closed_eyes: float = setting(0.13, "at least: lid opening over the eye's width", 0, 1)
    glasses: float = setting(0.04, "share of the eye region that glasses cover", 0, 1)
    hair: float = setting(0.05, "share of the face behind hair", 0, 1)  # neutral: up to 0.01
    # Neutral: up to 0.01 (specks).
    hat: float = setting(0.1, "area of a hat over the square of the eye distance", 0, 100)
    # Neutral: 0.
    hair_cut: float = setting(
        0.15, "length of the picture's edge that hair touches, over the eye distance", 0, 100
    )
    hidden: float = setting(0.02, "share of the face that is hidden", 0, 1)  # neutral: 0
    # Neutral: from 0.9, in the dark 0.88, a painted hand before the chin: up to 0.84.
    covered: float = setting(
        0.85, "at least: how sure the landmarks of each part of the face are, over the surest", 0, 1
    )
    # Neutral: up to 0.3.
    shadow: float = setting(
        1.0, "difference of light between the halves of the face", 0, 20, unit="stops"
    )
    # See `fit_photo.dark_share`; neutral: up to 0.02, smiling 0.028.
    cast_shadow: float = setting(0.03, "share of plain skin in a cast shadow", 0, 1)
    # Neutral: from 0.4.
    dark: float = setting(0.3, "at least: white of the brighter eye, sRGB-encoded", 0, 1)
    # The texture shows a face at 500 pixels.
    small: float = setting(200.0, "at least: size of the face", 0, 8192, unit="pixels")
    # See `sharpness`; sharp: from 0.11, blurred by 0.4 (0.8)% of the face up to 0.07 (0.01).
    blur: float = setting(0.03, "at least: sharpness", 0, 1)
    # See `_flatness`; 82 photos: up to 0.02, made grey up to 0.16; drawn in 12 colours: from 0.44.
    flat: float = setting(0.3, "share of the face that its three commonest colours hold", 0, 1)
    # Whole faces: 0.
    cut: float = setting(0.01, "share of the landmarks outside of the photo", 0, 1)
    # See `_strayed`; a photo's own, given by others: up to 0.034, those of a plain head without
    # brows and lips 0.051; another person's, whose eyes lie in the same place: mean 0.1.
    landmarks: float = setting(
        0.06, "distance from detected landmarks over that of the outer eye corners", 0, 10
    )
    # Own: up to 1.4.
    mirrored: float = setting(2.0, "times that they lie nearer when they are mirrored", 1, 100)


@dataclass(frozen=True)
class Finding:
    """One finding."""

    code: str
    message: str  # what was found, and what it does
    value: float  # as measured
    limit: float


def assess(
    photo: Photo,
    landmarks: Landmarks,
    fit: Fit,
    segmentation: Segmentation,
    limits: Limits = Limits(),
    seen: Sequence[Landmarks] = (),
) -> list[Finding]:
    """Measure what may spoil an avatar.

    Args:
        photo: Photo.
        landmarks: Landmarks of the face, detected or given.
        fit: Fit.
        segmentation: Segmentation.
        seen: Landmarks of all faces that the detector finds in the photo, to compare them with.

    Returns:
        list of Finding, empty for a good portrait.
    """
    measured = measure(photo, landmarks, fit, segmentation, seen)
    checks = (  # code, too much or too little, what it means
        ("mirrored", 1, "the landmarks are those of the mirrored photo; detect again"),
        ("landmarks", 1, "the landmarks are not those of this face; detect again"),
        ("cut", 1, "the face is cut by the picture's edge; what is outside is made up"),
        ("flat", 1, "the face has hardly any shades, as a drawing; its shape is a guess"),
        ("expression", 1, "the face is not neutral; its resting shape and skin are estimates"),
        ("open_mouth", 1, "the mouth is open; how its lips close is an estimate"),
        ("yaw", 1, "the head is turned; one side of the face is made up from the other"),
        ("pitch", 1, "the head is tilted up or down; chin or forehead is made up"),
        ("closed_eyes", -1, "an eye is nearly closed; its iris cannot be read"),
        ("glasses", 1, "glasses cover the eyes; what they hide is made up"),
        ("hair", 1, "hair covers the face; the skin below it is made up"),
        ("hat", 1, "a hat is on the head; hair ends at its brim, and what is below it is made up"),
        ("hair_cut", 1, "hair is cut by the picture's edge; how long it is, is a guess"),
        ("hidden", 1, "hair or a deep shadow hides one side; it is made up from the other"),
        (
            "covered",
            -1,
            "something is before the face, as a hand; it is made up below, or baked into the skin",
        ),
        ("shadow", 1, "one side of the face is in shadow; some of it stays in the texture"),
        ("cast_shadow", 1, "a hard shadow or a dark thing lies on the face; traces of it stay"),
        ("dark", -1, "the face or its eyes are too dark; grain and false colours stay"),
        ("small", -1, "the face is small; the texture is soft and has no pores"),
        ("blur", -1, "the face is blurred; the texture has no pores"),
    )
    found = []
    for code, sign, message in checks:
        value, limit = measured[code], getattr(limits, code)
        if sign * (value - limit) > 0:
            found.append(Finding(code, message, round(float(value), 4), limit))
    explained = {EXPLAINS.get(finding.code) for finding in found}
    return [finding for finding in found if finding.code not in explained]


def measure(
    photo: Photo,
    landmarks: Landmarks,
    fit: Fit,
    segmentation: Segmentation,
    seen: Sequence[Landmarks] = (),
) -> dict[str, float]:
    """The numbers behind the warnings, by the names of `Limits`."""
    forward = rotation.matrix(fit.camera.rotation)[:, 2]
    hidden = occlusion(segmentation, landmarks.points)
    return {
        "expression": _expression(fit.expression, landmarks.points),
        "open_mouth": marks.lip_gap(landmarks.points),
        "yaw": abs(float(np.degrees(np.arctan2(forward[0], forward[2])))),
        "pitch": abs(float(np.degrees(np.arcsin(np.clip(forward[1], -1, 1))))),
        "closed_eyes": min(_opening(landmarks.points, side) for side in SIDES.values()),
        "glasses": hidden["glasses"],
        "hair": hidden["hair"],
        "hidden": hidden["hidden"],
        **hair_signs(segmentation, landmarks.points),
        "covered": _sureness(landmarks, segmentation.labels, forward[0]),
        "cast_shadow": fit.diagnostics.get("shadow_share", 0.0),
        "dark": _white(photo, landmarks.points, segmentation.regions),
        "cut": share_outside(landmarks, photo.encoded.shape),
        **_strayed(photo, landmarks.points, seen),
        **_pixels(photo, landmarks, segmentation),
    }


def _expression(weights, points):
    """How far from neutral: the shapes of a smile together, or the strongest other shape.

    Other shapes count half, for fits use them to mend the identity, and so does the smile of a
    mouth no wider than resting ones are; brows that are up count for nothing, since they cannot be
    told from high brows.
    """

    def sides(name):
        return float(sum(weights[EXPRESSION_INDEX[name + side]] for side in ("Left", "Right"))) / 2

    smile = sum(share * sides(name) for name, share in SMILE.items())
    others = [sides(name) for name in ("mouthFrown", "browDown", "noseSneer")]
    others += [
        float(weights[EXPRESSION_INDEX[n]]) for n in ("mouthPucker", "mouthFunnel", "cheekPuff")
    ]
    wide = np.linalg.norm(np.subtract(*points[marks.MOUTH_CORNERS])) / marks.face_size(points)
    return max(smile if wide > RESTING_MOUTH else smile / 2, max(others) / 2)


def _opening(points, side):
    outer, inner, upper, lower = side
    gaps = [np.linalg.norm(points[u] - points[v]) for u, v in zip(upper, lower)]
    return float(np.mean(gaps) / np.linalg.norm(points[outer] - points[inner]))


def _sureness(landmarks, labels, aside):
    """How sure the landmarks of the least sure part of the face are, over those of the surest.

    Parts that glasses cover do not count. Nothing is said of a head that is turned far, or whose
    one side is hidden: both have findings of their own.

    Args:
        aside: sine of the turn of the head to the picture's right.
    """
    place = np.clip(landmarks.points[:, ::-1].astype(int), 0, np.subtract(labels.shape, 1))
    shown = labels[tuple(place.T)]
    if abs(aside) > AWAY or (shown == HIDDEN).any():
        return 1.0
    near = [part for part, side in PARTS if side * aside < 0 or abs(aside) < ASIDE]
    bare = [part for part in near if not np.isin(shown[part], (GLASSES, LENS)).any()]
    means = [float(landmarks.confidence[part].mean()) for part in bare]
    return min(means) / max(*means, 1e-6) if means else 1.0


def _white(photo, points, labels):
    """Encoded luma of the white of the brighter eye; 1 if none is seen."""
    seen = []
    for lids in marks.EYES:
        low = np.maximum(np.floor(points[lids].min(0)).astype(int), 0)
        high = np.ceil(points[lids].max(0)).astype(int) + 1
        cut = (slice(low[1], high[1]), slice(low[0], high[0]))
        eye = photo.encoded[cut][labels[cut] == EYES]
        if len(eye):
            seen.append(float(np.percentile(eye @ LUMA, 85)))
    return max(seen, default=1.0)


def _strayed(photo, points, seen):
    """How far landmarks lie from those that were detected, and how much nearer in a mirror.

    Mirrored are the landmarks of a photo that was mirrored later, or coordinates alone that were:
    then the left eye is on the right as well.
    """
    if not seen:
        return {"landmarks": 0.0, "mirrored": 1.0}
    flipped = points * [-1, 1] + [photo.encoded.shape[1], 0]
    given = np.stack([points[LINES], flipped[LINES], flipped[IN_MIRROR]])
    nearest = min(
        (
            np.linalg.norm(given - face.points[LINES], axis=2).mean(1)
            / marks.face_size(face.points)
            for face in seen
        ),
        key=min,
    )
    return {
        "landmarks": float(nearest[0]),
        "mirrored": float(nearest[0] / max(nearest[1:].min(), AGREE)),
    }


def _flatness(face, inside):
    """Share of the face's pixels that its three commonest colours hold, of 128 steps a channel.

    Its brightest counts as white, so that dark photos do not look flat.
    """
    colors = face[inside]
    if not len(colors):
        return 0.0
    white = max(np.percentile(colors, 99), 0.05)
    steps = np.clip(colors / white * 128, 0, 127).astype(np.int64)
    counts = np.unique(steps @ [128 * 128, 128, 1], return_counts=True)[1]
    return float(np.sort(counts)[-3:].sum() / len(colors))


def _pixels(photo, landmarks, segmentation):
    """Shadow, size, sharpness and colours of the face."""
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
    skin = cv2.resize((segmentation.regions[cut] == SKIN).astype(np.uint8), size) > 0
    hull = np.zeros(skin.shape, np.uint8)
    outline = cv2.convexHull(((points - [left, top]) * scale).astype(np.int32))
    cv2.fillConvexPoly(hull, outline, 1)
    inside = cv2.erode(hull, np.ones((9, 9), np.uint8)) > 0
    return {
        "shadow": _shadow(face, skin & inside, landmarks.points @ matrix[:, :2].T + matrix[:, 2]),
        "small": float((high - low).max()),
        "blur": sharpness(face, inside),
        "flat": _flatness(face, inside),
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
    """Fine detail of a face scaled to 256 pixels: what a blur of one pixel takes away, over contrast.

    Only as far as its strongest 1% stand out of the rest: grain does not make a picture sharp. The
    99th percentile of Gaussian noise is 3.8 times its median.
    """
    grey = cv2.cvtColor(face, cv2.COLOR_RGB2GRAY)
    if not inside.any():
        return 0.0
    detail = np.abs(grey - cv2.GaussianBlur(grey, (0, 0), 1.0))[inside]
    strong = np.percentile(detail, 99) - 3.8 * np.median(detail)
    return float(strong / max(np.std(grey[inside]), 0.02))
