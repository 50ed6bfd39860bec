"""Tell skin from hair, clothes, glasses and background in a portrait.

The landmarks say where skin, hair and clothes usually are (`segment_prior`). Colours and texture of
each class are learned from this one photo, starting at the cheeks, the nose and the middle of the
forehead, and both are balanced in a few rounds of expectation maximisation whose class maps are
smoothed along the edges of the photo. In doubt a pixel is not skin: what is left out is filled with
the person's own skin later, what is let in by mistake shows as a smear.
"""

from dataclasses import dataclass

import cv2
import numpy as np

from bakery import landmarks
from bakery.check import check_array
from bakery.errors import FitError
from bakery.settings import Settings, setting
from bakery.stages.segment import prior
from bakery.stages.segment.models import LAB_BINS, GuidedFilter, histogram, lab_bins
from bakery.stages.segment.overlays import find_cover, find_eyewear, find_strands

LABELS = ("background", "skin", "hair", "clothes", "glasses", "eyes", "lips", "mouth", "hidden")
BACKGROUND, SKIN, HAIR, CLOTHES, GLASSES, EYES, LIPS, MOUTH, HIDDEN = range(len(LABELS))

TEXTURE_BINS = 16
_SURE_SKIN, _SURE_HAIR = np.float32([[[0], [1], [0], [0]], [[0], [0], [1], [0]]])


@dataclass(frozen=True)
class Segmentation:
    """What each pixel of a portrait shows."""

    labels: np.ndarray  # [H, W] uint8 into LABELS; beards, brows and lashes count as skin
    skin: np.ndarray  # [H, W] float32 0..1: safe to unwrap; eyes, lips and mouth included

    def __post_init__(self):
        check_array("Segmentation.labels", self.labels, (None, None), high=len(LABELS) - 1)
        check_array("Segmentation.skin", self.skin, self.labels.shape, low=0, high=1)


@dataclass(frozen=True)
class SegmentOptions(Settings):
    """How the portrait is labelled. Lengths are shares of the face size."""

    rounds: int = setting(3, "rounds of expectation maximisation", 1, 20)
    rim: float = setting(0.012, "skin this close to something else is left out", 0, 0.2)
    feather: float = setting(0.025, "width over which the mask rises behind the rim", 0.001, 0.5)


def segment(
    encoded: np.ndarray, points: np.ndarray, options: SegmentOptions = SegmentOptions()
) -> Segmentation:
    """Label a portrait and find the skin that can be unwrapped.

    Args:
        encoded: [H, W, 3] float32 sRGB-encoded 0..1.
        points: [478, 2] pixels; more columns are ignored.

    Returns:
        Segmentation: labels are background wherever more than about 1.4 face sizes from the face.

    Raises:
        ValueError: a wrong shape.
        FitError: points without extent, or none near the photo.
    """
    check_array("encoded", encoded, (None, None, 3))
    points = np.asarray(points, np.float64)[:, :2]
    check_array("points", points, (478, 2))
    to_frame = prior.face_frame(points)
    left, top, right, bottom = _frame_box(to_frame, encoded.shape)
    part = np.ascontiguousarray(encoded[top:bottom, left:right], np.float32)
    to_frame = np.column_stack([to_frame[:, :2], to_frame @ [left, top, 1]])
    small = np.clip(_warp_down(part, to_frame), 0, 1)
    shares, known = _classify(small, _apply(to_frame, points - [left, top]), options.rounds)
    labels = np.zeros(encoded.shape[:2], np.uint8)
    skin = np.zeros(encoded.shape[:2], np.float32)
    labels[top:bottom, left:right], skin[top:bottom, left:right] = _enlarge(
        part, small, to_frame, shares, known, points - [left, top], options
    )
    return Segmentation(labels, skin)


def occlusion(segmentation, points):
    """How much of the face is hidden.

    Args:
        segmentation: of the photo.
        points: [478, 2] pixels.

    Returns:
        dict of shares 0..1: `hair` and `hidden` of the face contour's inside, `forehead_hair` of
        its part above the brows, `glasses` of the region of the eyes, from brow to mid-nose.
    """
    points = np.asarray(points, np.float64)[:, :2]
    height, width = segmentation.labels.shape
    to_frame = prior.face_frame(points)
    labels = cv2.warpAffine(
        segmentation.labels, to_frame, (prior.SIZE, prior.SIZE), flags=cv2.INTER_NEAREST
    )
    points = _apply(to_frame, points)
    _, radius = prior.polar(points[landmarks.OVAL])
    rows = np.arange(prior.SIZE)[:, None] + 0.5
    face = radius < 0.92
    brows = points[landmarks.BROWS, 1]
    forehead = face & (rows < brows.min())
    eyes = face & (rows > brows.mean()) & (rows < points[195, 1])

    def share(label, region):
        return float((labels[region] == label).mean()) if region.any() else 0.0

    return {
        "hair": share(HAIR, face),
        "hidden": share(HIDDEN, face),
        "forehead_hair": share(HAIR, forehead),
        "glasses": share(GLASSES, eyes),
    }


def _apply(matrix, points):
    return points @ matrix[:, :2].T + matrix[:, 2]


def _frame_box(to_frame, shape):
    """The part of the photo that the face frame covers: left, top, right, bottom."""
    corners = np.array([[0, 0], [1, 0], [0, 1], [1, 1]]) * prior.SIZE
    corners = _apply(cv2.invertAffineTransform(to_frame), corners)
    limit = np.array([shape[1], shape[0]])
    low = np.clip(np.floor(corners.min(0)).astype(int), 0, limit)
    high = np.clip(np.ceil(corners.max(0)).astype(int), 0, limit)
    if (high <= low).any():
        raise FitError(
            "all landmarks lie outside the photo, pixels of this photo are needed; check the "
            "landmark file"
        )
    return *low, *high


def _warp_matrix(matrix):
    """The same similarity for OpenCV, whose pixel centres lie on whole numbers."""
    shift = matrix[:, :2] @ [0.5, 0.5] - 0.5
    return np.column_stack([matrix[:, :2], matrix[:, 2] + shift])


def _warp_down(part, to_frame):
    """The photo in the face frame, averaged where it shrinks."""
    scale = np.sqrt(abs(np.linalg.det(to_frame[:, :2])))
    if scale < 1:
        size = np.maximum(np.round(np.array(part.shape[1::-1]) * scale), 1).astype(int)
        ratio = np.array(part.shape[1::-1]) / size
        part = cv2.resize(part, tuple(size.tolist()), interpolation=cv2.INTER_AREA)
        to_frame = np.column_stack([to_frame[:, :2] * ratio, to_frame[:, 2]])
    return cv2.warpAffine(
        part,
        _warp_matrix(to_frame),
        (prior.SIZE, prior.SIZE),
        flags=cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_REPLICATE,
    )


def _draw_polygon(mask, points, value):
    """Fill a polygon of pixel coordinates."""
    cv2.fillPoly(mask, [np.round((points - 0.5) * 16).astype(np.int32)], value, shift=4)


def _polygon(points):
    """[SIZE, SIZE] bool, the inside of a polygon of the face frame."""
    mask = np.zeros((prior.SIZE, prior.SIZE), np.uint8)
    _draw_polygon(mask, points, 1)
    return mask > 0


def _hull(points):
    return _polygon(cv2.convexHull(points.astype(np.float32))[:, 0])


def _texture(lightness):
    """[H, W] int32 bin of the strength of fine detail; lone edges do not count."""
    detail = np.clip(lightness - cv2.GaussianBlur(lightness, (0, 0), 1.5), -4, 4)
    energy = cv2.erode(cv2.GaussianBlur(detail * detail, (0, 0), 2), np.ones((7, 7), np.uint8))
    return np.clip(np.log2(np.sqrt(energy) + 0.2) * 3 + 7, 0, TEXTURE_BINS - 1).astype(np.int32)


def _classify(small, points, rounds):
    """Shares of background, skin, hair and clothes in the face frame.

    Returns:
        shares [4, SIZE, SIZE]; known [3, SIZE, SIZE] bool: surely face, surely glasses, hidden.
    """
    angle, radius = prior.polar(points[landmarks.OVAL])
    lab = cv2.cvtColor(small, cv2.COLOR_RGB2LAB)
    lightness = np.ascontiguousarray(lab[..., 0])
    colors, textures = lab_bins(lab), _texture(lightness)
    rows = np.arange(prior.SIZE, dtype=np.float32)[:, None] + 0.5

    eyes = _hull(points[landmarks.EYE_RIGHT]) | _hull(points[landmarks.EYE_LEFT])
    brows = _hull(points[landmarks.BROW_RIGHT]) | _hull(points[landmarks.BROW_LEFT])
    lips = _polygon(points[landmarks.LIPS_OUTER])
    brow_rows = points[landmarks.BROWS, 1]
    marks = cv2.dilate((eyes | brows).astype(np.uint8), np.ones((9, 9), np.uint8)) > 0
    bearded = (rows > points[2, 1] - 4) & (radius < 1)  # where a beard may grow
    seed = (radius < 0.72) & ~marks & ~bearded
    face = eyes | lips | ((radius < 0.8) & (rows > brow_rows.max()))
    face |= ((radius < 0.45) & (rows > brow_rows.mean())) | ((angle > 130) & (radius < 0.97))

    skin_colors = histogram(colors, seed.astype(np.float32), LAB_BINS)
    like_skin = _likeness(skin_colors, colors, seed, 20)
    hue, impossible = _unlike_skin(small, seed, angle, radius)
    # ears and neck lie in shadow: the face's hue is enough for them
    shaded = np.where(angle > 75, np.log(0.003) - 0.5 * hue * hue, -99).astype(np.float32)
    expected = _expected(angle, radius, rows < brow_rows.min())

    far = (expected[BACKGROUND] > 0.6) & (radius > 1.3)
    far_colors = histogram(colors, far.astype(np.float32), LAB_BINS)
    like_background = _likeness(far_colors, colors, far, 10) * (radius > 1)

    # how much each pixel may teach the colours of each class
    teach = np.ones((4, *radius.shape), np.float32)
    teach[SKIN] = (1 - 0.8 * like_background) * ~(bearded | marks | lips)
    teach[HAIR] = (1 - 0.95 * like_skin) * (1 - 0.997 * like_background) * ~(bearded | marks)
    teach[CLOTHES] = 1 - 0.9 * like_skin

    shares = expected * teach
    shares[SKIN] *= np.where(seed, 1, 0.15 + 0.85 * like_skin)
    shares /= shares.sum(0) + 1e-6
    known = np.log(expected + 1e-4)
    known[SKIN] -= impossible
    ears = (radius > 1) & (radius < 1.3) & (angle > 75) & (angle < 115)  # folded, not hairy
    trust = np.where(ears, np.float32(0.2), np.float32(0.6))  # in texture
    smooth = GuidedFilter(np.stack(cv2.split(small)), 4, 2e-4)
    for turn in range(rounds):
        score = known.copy()
        for k in range(4):
            weights = (shares[k] * teach[k])[::2, ::2]
            color = histogram(colors[::2, ::2], weights, LAB_BINS)
            if k == SKIN:
                color = (color + skin_colors) / 2
            texture = histogram(textures[::2, ::2], weights, (TEXTURE_BINS,))
            likely = np.log(color + 3e-6)[colors]
            score[k] += np.maximum(likely, shaded) if k == SKIN else likely
            score[k] += trust * np.log(texture + 0.01)[textures]
        shares = np.exp(score - score.max(0))
        shares /= shares.sum(0)
        shares[:, face] = _SURE_SKIN
        if turn < rounds - 1:
            shares = np.stack([cv2.blur(plane, (5, 5)) for plane in shares])
        else:
            shares[1:] = [np.clip(smooth(plane), 0, 1) for plane in shares[1:]]
            shares[BACKGROUND] = np.maximum(1 - shares[1:].sum(0), 0)
    face |= _bare_brows(shares[SKIN], points)
    shares[:, face] = _SURE_SKIN
    shares = _settle_islands(shares, lightness, angle, radius, seed)
    strands = find_strands(lightness, shares[HAIR] > 0.5, points, radius) & ~face
    shares[:, strands] = _SURE_HAIR
    glasses = find_eyewear(small, lightness, points, radius)
    hidden = find_cover(small, colors, expected[HAIR] > 0.55, seed & ~glasses, radius)
    hidden &= (radius < 1) | ((radius < 1.25) & (shares[SKIN] > 0.5))
    shares[:, glasses | hidden] = 0
    return shares, np.stack([face & ~glasses & ~hidden, glasses, hidden & ~glasses])


def _bare_brows(skin, points):
    """[SIZE, SIZE] bool, the brows with skin above them, not a fringe."""
    bare = np.zeros(skin.shape, bool)
    for contour in (landmarks.BROW_RIGHT, landmarks.BROW_LEFT):
        brow = points[list(contour)]
        above = _hull(brow - [0, 0.1 * prior.FACE]) & ~_hull(brow)
        if above.any() and skin[above].mean() > 0.6:
            bare |= cv2.dilate(_hull(brow).astype(np.uint8), np.ones((7, 7), np.uint8)) > 0
    return bare


def _likeness(colors, bins, region, percentile):
    """[H, W] 0..1, how common a pixel's colour is in a region; 1 above the percentile given."""
    if region.sum() < 100:
        return np.zeros(bins.shape, np.float32)
    common = colors[bins]
    return np.minimum(common / (np.percentile(common[region], percentile) + 1e-9), 1)


def _expected(angle, radius, above_brows):
    """[4, H, W] class shares of the landmarks alone, with room for fringes, strands and baldness."""
    shares = prior.class_shares(angle, radius)
    expected = np.clip(np.concatenate([1 - shares.sum(0, keepdims=True), shares]), 0, 1) + 0.003
    expected[BACKGROUND] = np.where(radius < 1.02, 1e-3, expected[BACKGROUND] + 0.06)
    expected[SKIN] += 0.02 * ((radius < 1.8) & ((angle > 60) | (radius < 1.25)))
    fringe = np.clip((radius - 0.45) * 0.5, 0, 0.2) * (above_brows & (angle < 75))
    strands = np.clip((radius - 0.72) * 0.6, 0, 0.08) * (angle >= 60)
    expected[HAIR] += fringe + strands
    chin = ((angle > 125) & (radius < 1.05)) | ((angle > 145) & (radius < 1.3))
    expected[HAIR][chin] = 0.004  # dark there is shadow or beard
    return expected / expected.sum(0)


def _unlike_skin(small, seed, angle, radius):
    """How far a pixel's hue is off the person's skin, and the penalty of calling it skin.

    Skin in shadow keeps its hue, so that darkness is forgiven more than a change of hue. Inside the
    face bright spots are highlights, and under the chin dark ones are beard or shadow.

    Returns:
        hue [H, W] in standard deviations, penalty [H, W] in nats.
    """
    red, green, blue = cv2.split(cv2.log(cv2.GaussianBlur(small, (0, 0), 1) ** 2.2 + 0.004))
    planes = []
    for plane, least in ((red - green, 0.12), (blue - green, 0.12), (green, 0.35)):
        middle = np.median(plane[seed])
        spread = 1.5 * np.median(np.abs(plane[seed] - middle))
        planes.append((plane - middle) / max(spread, least))
    hue, light = np.hypot(planes[0], planes[1]), planes[2]
    dark = np.maximum(-light - 5, 0)
    bright = np.maximum(light - 3.5, 0)
    penalty = np.minimum(1.5 * np.maximum(hue - 2.5, 0) + 1.5 * dark + bright, 8)
    penalty[(radius < 0.95) & (light > 0.5)] = 0
    penalty[(radius < 1.1) & (angle > 125)] *= 0.25
    return hue, penalty


def _settle_islands(shares, lightness, angle, radius, seed):
    """Give islands inside the skin to the skin: highlights, moles, shadow under the chin.

    Larger dark islands on the forehead stay out; they are tips of a fringe. Specks of skin in hair
    or background go too; only ears and neck may lie apart from the face.
    """
    other = (shares[SKIN] < 0.5).astype(np.uint8)
    usual = np.median(lightness[seed])
    count, parts, stats, centers = cv2.connectedComponentsWithStats(other, connectivity=4)
    for k in range(1, count):
        left, top, width, height, area = stats[k]
        at_border = min(left, top) == 0 or max(left + width, top + height) == prior.SIZE
        if at_border or area > 0.08 * prior.FACE**2:
            continue
        column, row = centers[k].astype(int)
        inside = radius[row, column] < 0.9
        island = parts[top : top + height, left : left + width] == k
        bright = lightness[top : top + height, left : left + width][island].mean() > usual
        chin = angle[row, column] > 120
        if (inside and bright) or chin or area < 0.0015 * prior.FACE**2:
            other[parts == k] = 0
    count, parts, stats, centers = cv2.connectedComponentsWithStats(1 - other, connectivity=4)
    main = np.bincount(parts[seed], minlength=count).argmax()
    for k in range(1, count):
        column, row = np.clip(centers[k].astype(int), 0, prior.SIZE - 1)
        small = stats[k, cv2.CC_STAT_AREA] < 0.002 * prior.FACE**2
        ear_or_neck = angle[row, column] > 70 and radius[row, column] < 2
        if k != main and (small or not ear_or_neck):
            lost = parts == k
            other[lost] = 1
            shares[HAIR][lost] += shares[SKIN][lost]
            shares[SKIN][lost] = 0
    inner = cv2.erode(1 - other, np.ones((9, 9), np.uint8)) > 0
    shares[:, inner] = _SURE_SKIN
    return shares


def _enlarge(part, small, to_frame, shares, known, points, options):
    """Labels and soft skin mask at the photo's own resolution, edges refined by its pixels."""
    matrix = _warp_matrix(to_frame)

    def back(planes):
        return cv2.warpAffine(
            cv2.merge(list(planes)),
            matrix,
            part.shape[1::-1],
            flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
            borderMode=cv2.BORDER_REPLICATE,
        )

    def coarse(plane):
        return cv2.convertScaleAbs(plane.astype(np.float32), alpha=255)

    model = back(GuidedFilter(np.stack(cv2.split(small)), 2, 1e-4).coefficients(shares[SKIN]))
    refined = np.einsum("ijk,ijk->ij", model[..., :3], part) + model[..., 3]

    face, glasses, hidden = known
    solid = (shares[SKIN] > 0.5).astype(np.uint8)
    distance = cv2.distanceTransform(solid, cv2.DIST_L2, cv2.DIST_MASK_5) / prior.FACE
    rim = np.clip((distance - options.rim) / options.feather, 0, 1)
    planes = back([coarse(plane) for plane in (rim, face, shares[HAIR], shares[CLOTHES])])
    rim, face, hair, clothes = (cv2.extractChannel(planes, k) for k in range(4))
    skin = np.clip((refined - 0.55) / 0.3, 0, 1)
    skin = np.maximum(skin, face * np.float32(1 / 255)) * rim * np.float32(1 / 255)

    labels = np.where(hair > clothes, np.uint8(HAIR), np.uint8(CLOTHES))
    labels[np.maximum(hair, clothes) < 85] = BACKGROUND
    labels[(refined > 0.5) | (face > 127)] = SKIN
    for found, label in ((glasses, GLASSES), (hidden, HIDDEN)):
        if found.any():
            labels[back([coarse(found)]) > 127] = label
    seen = (labels != HIDDEN) & (labels != GLASSES)
    shown = labels.copy()
    for label, contours in (
        (EYES, (landmarks.EYE_RIGHT, landmarks.EYE_LEFT)),
        (LIPS, (landmarks.LIPS_OUTER,)),
        (MOUTH, (landmarks.LIPS_INNER,)),
    ):
        for contour in contours:
            _draw_polygon(shown, points[list(contour)], label)
    return np.where(seen, shown, labels), skin
