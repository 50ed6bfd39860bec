"""What real portraits teach the segmentation network without anybody labelling them.

The backdrop gives the person's outline, the landmarks give lips and the mouth, and the colour rules of
`stages.segment` give skin, hair and clothes where they are sure. All else is `portrait.UNSURE`. Brows,
eyes and the skin around them are taken only from sets in which nobody wears glasses.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from bakery import landmarks as marks
from bakery.detectors import portrait, segmenter
from bakery.detectors.segmenter import take
from bakery.errors import BakeryError, InputError
from bakery.formats.files import write_bytes
from bakery.formats.npz import pack_arrays
from bakery.formats.portraits import reference_points
from bakery.stages import segment
from bakery.stages.segment import colours, network, prior
from bakery.stages.segment.frame import apply, warp_matrix
from bakery.train.segment import outline

QUALITY = 86  # of the JPEGs
GLASSES = (portrait.FRAME, portrait.LENS)
HUE = 2.5  # standard deviations from the face's own up to which ears, neck and forehead are sure
ROOM = 1.12  # side of a kept crop over that of the crop the network sees


@dataclass(frozen=True)
class RealPortrait:
    """One photo's crop; S is `portrait.SIDE`."""

    image: np.ndarray  # [S, S, 3] uint8 sRGB
    label: np.ndarray  # [S, S] uint8 into portrait.CLASSES, portrait.UNSURE where not known
    person: np.ndarray  # [S, S] uint8: 0 backdrop, 1 person, portrait.UNSURE
    points: np.ndarray  # [478, 2] float32 pixels


def kept_matrix(points: np.ndarray) -> np.ndarray:
    """The [2, 3] map from photo pixels to those of the crop that is kept, wider than the seen one."""
    matrix = portrait.crop_matrix(points) / ROOM
    matrix[:, 2] += portrait.SIDE / 2 * (1 - 1 / ROOM)
    return matrix


def read_portrait(image: np.ndarray, points: np.ndarray, glasses: bool) -> RealPortrait | None:
    """Label one photo as far as it is sure; None where the backdrop is not plain.

    Args:
        image: [H, W, 3] uint8 sRGB.
        points: [478, 2+] pixels.
        glasses: True where people may wear some and clothes differ from the backdrop; False for
            sets without glasses whose clothes may look like the backdrop.
    """
    points = np.asarray(points, np.float64)[:, :2]
    found = outline.find_outline(image, points, whole=glasses)
    if not found.sure:
        return None
    matrix = kept_matrix(points)
    label = _labels(image, points, found.person, glasses)
    inside = np.ones(image.shape[:2], np.uint8)
    crop = take(image, matrix)
    known = _inside(inside, matrix)
    person = np.where(known, take(found.person, matrix, nearest=True), outline.UNSURE)
    label = np.where(known, take(label, matrix, nearest=True), portrait.UNSURE)
    return RealPortrait(
        crop,
        label.astype(np.uint8),
        person.astype(np.uint8),
        (points @ matrix[:, :2].T + matrix[:, 2]).astype(np.float32),
    )


def _inside(inside, matrix):
    """True for the crop's pixels that lie in the photo."""
    side = portrait.SIDE
    return cv2.warpAffine(inside, matrix, (side, side), flags=cv2.INTER_NEAREST) > 0


def _labels(image, points, person, glasses):
    options = segment.SegmentOptions(method="colours")
    window, box = segment.window_of(np.float32(image) / 255, points)
    found = colours.classify(window, options.rounds)
    ruled = segment.on_whole(window, box, found, options, image.shape[:2])
    face = marks.face_size(points)
    label = np.full(image.shape[:2], portrait.UNSURE, np.uint8)
    deep = _eroded(person == outline.PERSON, 0.02 * face)
    seen = _network_classes(image, points)
    for theirs, ours in ((segment.HAIR, portrait.HAIR), (segment.CLOTHES, portrait.CLOTH)):
        both = (ruled.labels == theirs) & (seen == ours) & (person != outline.BACKDROP)
        # Narrow bands go: the rules call the edge of a bald head hair.
        label[_grown(_eroded(both, 0.06 * face), 0.04 * face) & both & deep] = ours
    for ours, part in _bare_parts(window, found).items():
        where = np.zeros(image.shape[:2], bool)
        where[box] = part
        bare = _eroded(where, 0.015 * face) & (person != outline.BACKDROP)
        label[bare & (seen != portrait.BEARD)] = ours
    rows = np.arange(image.shape[0])[:, None]
    chin = points[152, 1]
    label[(label == portrait.CLOTH) & (rows < chin)] = portrait.UNSURE
    label[(label == portrait.HAIR) & (rows > chin - 0.1 * face)] = portrait.UNSURE  # ties, collars
    _, parts = cv2.connectedComponents((label == portrait.HAIR).astype(np.uint8))
    grows = np.unique(parts[: max(int(points[marks.BROWS, 1].min()), 0)])
    label[(label == portrait.HAIR) & ~np.isin(parts, grows)] = portrait.UNSURE  # collars
    oval = _polygons(image, [points[marks.OVAL]])
    bare = _eroded(oval, 0.1 * face) & (ruled.skin > 0.95)
    eyes = points[marks.EYE_CORNERS, 1].mean()
    around_eyes = (rows > points[marks.BROWS, 1].min() - 0.1 * face) & (rows < eyes + 0.45 * face)
    middle = np.abs(np.arange(image.shape[1])[None] - points[4, 0]) < 0.12 * face
    bearded = (rows > points[2, 1] - 0.05 * face) & ~middle | (rows > points[2, 1])
    bare &= ~bearded
    bare &= ~around_eyes if glasses else True
    bare &= ~_grown(_polygons(image, [points[r] for r in marks.EYES]), 0.06 * face)
    brows = _polygons(image, [points[marks.BROW_LEFT], points[marks.BROW_RIGHT]])
    bare &= ~_grown(brows, 0.1 * face)
    label[bare] = portrait.SKIN
    if not glasses:
        label[_eroded(brows, 0.02 * face)] = portrait.BROWS
        label[_eroded(_polygons(image, [points[r] for r in marks.EYES]), 0.02 * face)] = (
            portrait.EYES
        )
    mouth = _polygons(image, [points[marks.LIPS_INNER]])
    lips = _polygons(image, [points[marks.LIPS_OUTER]]) & ~_grown(mouth, 0.02 * face)
    label[_eroded(lips, 0.02 * face)] = portrait.LIPS
    label[_eroded(mouth, 0.02 * face)] = portrait.MOUTH
    label[person == outline.BACKDROP] = portrait.BACKGROUND
    eyewear = np.isin(seen, GLASSES)
    if glasses and eyewear.sum() > network.WORN * face**2:  # else bits of frames are folds
        label[eyewear] = seen[eyewear]
    return label


def _network_classes(image, points):
    """What the network that ships calls each pixel [H, W], `portrait.UNSURE` outside of its crop."""
    shares, _, matrix = segmenter.segment(segmenter.shipped(), image, points)
    return cv2.warpAffine(
        shares.argmax(0).astype(np.uint8), warp_matrix(matrix), image.shape[1::-1],
        flags=cv2.INTER_NEAREST | cv2.WARP_INVERSE_MAP, borderValue=portrait.UNSURE,
    )  # fmt: skip


def _bare_parts(window, ruled):
    """Where the colour rules see ears, neck and forehead in a window: {class: [h, w] bool}.

    Skin that they find beside, below or above the face, of the face's own hue.
    """
    frame = apply(window.to_frame, window.points)
    angle, radius = prior.polar(frame[marks.OVAL])
    rows = np.arange(prior.SIZE)[:, None] + 0.5
    above_brows = frame[marks.BROWS, 1].min() - 0.1 * prior.FACE
    bare = (ruled.shares[segment.SKIN] > 0.8) & (ruled.hue < HUE) & ~ruled.hidden & ~ruled.glasses
    parts = {
        portrait.EARS: (radius > 1.03) & (radius < 1.35) & (angle > 65) & (angle < 112),
        portrait.NECK: (radius > 1.05) & (angle > 130),
        portrait.SKIN: (radius > 0.6) & (angle < 60) & (rows < above_brows),
    }
    planes = cv2.split(window.back(*(np.float32(bare & where) for where in parts.values())))
    return {label: plane > 0.5 for label, plane in zip(parts, planes)}


def _disc(radius):
    size = 2 * max(round(float(radius)), 1) + 1
    return cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size))


def _eroded(mask, radius):
    return cv2.erode(mask.astype(np.uint8), _disc(radius)) > 0


def _grown(mask, radius):
    return cv2.dilate(mask.astype(np.uint8), _disc(radius)) > 0


def _polygons(image, rings):
    out = np.zeros(image.shape[:2], np.uint8)
    for ring in rings:
        cv2.fillPoly(out, [np.round((ring - 0.5) * 16).astype(np.int32)], 1, shift=4)
    return out > 0


def pack(sets: list[tuple[Path, str, str, bool]], output: Path) -> Iterator[dict]:
    """Label folders of photos and write them into one small file.

    Args:
        sets: (folder with dense478.npz, how the names begin, what they hold, glasses: see
            `read_portrait`).
        output: .npz to write.

    Yields:
        {"photo": name, "left_out": why or None} of each photo.

    Raises:
        InputError: no photo is left.
    """
    from bakery.formats.image import read_photo  # training runs where its readers are not installed

    kept, names = [], []
    for folder, starts, part, glasses in sets:
        for path, points in reference_points(folder, starts, part).items():
            name, reason, one = path.relative_to(folder).as_posix(), None, None
            try:
                image = np.round(read_photo(path).encoded * 255).astype(np.uint8)
                one = read_portrait(image, points, glasses)
                reason = "backdrop" if one is None else None
            except BakeryError as error:
                reason = str(error)
            if one is not None:
                kept.append(one)
                names.append(name)
            yield {"photo": name, "left_out": reason}
    if not kept:
        raise InputError("no photo has a plain backdrop; give other folders")
    jpegs = [_jpeg(one.image) for one in kept]
    planes = [_png(np.concatenate([one.label, one.person])) for one in kept]
    table = {
        "names": np.array(names),
        "points": np.stack([one.points for one in kept]),
        **_strung("image", jpegs),
        **_strung("truth", planes),
    }
    write_bytes(output, pack_arrays(table))


def _jpeg(image):
    return cv2.imencode(".jpg", image[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, QUALITY])[1]


def _png(plane):
    return cv2.imencode(".png", plane, [cv2.IMWRITE_PNG_COMPRESSION, 9])[1]


def _strung(name, files):
    """Files behind each other, and where each ends."""
    ends = np.cumsum([len(file) for file in files])
    return {name: np.concatenate([file.ravel() for file in files]), name + "_ends": ends}


def read(path: Path) -> dict[str, np.ndarray]:
    """What `pack` wrote as arrays {name: [N, ...]}, see `RealPortrait`.

    Raises:
        InputError: not such a file.
    """
    try:
        with np.load(path) as table:
            images = _cut(table["image"], table["image_ends"], cv2.IMREAD_COLOR)
            truth = _cut(table["truth"], table["truth_ends"], cv2.IMREAD_GRAYSCALE)
            points = table["points"]
    except (OSError, KeyError, ValueError) as error:
        raise InputError(f"{path}: not written by `train portraits`: {error}") from None
    side = portrait.SIDE
    return {
        "image": np.stack(images)[..., ::-1].copy(),
        "label": np.stack(truth)[:, :side].copy(),
        "person": np.stack(truth)[:, side:].copy(),
        "points": points,
    }


def _cut(data, ends, flag):
    return [cv2.imdecode(part, flag) for part in np.split(data, ends[:-1])]
