"""How well portraits never seen are labelled: by the segmentation stage, and by its network alone.

Painted portraits have truth for every pixel. Of real ones the outline before a plain backdrop is
known, where skin surely is, and who wears glasses.
"""

from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np

from bakery import landmarks as marks
from bakery.detectors import portrait, segmenter
from bakery.detectors.portrait import CLASSES, SIDE, UNSURE
from bakery.formats.portraits import reference_points
from bakery.stages import detect, segment
from bakery.stages.segment.frame import draw_polygon
from bakery.stages.segment.network import LABEL_OF
from bakery.synth import portrait_shards
from bakery.train.backgrounds import procedural_background
from bakery.train.segment import outline

# Who wears glasses among congress/val, looked at one by one.
GLASSES = (
    "C001078", "F000450", "L000565", "L000576", "M001138", "P000596", "W000817", "B000911", "C000537",
    "C001046", "D000407", "K000382", "M000388", "M000508", "P000373",
)  # fmt: skip
WORN = 0.03  # area labelled glasses, over the square of the eye distance, from which they are worn
ERROR = 0.015  # of the eye distance: how far the points are put aside, as a detector does
# Class of each label of the stage; what it only knows to be hidden is none of them.
CLASS_OF = np.full(len(segment.LABELS), len(CLASSES))
CLASS_OF[LABEL_OF] = np.arange(len(CLASSES))
GROUPS = {"glasses": (portrait.FRAME, portrait.LENS)}  # measured together too


def staged(
    folder: Path, options: segment.SegmentOptions | None = None, limit: int | None = None
) -> dict[str, float | int]:
    """IoU of each class and of cast shadow on painted portraits as `bakery segment` labels them.

    Our own detector finds the points; "undetected" counts faces that it does not find, where the
    painter's are taken. Cast shadow is measured on skin, where the stage answers it.

    Args:
        folder: of `bakery synth portraits`, of a seed that was not trained on.
        options: of the stage.
        limit: pictures to look at.
    """

    undetected = 0

    def answers():
        nonlocal undetected
        for picture, truth, dark, points, _ in painted_portraits(folder, limit):
            face = detect.detect_faces(picture)
            undetected += not face
            found = _labelled(picture, face[0].points if face else points, options)
            cast = np.zeros(truth.shape) if found.shadow is None else found.shadow
            bare = np.isin(truth, portrait.BODY)
            yield truth, CLASS_OF[found.labels], np.where(bare, dark, UNSURE), cast

    return _measured(answers()) | {"undetected": undetected}


def _labelled(picture, points, options=None):
    return segment.segment(np.float32(picture) / 255, points, options)


def stage_classes(picture: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Classes [H, W] of a photo [H, W, 3] uint8 sRGB as the stage labels it."""
    return CLASS_OF[_labelled(picture, points).labels]


def painted(folder: Path, network, limit: int | None = None) -> dict[str, float | int]:
    """The same of the network alone, within its crop: kinder than `staged`.

    Args:
        network: from `segmenter.load`.
    """

    def answers():
        for picture, label, dark, points, _ in painted_portraits(folder, limit):
            shares, cast, matrix = segmenter.segment(network, picture, points)
            inside = _inside(label, matrix)
            truth, dark = (
                np.where(inside, segmenter.take(plane, matrix, nearest=True), UNSURE)
                for plane in (label, dark)
            )
            yield truth, shares.argmax(0), dark, cast

    return _measured(answers())


def painted_portraits(folder: Path, limit: int | None = None) -> Iterator[tuple]:
    """Painted portraits before some background.

    Yields:
        picture [S, S, 3] uint8, classes [S, S] and cast shadow [S, S] (see `synth.portraits`),
        points as a detector finds them and true ones, [478, 2] pixels each.
    """
    table = portrait_shards.read(folder, limit)
    for k, (image, alpha, label, shadow, points) in enumerate(
        zip(*(table[name] for name in portrait_shards.ARRAYS))
    ):
        rng = np.random.default_rng([k, 77])
        share = alpha[..., None] / 255.0
        behind = procedural_background(rng, SIDE)
        picture = np.round(image * share + behind * (1 - share)).astype(np.uint8)
        found = points + rng.normal(size=2) * ERROR * marks.face_size(points)
        yield picture, label, shadow, found, points


def _measured(answers):
    """The figures of (classes, classes answered, shadow, share of shadow answered) of each picture."""
    size = len(CLASSES)
    counts, shade, pictures = np.zeros((size, size + 1)), np.zeros((2, 2)), 0
    for truth, answer, dark, cast in answers:
        counts += confusion(truth, answer, (size, size + 1))
        shade += confusion(np.where(truth == UNSURE, UNSURE, dark), cast > 0.5, (2, 2))
        pictures += 1
    shadow = shade[1, 1] / max(shade.sum() - shade[0, 0], 1)
    return {"pictures": pictures} | overlaps(counts) | {"shadow": round(float(shadow), 4)}


def confusion(truth: np.ndarray, answer: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    """How many pixels of each class [rows] were called each class [columns]; unsure ones are left out."""
    known = truth != UNSURE
    pair = truth[known].astype(int) * shape[1] + answer[known]
    return np.bincount(pair, minlength=shape[0] * shape[1]).reshape(shape)


def overlaps(counts: np.ndarray) -> dict[str, float | None]:
    """IoU of each class and of GROUPS from a `confusion`; None for what does not occur.

    A last column more than rows counts answers that are no class.
    """
    groups = {name: (k,) for k, name in enumerate(CLASSES)} | GROUPS
    out = {}
    for name, members in groups.items():
        at = list(members)
        both = counts[np.ix_(at, at)].sum()
        either = counts[at].sum() + counts[:, at].sum() - both
        out[name] = round(float(both / either), 4) if counts[at].sum() else None
    return out


def _inside(plane, matrix):
    """Where the crop lies in the picture [SIDE, SIDE] bool."""
    full = np.ones(plane.shape[:2], np.uint8)
    return cv2.warpAffine(full, matrix, (SIDE, SIDE), flags=cv2.INTER_NEAREST) > 0


def _read(path):
    """A photo [H, W, 3] uint8 sRGB."""
    # Painted portraits are measured where the readers of photos are not installed.
    from bakery.formats.image import read_photo

    return np.round(read_photo(path).encoded * 255).astype(np.uint8)


def photographed(congress: Path, network) -> Iterator[dict]:
    """The outline of each person of congress/val, and whether glasses are seen.

    Args:
        congress: folder with dense478.npz.
        network: from `segmenter.load`.

    Yields:
        {"photo", "outline": IoU within the crop or None where the backdrop tells too little,
        "glasses": area over the squared eye distance, "worn": by those who looked}.
    """
    for path, points in reference_points(congress, "val").items():
        image = _read(path)
        shares, _, matrix = segmenter.segment(network, image, points)
        label = shares.argmax(0)
        cut = outline.find_outline(image, points)
        overlap = None
        if cut.sure:
            inside = _inside(cut.person, matrix)
            truth = segmenter.take(cut.person, matrix, nearest=True)
            known = inside & (truth != outline.UNSURE)
            person, there = (1 - shares[portrait.BACKGROUND] > 0.5) & known, (truth == 1) & known
            overlap = round(float((person & there).sum() / max((person | there).sum(), 1)), 4)
        eyes = marks.face_size(points) * np.sqrt(abs(np.linalg.det(matrix[:, :2])))
        area = float(np.isin(label, GROUPS["glasses"]).sum() / eyes**2)
        yield {
            "photo": path.stem,
            "outline": overlap,
            "glasses": round(area, 4),
            "worn": path.stem in GLASSES,
        }


def skin_lost(portraits: Path, network) -> Iterator[dict]:
    """How much bare skin of neutral london/train is taken for something else.

    Skin for sure is what the colour rules call skin within the face's contour, off its edge, brows,
    eyes and lips.

    Yields:
        {"photo", "masked": share 0..1, "shadow": share called cast shadow}.
    """
    for path, points in reference_points(portraits, "london/train", "neutral").items():
        image = _read(path)
        shares, cast, matrix = segmenter.segment(network, image, points)
        by_rules = segment.SegmentOptions(method="colours")
        bare = segment.segment(np.float32(image) / 255, points, by_rules).skin > 0.95
        placed = points @ matrix[:, :2].T + matrix[:, 2]
        sure = _polygon(placed[marks.OVAL])
        eyes = marks.face_size(placed)
        sure = cv2.erode(sure, np.ones((3, 3), np.uint8), iterations=max(int(0.06 * eyes), 1))
        for ring in (*marks.EYES, marks.BROW_LEFT, marks.BROW_RIGHT, marks.LIPS_OUTER):
            sure &= 1 - cv2.dilate(_polygon(placed[ring]), np.ones((5, 5), np.uint8))
        skin = (sure > 0) & (segmenter.take(bare.astype(np.uint8), matrix, nearest=True) > 0)
        wrong = ~np.isin(shares.argmax(0), portrait.BODY)
        yield {
            "photo": path.stem,
            "masked": round(float(wrong[skin].mean()), 5),
            "shadow": round(float((cast[skin] > 0.5).mean()), 5),
        }


def _polygon(ring):
    out = np.zeros((SIDE, SIDE), np.uint8)
    draw_polygon(out, ring, 1)
    return out


def summary(photos: list[dict], skins: list[dict]) -> dict:
    """The figures that must be shown, of what `photographed` and `skin_lost` gave."""
    known = [row["outline"] for row in photos if row["outline"] is not None]
    found = {
        worn: [row["glasses"] > WORN for row in photos if row["worn"] == worn]
        for worn in (True, False)
    }
    out = {"outlines": len(known), "left_out": [r["photo"] for r in photos if r["outline"] is None]}
    if known:
        out |= {"outline": round(float(np.mean(known)), 4), "outline_worst": min(known)}
    for name, worn in (("glasses_found", True), ("glasses_falsely_found", False)):
        out[name] = round(float(np.mean(found[worn])), 4) if found[worn] else None
    if skins:
        lost = [row["masked"] for row in skins]
        out |= {"skin_masked": round(float(np.mean(lost)), 5), "skin_masked_worst": max(lost)}
    return out
