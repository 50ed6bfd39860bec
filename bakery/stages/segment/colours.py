"""Tell the classes apart by colours: the rules that need no network.

The landmarks say where skin, hair and clothes usually are (`prior`). Colours and texture of each
class are learned from this one photo, starting at the cheeks, the nose and the middle of the
forehead, and both are balanced in a few rounds of expectation maximisation whose class maps are
smoothed along the edges of the photo. In doubt a pixel is not skin: what is left out is filled with
the person's own skin later, what is let in by mistake shows as a smear.
"""

import cv2
import numpy as np

from bakery import landmarks
from bakery.stages.segment import prior
from bakery.stages.segment.classes import BACKGROUND, CLOTHES, HAIR, SKIN, Found
from bakery.stages.segment.enlarge import Window
from bakery.stages.segment.frame import apply, hull, polygon
from bakery.stages.segment.models import LAB_BINS, GuidedFilter, histogram, lab_bins
from bakery.stages.segment.overlays import find_eyewear, find_occlusion, find_strands

TEXTURE_BINS = 16
_SURE_SKIN, _SURE_HAIR = np.float32([[[0], [1], [0], [0]], [[0], [0], [1], [0]]])


def _texture(lightness):
    """[H, W] int32 bin of the strength of fine detail; lone edges do not count."""
    detail = np.clip(lightness - cv2.GaussianBlur(lightness, (0, 0), 1.5), -4, 4)
    energy = cv2.erode(cv2.GaussianBlur(detail * detail, (0, 0), 2), np.ones((7, 7), np.uint8))
    return np.clip(np.log2(np.sqrt(energy) + 0.2) * 3 + 7, 0, TEXTURE_BINS - 1).astype(np.int32)


def classify(window: Window, rounds: int) -> Found:
    """Classes of a photo in its face frame.

    Args:
        rounds: of expectation maximisation.
    """
    small, points = window.small, apply(window.to_frame, window.points)
    angle, radius = prior.polar(points[landmarks.OVAL])
    lab = cv2.cvtColor(small, cv2.COLOR_RGB2LAB)
    lightness = np.ascontiguousarray(lab[..., 0])
    colors, textures = lab_bins(lab), _texture(lightness)
    rows = np.arange(prior.SIZE, dtype=np.float32)[:, None] + 0.5

    eyes = hull(points[landmarks.EYE_RIGHT]) | hull(points[landmarks.EYE_LEFT])
    brows = hull(points[landmarks.BROW_RIGHT]) | hull(points[landmarks.BROW_LEFT])
    lips = polygon(points[landmarks.LIPS_OUTER])
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
    hidden = find_occlusion(small, colors, expected[HAIR] > 0.55, seed & ~glasses, radius)
    hidden &= (radius < 1) | ((radius < 1.25) & (shares[SKIN] > 0.5))
    shares[:, glasses | hidden] = 0
    return Found(shares, face & ~glasses & ~hidden, glasses, hidden & ~glasses)


def _bare_brows(skin, points):
    """[SIZE, SIZE] bool, the brows with skin above them, not a fringe."""
    bare = np.zeros(skin.shape, bool)
    for contour in (landmarks.BROW_RIGHT, landmarks.BROW_LEFT):
        brow = points[list(contour)]
        above = hull(brow - [0, 0.1 * prior.FACE]) & ~hull(brow)
        if above.any() and skin[above].mean() > 0.6:
            bare |= cv2.dilate(hull(brow).astype(np.uint8), np.ones((7, 7), np.uint8)) > 0
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
