"""Tell the classes apart by the segmentation network.

The network (`detectors.segmenter`) answers in its crop; outside of it the crop's border goes on. What
it sees is believed where people's portraits showed it to be right: bits of things, beards of the
skin's colour and glasses of a few pixels are mistakes.
"""

import cv2
import numpy as np

from bakery import landmarks
from bakery.detectors import portrait
from bakery.formats.files import digest_file
from bakery.geometry.color import to_bytes
from bakery.stages.segment import ears, overlays, prior
from bakery.stages.segment.classes import (
    BACKGROUND,
    BEARD,
    BROWS,
    CLOTHES,
    EARS,
    EYES,
    GLASSES,
    HAIR,
    HAT,
    LENS,
    LIPS,
    MOUTH,
    NECK,
    SKIN,
    THING,
    Found,
)
from bakery.stages.segment.enlarge import Window
from bakery.stages.segment.frame import apply, warp_matrix

LABEL_OF = np.array(  # of each of portrait.CLASSES
    [BACKGROUND, SKIN, BROWS, EYES, LIPS, MOUTH, BEARD, HAIR, EARS, NECK, CLOTHES, GLASSES, LENS,
     HAT, THING],
    np.uint8,
)  # fmt: skip
WORN = 0.1  # area of glasses over the square of the eye distance from which they are believed
SURE_THING = (0.05, 0.93)  # area over that of the face, mean share, of a thing that is believed
SURE_BEARD = (0.85, 8.0)  # mean share, distance in Lab from the cheeks (half of that in lightness)
DEEP = 0.1  # of the light on the lit skin: below, a shadow shows nothing
MIDDLE = 0.72  # of the way to the contour: what one side of the face is judged by
SPECK = 0.002  # of the squared face size: smaller parts of skin, and holes in it, are mistakes


def digest() -> str:
    """SHA-256 of the weights that ship."""
    return digest_file(portrait.WEIGHTS)


def classify(window: Window) -> Found:
    """Classes of a photo in its face frame.

    Raises:
        ModelError: the network's weights are missing or damaged.
    """
    # torch takes a second to come.
    from bakery.detectors import segmenter

    image = to_bytes(window.part)
    shares, shadow, matrix = segmenter.segment(segmenter.shipped(), image, window.points)
    to_frame = _joined(matrix, window.to_frame)
    *shares, shadow = _warped([*shares, shadow], to_frame)
    shares = np.stack(shares)
    points = apply(window.to_frame, window.points)
    angle, radius = prior.polar(points[landmarks.OVAL])
    # Beyond the crop its border goes on, but hair does not grow on upwards and to the sides.
    ends = ~_inside(to_frame) & (angle < 110)
    _take_over(shares, portrait.HAIR, portrait.BACKGROUND, ends)

    _settle_classes(shares, window.small, points, radius)
    top = surest(shares)
    hair = ears.covered(top, window.small)
    _take_over(shares, portrait.EARS, portrait.HAIR, hair)
    top[hair] = portrait.HAIR
    labels = LABEL_OF[top]
    glasses, clear = _eyewear(window.small, labels, points, radius)
    thing = (labels == THING) & (radius < 1.25)
    body = shares[list(portrait.BODY)].sum(0) + shares[portrait.LENS] * clear
    worn = shares[portrait.CLOTH] + shares[portrait.HAT] + shares[portrait.THING] * ~thing
    four = np.stack([shares[portrait.BACKGROUND], body, shares[portrait.HAIR], worn])
    _settle_specks(four)
    hidden = (thing | _hidden_side(labels, window.small, radius)) & ~glasses
    four[:, glasses | hidden] = 0
    face = (four[SKIN] > 0.5) & (radius < 0.8)
    return Found(four, face, glasses, hidden, labels, shadow=shadow)


def _inside(matrix):
    """Where the crop lies in the face frame, [S, S] bool."""
    full = np.ones((portrait.SIDE, portrait.SIDE), np.uint8)
    return cv2.warpAffine(full, warp_matrix(matrix), (prior.SIZE, prior.SIZE)) > 0


def surest(shares: np.ndarray) -> np.ndarray:
    """The class [H, W] of the largest of shares [K, H, W]; `argmax` takes three times as long."""
    best, top = shares[0].copy(), np.zeros(shares.shape[1:], np.uint8)
    for k in range(1, len(shares)):
        top[shares[k] > best] = k
        np.maximum(best, shares[k], out=best)
    return top


def _joined(to_crop, to_frame):
    """[2, 3] from pixels of the crop to those of the face frame."""
    back = cv2.invertAffineTransform(to_crop)
    return np.column_stack([to_frame[:, :2] @ back[:, :2], apply(to_frame, back[:, 2])])


def _warped(planes, matrix):
    """Planes of the crop in the face frame; four at once take as long as two."""
    size = (prior.SIZE, prior.SIZE)
    return [
        plane
        for i in range(0, len(planes), 4)
        for plane in cv2.split(
            cv2.warpAffine(
                cv2.merge(planes[i : i + 4]), warp_matrix(matrix), size,
                flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE,
            )
        )
    ]  # fmt: skip


def _settle_classes(shares, small, points, radius):
    """Take things, beards and glasses that are hardly there out of shares [15, S, S], in place.

    The network sees bits of hands in shadows and folds, and beards on shaved chins.
    """
    top = surest(shares)
    thing = top == portrait.THING
    if not (thing.any() and _sure_thing(thing, shares[portrait.THING], radius)):
        shares[portrait.THING] = 0
    beard = top == portrait.BEARD
    if beard.any() and not _bearded(shares[portrait.BEARD][beard], beard, small, points, radius):
        _take_over(shares, portrait.BEARD, portrait.SKIN, np.ones_like(beard))
    glasses = [portrait.FRAME, portrait.LENS]
    if np.isin(top, glasses).sum() < WORN * landmarks.face_size(points) ** 2:
        shares[glasses] = 0
    shares /= np.maximum(shares.sum(0), 1e-6)


def _sure_thing(thing, share, radius):
    """Whether a part of what may be a thing is large, and surely one."""
    area, sureness = SURE_THING
    _, parts = cv2.connectedComponents(thing.astype(np.uint8))
    sizes = np.bincount(parts.ravel())
    sums = np.bincount(parts.ravel(), share.ravel())
    sure = (sizes > area * float((radius < 1).sum())) & (sums / np.maximum(sizes, 1) > sureness)
    return sure[1:].any()


def _bearded(sureness, beard, small, points, radius):
    """Whether what may be a beard has another colour than the cheeks."""
    share, apart = SURE_BEARD
    rows = np.arange(prior.SIZE)[:, None] + 0.5
    cheeks = (radius < 0.8) & (rows > points[145, 1]) & (rows < points[2, 1])
    if sureness.mean() < share or not cheeks.any():
        return False
    lab = cv2.cvtColor(small, cv2.COLOR_RGB2LAB)
    off = np.median(lab[beard], 0) - np.median(lab[cheeks], 0)
    return np.linalg.norm(off * [0.5, 1, 1]) > apart


def _hidden_side(labels, small, radius):
    """Hair, or a shadow that swallows the skin, before one side of the face: [S, S] bool.

    The other side can stand in for it. What hides both alike, as a brim's shadow, is left alone: a
    face of nothing but guesses is no better. A side that is merely darker shows the person's own skin.
    """
    middle = radius < MIDDLE
    bare = np.isin(labels, LABEL_OF[list(portrait.BODY)])
    red, green, blue = cv2.split(cv2.pow(small, 2.2))  # `mean` over three takes ten times as long
    light = (red + green + blue) / 3
    lit = np.percentile(light[bare & middle], 75) if (bare & middle).any() else 0.0
    lost = (bare & (light < DEEP * lit)) | (labels == HAIR)
    lost = cv2.morphologyEx(lost.astype(np.uint8), cv2.MORPH_OPEN, np.ones((5, 5), np.uint8)) > 0
    return overlays.one_side(lost, middle) & (radius < 1)


def _take_over(shares, loser, winner, where):
    """Give one class's share to another in a region."""
    shares[winner][where] += shares[loser][where]
    shares[loser][where] = 0


def _eyewear(small, labels, points, radius):
    """What glasses hide, and lenses that one can see through: [S, S] bool each."""
    lens = labels == LENS
    frames = cv2.dilate((labels == GLASSES).astype(np.uint8), np.ones((3, 3), np.uint8)) > 0
    if not (lens.any() or frames.any()):
        return frames, lens
    # A thin rim is called lens; it lies along the lens's edge.
    rim = cv2.morphologyEx(lens.astype(np.uint8), cv2.MORPH_GRADIENT, np.ones((5, 5), np.uint8)) > 0
    frames |= rim & (labels != BROWS)
    opaque = overlays.find_lenses(small, points, radius)
    opaque |= overlays.find_reflections(small, frames | lens, points, radius)
    return frames | (lens & opaque), lens & ~opaque & ~frames


def _settle_specks(four):
    """Give small parts of skin to what is around them, and small holes in it to the skin."""
    for mine, theirs in ((four[SKIN] > 0.5, False), (four[SKIN] <= 0.5, True)):
        _, parts, stats, _ = cv2.connectedComponentsWithStats(mine.astype(np.uint8), connectivity=4)
        small = stats[:, cv2.CC_STAT_AREA] < SPECK * prior.FACE**2
        small[0] = False
        if not small.any():
            continue
        lost = small[parts]
        if theirs:
            four[:, lost] = np.float32([[0], [1], [0], [0]])
        else:
            four[SKIN][lost] = 0
