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

from bakery.check import check_array
from bakery.stages import segment_prior as prior
from bakery.stages.segment_models import LAB_BINS, GuidedFilter, histogram, lab_bins

LABELS = ("background", "skin", "hair", "clothes", "glasses", "eyes", "lips", "mouth")
BACKGROUND, SKIN, HAIR, CLOTHES, GLASSES, EYES, LIPS, MOUTH = range(len(LABELS))

TEXTURE_BINS = 16
_SURE_SKIN = np.float32([0, 1, 0, 0])


@dataclass(frozen=True)
class Segmentation:
    """What each pixel of a portrait shows."""

    labels: np.ndarray  # [H, W] uint8 into LABELS; beards, brows and lashes count as skin
    skin: np.ndarray  # [H, W] float32 0..1: safe to unwrap; eyes, lips and mouth included

    def __post_init__(self):
        check_array("Segmentation.labels", self.labels, (None, None), high=len(LABELS) - 1)
        check_array("Segmentation.skin", self.skin, self.labels.shape, low=0, high=1)


@dataclass(frozen=True)
class SegmentOptions:
    rounds: int = 3  # of expectation maximisation
    rim: float = 0.012  # of the face size: skin this close to something else is left out
    feather: float = 0.025  # of the face size: width over which the mask rises behind the rim


def segment(encoded, points, options=SegmentOptions()):
    """Label a portrait and find the skin that can be unwrapped.

    Args:
        encoded: [H, W, 3] float32 sRGB-encoded 0..1.
        points: [478, 2] pixels; more columns are ignored.

    Returns:
        Segmentation: labels are background wherever more than about 1.4 face sizes from the face.

    Raises:
        ValueError: a wrong shape, or points without extent.
    """
    check_array("encoded", encoded, (None, None, 3))
    points = np.asarray(points, np.float64)[:, :2]
    check_array("points", points, (478, 2))
    to_frame = prior.face_frame(points)
    left, top, right, bottom = _frame_box(to_frame, encoded.shape)
    part = np.ascontiguousarray(encoded[top:bottom, left:right], np.float32)
    to_frame = np.column_stack([to_frame[:, :2], to_frame @ [left, top, 1]])
    small = _warp_down(part, to_frame)
    shares, inside = _classify(small, _apply(to_frame, points - [left, top]), options.rounds)
    labels = np.zeros(encoded.shape[:2], np.uint8)
    skin = np.zeros(encoded.shape[:2], np.float32)
    labels[top:bottom, left:right], skin[top:bottom, left:right] = _enlarge(
        part, small, to_frame, shares, inside, points - [left, top], options
    )
    return Segmentation(labels, skin)


def occlusion(segmentation, points):
    """How much of the face is hidden.

    Args:
        segmentation: of the photo.
        points: [478, 2] pixels.

    Returns:
        dict of shares 0..1: `hair` of the face contour's inside, `forehead_hair` of its part above
        the brows, `glasses` of the region of the eyes, from brow to mid-nose.
    """
    points = np.asarray(points, np.float64)[:, :2]
    height, width = segmentation.labels.shape
    to_frame = prior.face_frame(points)
    labels = cv2.warpAffine(
        segmentation.labels, to_frame, (prior.SIZE, prior.SIZE), flags=cv2.INTER_NEAREST
    )
    points = _apply(to_frame, points)
    _, radius = prior.polar(points[list(prior.FACE_CONTOUR)])
    rows = np.arange(prior.SIZE)[:, None] + 0.5
    face = radius < 0.92
    brows = points[list(prior.RIGHT_BROW + prior.LEFT_BROW), 1]
    forehead = face & (rows < brows.min())
    eyes = face & (rows > brows.mean()) & (rows < points[195, 1])

    def share(label, region):
        return float((labels[region] == label).mean()) if region.any() else 0.0

    return {
        "hair": share(HAIR, face),
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
        raise ValueError("points: all outside the photo; needs points in pixels of this photo")
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


def _polygon(points, shape=(prior.SIZE, prior.SIZE)):
    """[H, W] bool, the inside of a polygon of pixel coordinates."""
    mask = np.zeros(shape, np.uint8)
    cv2.fillPoly(mask, [np.round((points - 0.5) * 16).astype(np.int32)], 1, shift=4)
    return mask > 0


def _hull(points):
    return _polygon(cv2.convexHull(points.astype(np.float32))[:, 0])


def _texture(lightness):
    """[H, W] int32 bin of the strength of fine detail; lone edges do not count."""
    detail = np.clip(lightness - cv2.GaussianBlur(lightness, (0, 0), 1.5), -4, 4)
    energy = cv2.erode(cv2.GaussianBlur(detail * detail, (0, 0), 2), np.ones((7, 7), np.uint8))
    return np.clip(np.log2(np.sqrt(energy) + 0.2) * 3 + 7, 0, TEXTURE_BINS - 1).astype(np.int32)


def _shade(small):
    """[H, W, 3] log red/green, log blue/green, log green of linear light."""
    linear = cv2.GaussianBlur(small, (0, 0), 1) ** 2.2 + 0.004
    logs = cv2.log(linear)
    return np.stack([logs[..., 0] - logs[..., 1], logs[..., 2] - logs[..., 1], logs[..., 1]], -1)


def _classify(small, points, rounds):
    """Shares of background, skin, hair and clothes in the face frame.

    Returns:
        shares [SIZE, SIZE, 4] and the pixels [SIZE, SIZE] bool that the landmarks alone say are face.
    """
    angle, radius = prior.polar(points[list(prior.FACE_CONTOUR)])
    lab = cv2.cvtColor(small, cv2.COLOR_RGB2LAB)
    colors, textures = lab_bins(lab), _texture(lab[..., 0])
    rows = np.arange(prior.SIZE, dtype=np.float32)[:, None] + 0.5

    eyes = _hull(points[list(prior.RIGHT_EYE)]) | _hull(points[list(prior.LEFT_EYE)])
    brows = _hull(points[list(prior.RIGHT_BROW)]) | _hull(points[list(prior.LEFT_BROW)])
    lips = _polygon(points[list(prior.LIPS)])
    brow_rows = points[list(prior.RIGHT_BROW + prior.LEFT_BROW), 1]
    marks = cv2.dilate((eyes | brows).astype(np.uint8), np.ones((9, 9), np.uint8)) > 0
    bearded = (rows > points[2, 1] - 4) & (radius < 1)  # where a beard may grow
    seed = (radius < 0.72) & ~marks & ~bearded
    face = eyes | brows | lips | ((radius < 0.8) & (rows > brow_rows.mean())) | (radius < 0.45)
    face |= (angle > 130) & (radius < 0.97)

    skin_colors = histogram(colors, seed.astype(np.float32), LAB_BINS)
    like_skin = _likeness(skin_colors, colors, seed, 20)
    impossible = _unlike_skin(_shade(small), seed, angle, radius)
    expected = _expected(angle, radius, rows < brow_rows.min())

    far = (expected[..., BACKGROUND] > 0.6) & (radius > 1.3)
    like_background = _likeness(
        histogram(colors, far.astype(np.float32), LAB_BINS), colors, far, 10
    ) * (radius > 1)

    # how much each pixel may teach the colours of each class
    teach = np.ones((*radius.shape, 4), np.float32)
    teach[..., SKIN] = (1 - 0.8 * like_background) * ~(bearded | marks | lips)
    teach[..., HAIR] = (1 - 0.95 * like_skin) * (1 - 0.997 * like_background) * ~(bearded | marks)
    teach[..., CLOTHES] = 1 - 0.9 * like_skin

    shares = expected * teach
    shares[..., SKIN] *= np.where(seed, 1, 0.15 + 0.85 * like_skin)
    shares /= shares.sum(-1, keepdims=True) + 1e-6
    prior_log = np.log(expected + 1e-4)
    prior_log[..., SKIN] -= impossible
    ears = (radius > 1) & (radius < 1.3) & (angle > 75) & (angle < 115)  # folded, not hairy
    plain = np.where(ears, np.float32(0.3), np.float32(1))
    smooth = GuidedFilter(small, 4, 2e-4)
    for _ in range(rounds):
        score = prior_log.copy()
        for k in range(4):
            weights = shares[..., k] * teach[..., k]
            color = histogram(colors, weights, LAB_BINS)
            if k == SKIN:
                color = (color + skin_colors) / 2
            texture = histogram(textures, weights, (TEXTURE_BINS,))
            score[..., k] += np.log(color + 3e-6)[colors]
            score[..., k] += (0.6 * np.log(texture + 0.01)[textures]) * plain
        score = cv2.exp(score - score.max(-1, keepdims=True))
        score /= score.sum(-1, keepdims=True)
        score[face] = _SURE_SKIN
        shares = np.clip(smooth(score), 0, 1)
        shares /= shares.sum(-1, keepdims=True) + 1e-6
        shares[face] = _SURE_SKIN
    return _fill_holes(shares, lab[..., 0], angle, radius, seed), face


def _likeness(colors, bins, region, percentile):
    """[H, W] 0..1, how common a pixel's colour is in a region; 1 above the percentile given."""
    if region.sum() < 100:
        return np.zeros(bins.shape, np.float32)
    common = colors[bins]
    return np.minimum(common / (np.percentile(common[region], percentile) + 1e-9), 1)


def _expected(angle, radius, above_brows):
    """[H, W, 4] class shares of the landmarks alone, with room for fringes, strands and baldness."""
    shares = prior.class_shares(angle, radius)
    expected = np.empty((*angle.shape, 4), np.float32)
    expected[..., BACKGROUND] = 1 - shares.sum(-1)
    expected[..., SKIN:] = shares
    expected = np.clip(expected, 0, 1) + 0.003
    expected[..., BACKGROUND] = np.where(radius < 1.02, 1e-3, expected[..., BACKGROUND] + 0.06)
    expected[..., SKIN] += 0.02 * ((radius < 1.8) & ((angle > 60) | (radius < 1.25)))
    fringe = np.clip((radius - 0.45) * 0.5, 0, 0.2) * (above_brows & (angle < 75))
    strands = np.clip((radius - 0.72) * 0.6, 0, 0.12) * (angle >= 60)
    expected[..., HAIR] += fringe + strands
    under_chin = (angle > 125) & (radius < 1.3)  # dark there is shadow or beard
    expected[..., HAIR] = np.where(under_chin, 0.004, expected[..., HAIR])
    return expected / expected.sum(-1, keepdims=True)


def _unlike_skin(shade, seed, angle, radius):
    """[H, W] penalty in nats of being skin: hue off the person's own, or far darker or brighter.

    Skin in shadow keeps its hue, so that darkness is forgiven more than a change of hue. Inside the
    face bright spots are highlights, and under the chin dark ones are beard or shadow.
    """
    samples = shade[seed]
    middle = np.median(samples, 0)
    spread = np.maximum(np.median(np.abs(samples - middle), 0) * 1.5, (0.12, 0.12, 0.35))
    off = (shade - middle.astype(np.float32)) / spread.astype(np.float32)
    hue = np.maximum(np.hypot(off[..., 0], off[..., 1]) - 2.5, 0)
    dark = np.maximum(-off[..., 2] - 5, 0)
    bright = np.maximum(off[..., 2] - 3.5, 0)
    penalty = np.minimum(1.5 * hue + 1.5 * dark + bright, 8)
    penalty[(radius < 0.95) & (off[..., 2] > 0.5)] = 0
    penalty[(radius < 1.1) & (angle > 125)] *= 0.25
    return penalty


def _fill_holes(shares, lightness, angle, radius, seed):
    """Give islands inside the skin to the skin: highlights, moles, shadow under the chin.

    Larger dark islands on the forehead stay out; they are tips of a fringe.
    """
    other = (shares.argmax(-1) != SKIN).astype(np.uint8)
    usual = np.median(lightness[seed])
    count, parts, stats, centers = cv2.connectedComponentsWithStats(other, connectivity=4)
    for k in range(1, count):
        left, top, width, height, area = stats[k]
        at_border = min(left, top) == 0 or max(left + width, top + height) == prior.SIZE
        if at_border or area > 0.05 * prior.FACE**2:
            continue
        island = parts == k
        column, row = centers[k].astype(int)
        bright = lightness[island].mean() > usual and radius[row, column] < 0.9
        if bright or area < 0.0015 * prior.FACE**2 or angle[row, column] > 120:
            shares[cv2.dilate(island.astype(np.uint8), np.ones((3, 3), np.uint8)) > 0] = _SURE_SKIN
    return shares


def _enlarge(part, small, to_frame, shares, face, points, options):
    """Labels and soft skin mask at the photo's own resolution, edges refined by its pixels."""
    size = part.shape[1::-1]
    matrix = _warp_matrix(to_frame)

    def back(maps):
        return cv2.warpAffine(
            maps,
            matrix,
            size,
            flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
            borderMode=cv2.BORDER_REPLICATE,
        )

    slopes, offset = GuidedFilter(small, 2, 1e-4).coefficients(shares[..., SKIN : SKIN + 1])
    model = back(np.concatenate([*slopes, offset], -1))
    refined = np.einsum("ijk,ijk->ij", model[..., :3], part) + model[..., 3]

    distance = cv2.distanceTransform(
        (shares[..., SKIN] > 0.5).astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_5
    )
    rim = np.clip((distance - options.rim * prior.FACE) / (options.feather * prior.FACE), 0, 1)
    maps = back(np.dstack([rim, face.astype(np.float32), *np.moveaxis(shares[..., 2:], -1, 0)]))
    sure = np.clip((refined - 0.55) / 0.3, 0, 1)
    skin = maps[..., 0] * np.maximum(sure, maps[..., 1])

    is_skin = np.maximum(refined, maps[..., 1]) > 0.5
    hair, clothes = maps[..., 2], maps[..., 3]
    other = np.where(hair > clothes, np.uint8(HAIR), np.uint8(CLOTHES))
    other[2 * np.maximum(hair, clothes) < 1 - np.minimum(hair, clothes)] = BACKGROUND
    labels = np.where(is_skin, np.uint8(SKIN), other)
    for label, contours in (
        (EYES, (prior.RIGHT_EYE, prior.LEFT_EYE)),
        (LIPS, (prior.LIPS,)),
        (MOUTH, (prior.INNER_LIPS,)),
    ):
        for contour in contours:
            labels[_polygon(points[list(contour)], part.shape[:2])] = label
    return labels, skin.astype(np.float32)
