"""What real portraits teach the segmentation network without anybody labelling them.

The backdrop gives the person's outline. All else is what the tool itself says (`stages.segment`: the
network that ships, mended by the photo's colours), unless people who looked at it found it wrong
(`doubt`): there it is `portrait.UNSURE`.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from bakery.detectors import portrait
from bakery.detectors.segmenter import take
from bakery.errors import BakeryError, InputError
from bakery.formats.files import write_bytes
from bakery.formats.image import compressed
from bakery.formats.npz import pack_arrays
from bakery.formats.portraits import reference_points
from bakery.stages import segment
from bakery.stages.segment import network
from bakery.train.segment import doubt, outline

QUALITY = 86  # of the JPEGs
CLASS_OF = np.full(len(segment.LABELS), portrait.UNSURE, np.uint8)  # of each label of the tool
CLASS_OF[network.LABEL_OF] = np.arange(len(portrait.CLASSES))
LIT = 0.2  # share of hard shadow that the tool sees, below which there is none
ROOM = 1.12  # side of a kept crop over that of the crop the network sees


@dataclass(frozen=True)
class RealPortrait:
    """One photo's crop; S is `portrait.SIDE`."""

    image: np.ndarray  # [S, S, 3] uint8 sRGB
    label: np.ndarray  # [S, S] uint8 into portrait.CLASSES, portrait.UNSURE where not known
    person: np.ndarray  # [S, S] uint8: 0 backdrop, 1 person, portrait.UNSURE
    shadow: np.ndarray  # [S, S] uint8: 0 where bare skin surely is in none, portrait.UNSURE
    points: np.ndarray  # [478, 2] float32 pixels


def kept_matrix(points: np.ndarray) -> np.ndarray:
    """The [2, 3] map from photo pixels to those of the crop that is kept, wider than the seen one."""
    matrix = portrait.crop_matrix(points) / ROOM
    matrix[:, 2] += portrait.SIDE / 2 * (1 - 1 / ROOM)
    return matrix


def read_portrait(
    image: np.ndarray, points: np.ndarray, whole: bool, faults: Sequence[str] = ()
) -> RealPortrait | None:
    """Label one photo as far as it is sure; None where the backdrop is not plain.

    Args:
        image: [H, W, 3] uint8 sRGB.
        points: [478, 2+] pixels.
        whole: see `outline.find_outline`; False: all clothes are white.
        faults: of `doubt.FAULTS`, what is wrong with the tool's labels.
    """
    points = np.asarray(points, np.float64)[:, :2]
    found = outline.find_outline(image, points, whole=whole)
    if not found.sure:
        return None
    matrix = kept_matrix(points)
    label, shadow = _labels(image, points, found.person, whole, faults)
    known = _inside(image.shape[:2], matrix)
    planes = [
        np.where(known, take(plane, matrix, nearest=True), portrait.UNSURE).astype(np.uint8)
        for plane in (label, found.person, shadow)
    ]
    return RealPortrait(
        take(image, matrix),
        *planes,
        (points @ matrix[:, :2].T + matrix[:, 2]).astype(np.float32),
    )


def _inside(shape, matrix, size=(portrait.SIDE, portrait.SIDE)):
    """True for pixels of a picture of `size`, width first, that one of a `shape` reaches."""
    return cv2.warpAffine(np.ones(shape, np.uint8), matrix, size, flags=cv2.INTER_NEAREST) > 0


def _labels(image, points, person, whole, faults):
    """What the tool itself calls each pixel, but for what the backdrop or a reader contradicts; shadow.

    Both [H, W] uint8, see `RealPortrait`.
    """
    found = segment.segment(np.float32(image) / 255, points)
    label = CLASS_OF[found.labels]
    label[(label == portrait.BACKGROUND) & (person == outline.PERSON)] = portrait.UNSURE
    label[person == outline.BACKDROP] = portrait.BACKGROUND
    # Where the network sees nothing, its border goes on.
    back = cv2.invertAffineTransform(portrait.crop_matrix(points))
    seen = _inside((portrait.SIDE, portrait.SIDE), back, image.shape[1::-1])
    label[~seen & (label != portrait.BACKGROUND)] = portrait.UNSURE
    if whole:
        label[doubt.collars(image, label, points)] = portrait.UNSURE
    else:
        label[doubt.tails(image, label, points)] = portrait.HAIR
    for fault in faults:
        label[doubt.where(fault, label, points)] = portrait.UNSURE
    lit = (label == portrait.SKIN) & (found.shadow < LIT)
    return label, np.where(lit, 0, portrait.UNSURE).astype(np.uint8)


def pack(sets: list[tuple[Path, str, str, bool]], output: Path) -> Iterator[dict]:
    """Label folders of photos and write them into one small file.

    Args:
        sets: (folder with dense478.npz, how the names begin, what they hold, whole: see
            `read_portrait`).
        output: .npz to write.

    Yields:
        {"photo": name, "left_out": why or None} of each photo.

    Raises:
        InputError: no photo is left.
    """
    from bakery.formats.image import read_photo  # training runs where its readers are not installed

    kept, names = [], []
    known = doubt.read()
    for folder, starts, part, whole in sets:
        for path, points in reference_points(folder, starts, part).items():
            name, reason, one = path.relative_to(folder).as_posix(), None, None
            try:
                image = np.round(read_photo(path).encoded * 255).astype(np.uint8)
                one = read_portrait(image, points, whole, known.get(path.stem, ()))
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
    planes = [_png(np.concatenate([one.label, one.person, one.shadow])) for one in kept]
    table = {
        "names": np.array(names),
        "points": np.stack([one.points for one in kept]),
        **_strung("image", jpegs),
        **_strung("truth", planes),
    }
    write_bytes(output, pack_arrays(table))


def _jpeg(image):
    return compressed(".jpg", image[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, QUALITY])


def _png(plane):
    return compressed(".png", plane, [cv2.IMWRITE_PNG_COMPRESSION, 9])


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
    label, person, shadow = np.split(np.stack(truth), 3, 1)
    return {
        "image": np.stack(images)[..., ::-1].copy(),
        "label": label.copy(),
        "person": person.copy(),
        "shadow": shadow.copy(),
        "points": points,
    }


def _cut(data, ends, flag):
    return [cv2.imdecode(part, flag) for part in np.split(data, ends[:-1])]
