"""Tell the classes apart by the segmentation network, with the colour rules for a second opinion.

The network (`detectors.segmenter`) sees outlines, glasses, hats, hands and collars that colours
confuse. It learned from painted people who all wear something below the neck, so that it calls a bare
chest clothes; some ears and bald heads go to the hair, whose edge is known to a few pixels only. There
the rules decide, and outside of its crop.
"""

import cv2
import numpy as np

from bakery import landmarks
from bakery.detectors import portrait
from bakery.formats.files import digest_file
from bakery.stages.segment import colours, overlays, prior
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
AGREED = 0.7  # see `_agreement`: below, the network decides alone
HAIRLINE = 0.06  # of the face size, from the hair of the network: there the rules draw its edge
HUE = 3.5  # standard deviations from the face's own hue up to which skin is believed
DEEP = 0.1  # of the lit side's light: a side that is skin and has more is dark, not hidden
SPECK = 0.002  # of the squared face size: smaller parts of skin, and holes in it, are mistakes


def digest() -> str:
    """SHA-256 of the weights that ship."""
    return digest_file(portrait.WEIGHTS)


def classify(window: Window, rounds: int) -> Found:
    """Classes of a photo in its face frame.

    Args:
        rounds: of the colour rules.

    Raises:
        ModelError: the network's weights are missing or damaged.
    """
    # torch takes a second to come.
    from bakery.detectors import segmenter

    image = (np.clip(window.part, 0, 1) * 255 + 0.5).astype(np.uint8)
    shares, shadow, matrix = segmenter.segment(segmenter.shipped(), image, window.points)
    to_frame = _joined(matrix, window.to_frame)
    shares = np.stack([_warped(plane, to_frame) for plane in shares])
    inside = _inside(to_frame)
    points = apply(window.to_frame, window.points)
    angle, radius = prior.polar(points[landmarks.OVAL])
    ruled = colours.classify(window, rounds)

    shares = _plausible(shares, window.small, points, radius)
    agreed = _agreement(shares, ruled, radius) > AGREED
    if agreed:
        _follow_rules(shares, ruled, inside, angle, radius)
    top = shares.argmax(0)
    labels = LABEL_OF[top]

    glasses, clear = _eyewear(window.small, labels, points, radius)
    thing = (labels == THING) & (radius < 1.25)
    worn = shares[portrait.CLOTH] + shares[portrait.HAT] + shares[portrait.THING] * ~thing
    behind, hair = shares[portrait.BACKGROUND], shares[portrait.HAIR]
    seen_through = shares[portrait.LENS] * clear
    body = shares[list(portrait.BODY)].sum(0) + seen_through
    outside = _continued(ruled.shares, behind, worn)
    four = np.where(inside, np.stack([behind, body, hair, worn]), outside)
    labels = np.where(inside, labels, outside.argmax(0)).astype(np.uint8)
    _settle_specks(four)
    dark = _hidden_side(ruled.hidden, top, window.small, radius) & agreed
    hidden = (thing | dark) & ~glasses
    four[:, glasses | hidden] = 0
    face = (four[SKIN] > 0.5) & (radius < 0.8)
    return Found(four, face, glasses, hidden, labels, shadow=_warped(shadow, to_frame) * inside)


def _joined(to_crop, to_frame):
    """[2, 3] from pixels of the crop to those of the face frame."""
    back = cv2.invertAffineTransform(to_crop)
    return np.column_stack([to_frame[:, :2] @ back[:, :2], apply(to_frame, back[:, 2])])


def _warped(plane, matrix):
    size = (prior.SIZE, prior.SIZE)
    return cv2.warpAffine(
        plane, warp_matrix(matrix), size, flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
    )


def _inside(matrix):
    """Where the crop lies in the face frame, [S, S] bool."""
    full = np.ones((portrait.SIDE, portrait.SIDE), np.uint8)
    return cv2.warpAffine(full, warp_matrix(matrix), (prior.SIZE, prior.SIZE)) > 0


def _plausible(shares, small, points, radius):
    """Shares [15, S, S] without things, beards and glasses that are hardly there.

    The network sees bits of hands in shadows and folds, and beards on shaved chins.
    """
    shares = shares.copy()
    top = shares.argmax(0)
    face = float((radius < 1).sum())
    area, sureness = SURE_THING
    _, parts = cv2.connectedComponents((top == portrait.THING).astype(np.uint8))
    sizes = np.bincount(parts.ravel())
    sums = np.bincount(parts.ravel(), shares[portrait.THING].ravel())
    sure = (sizes > area * face) & (sums / np.maximum(sizes, 1) > sureness)
    if not sure[1:].any():
        shares[portrait.THING] = 0
    beard = top == portrait.BEARD
    if beard.any() and not _bearded(shares[portrait.BEARD][beard], beard, small, points, radius):
        _take_over(shares, portrait.BEARD, portrait.SKIN, np.ones_like(beard))
    glasses = [portrait.FRAME, portrait.LENS]
    if np.isin(top, glasses).sum() < WORN * landmarks.face_size(points) ** 2:
        shares[glasses] = 0
    return shares / np.maximum(shares.sum(0), 1e-6)


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


def _agreement(shares, ruled, radius):
    """IoU of what both call skin in and around the face; hats, hands and hard light mislead the rules."""
    where = (radius < 1.3) & ~ruled.hidden & ~ruled.glasses
    one = np.isin(shares.argmax(0), (*portrait.BODY, portrait.LENS, portrait.FRAME))[where]
    other = ruled.shares[SKIN][where] > 0.5
    return (one & other).sum() / max((one | other).sum(), 1)


def _follow_rules(shares, ruled, inside, angle, radius):
    """Where hair ends and what is bare: the colour rules see it finer, or know it better."""
    top = shares.argmax(0)
    hairy = top == portrait.HAIR
    bare = (ruled.shares[SKIN] > 0.5) & (ruled.hue < HUE) & inside
    below = (radius > 1) & (angle > 110)
    _take_over(shares, portrait.CLOTH, portrait.NECK, bare & below)
    beside = (radius > 0.97) & (radius < 1.35) & (angle > 65) & (angle < 120)
    _take_over(shares, portrait.HAIR, portrait.EARS, bare & beside)
    _take_over(shares, portrait.HAIR, portrait.SKIN, bare & ~beside)
    side = 2 * round(HAIRLINE * prior.FACE) + 1
    near = cv2.dilate(hairy.astype(np.uint8), np.ones((side, side), np.uint8)) > 0
    grown = np.isin(top, portrait.BODY) & near & (ruled.shares[HAIR] > 0.5) & inside
    for label in portrait.BODY:
        _take_over(shares, label, portrait.HAIR, grown)


def _hidden_side(hidden, top, small, radius):
    """What the rules call hidden, unless it is skin in a shadow that still shows it.

    Light from one side makes a side darker than hair may be; it is the person's own nevertheless.
    """
    body = np.isin(top, portrait.BODY)
    dark, lit = hidden & body, body & ~hidden & (radius < 1)
    if not lit.any() or dark.sum() <= 0.5 * hidden.sum():
        return hidden  # mostly hair, as a fringe
    light = (small**2.2).mean(2)
    return hidden & (np.median(light[dark]) < DEEP * np.median(light[lit]))


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


def _continued(ruled, behind, worn):
    """Shares [4, S, S] outside of the crop: the rules', but clothes go on from the crop's border.

    Skin and hair are left to the rules: a bare chest ends no network's crop, hair seldom reaches it.
    """
    out = ruled.copy()
    either = ruled[BACKGROUND] + ruled[CLOTHES]
    known = np.maximum(ruled[CLOTHES] * worn + ruled[BACKGROUND] * behind, 1e-6)
    out[CLOTHES] = either * ruled[CLOTHES] * worn / known
    out[BACKGROUND] = either - out[CLOTHES]
    return out


def _settle_specks(four):
    """Give small parts of skin to what is around them, and small holes in it to the skin."""
    for mine, theirs in ((four[SKIN] > 0.5, False), (four[SKIN] <= 0.5, True)):
        _, parts, stats, _ = cv2.connectedComponentsWithStats(mine.astype(np.uint8), connectivity=4)
        small = stats[:, cv2.CC_STAT_AREA] < SPECK * prior.FACE**2
        small[0] = False
        lost = small[parts]
        if theirs:
            four[:, lost] = np.float32([[0], [1], [0], [0]])
        else:
            four[SKIN][lost] = 0
