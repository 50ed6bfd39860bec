"""What of labelled hair is none, by the photo's own colours: bald tops are skin, scarves are clothes."""

import cv2
import numpy as np

from bakery.geometry.fill import diffuse, normalized_blur, smoothstep

ON_CLOTHES = 10.0  # mm along which a patch touches clothes that is a part of them
FOLDS = 8.0  # mm around cloth, in whose shadow nothing is told by its colour
GAUDY = 22.0, 0.4  # CIELAB chroma off the hair's, and of that how far off the clothes' cloth may be
SMOOTH = 0.8  # mm over which a colour is taken
WIDE = 2.0  # mm over which it is judged
FINEST = 1.0  # mm: strands differ from what is around them
RIM = (1.5, 3.5)  # mm from the backdrop, whose light is mixed in: little is told by it, all
LEAST = 0.02  # weight of what lies in it, where there is nothing else
EVENLY = np.full(3, 1 / 3, np.float32)
LIGHT = 0.5  # of a difference of CIELAB lightness, beside one of hue: shade is not another thing
MOST_UNLIKE = 0.7  # share of the hair that is less unlike skin than what stands for all
LIKE = 0.3, 0.5  # of the way from skin's colour to hair's: skin up to it, hair from it on
HUE = 0.3, 0.45  # the same of the hue alone, as a share of how colourful skin is
STRANDS = 0.035, 0.05  # log brightness by which strands differ from one to the next, beyond skin
# Of what is labelled hair so much is bare and the rest so near to skin (CIELAB) that all is bare; nearer
# still, only strands tell.
SHAVED = 0.5, 20.0, 11.0
SPECK = 60.0  # mm2: smaller patches of either are mistakes
NARROW = 2.5  # mm, half the width of ways into hair that none is bare beyond
EAR_TOP = 14.0  # mm around an ear that may be its top
UNLIKE_EAR = 15.0  # CIELAB, by which hair differs from an ear that is told from it
THREAD = 1.0  # mm, half the width of lines of hair that are left between skin and skin


def length(vectors: np.ndarray) -> np.ndarray:
    """Lengths [H, W] of vectors [H, W, n]: a third of the time that numpy's norm takes."""
    out: np.ndarray = np.sqrt(np.einsum("ijk,ijk->ij", vectors, vectors))
    return out


def bare(
    picture: np.ndarray,
    hair: np.ndarray,
    skin: np.ndarray,
    backdrop: np.ndarray,
    level: float,
    scale: float,
) -> np.ndarray:
    """Where [H, W] bool labelled hair is bare skin: bald tops, high foreheads, the rim of a hairline.

    Such is nearer to the colour of the forehead than to that of the hair, has its hue, and no strands.
    Lightness counts for less than hue, or a top in the shade would be hair. All three must say so: the
    hue of blond hair is that of skin, and so may the lightness of grey hair be.

    Args:
        picture: [H, W, 3] sRGB-encoded.
        hair, skin, backdrop: [H, W] bool, as labelled.
        level: row of the eyes; skin above it is the forehead.
        scale: pixels a millimetre.
    """
    nothing = np.zeros_like(hair)
    above = np.arange(len(hair))[:, None] < level
    five = np.ones((5, 5), np.uint8)
    forehead = (cv2.erode(skin.astype(np.uint8), five) > 0) & above
    inner = cv2.erode(hair.astype(np.uint8), np.ones((3, 3), np.uint8)) > 0
    if not (forehead.any() and inner.any()):
        return nothing
    away = cv2.distanceTransform((~backdrop).astype(np.uint8), cv2.DIST_L2, 3) / scale
    clear = np.maximum(smoothstep(*RIM, away), LEAST)
    both, mine = ((mask * clear).astype(np.float32) for mask in (hair | skin, hair))

    def blurred(values, mm, mask=mine):
        return normalized_blur(values.astype(np.float32), mask, max(mm * scale, 0.3))

    tone = _tones(blurred(picture, SMOOTH, both), forehead)
    local = diffuse(tone, forehead.astype(np.float32))
    off = tone - local
    apart = length(off)
    most = inner & (apart >= np.quantile(apart[inner], MOST_UNLIKE))
    main = np.median(tone[most], 0)
    gray = np.log(picture @ EVENLY + 0.02)
    fine = (gray - blurred(gray, FINEST, both)) ** 2
    smooth = np.median(blurred(fine, WIDE, both)[forehead])
    strands = np.sqrt(np.maximum(blurred(fine, WIDE) - smooth, 0))
    least, near, nearer = SHAVED
    between = np.linalg.norm(main - np.median(tone[forehead], 0))
    colourful = length(local[..., 1:])
    of_hue = blurred(length(off[..., 1:]) / np.maximum(colourful, 1.0), WIDE)
    if between < nearer:  # shaved, blond, or dark hair on dark skin
        shaved = np.median(strands[hair]) < STRANDS[0] and np.median(of_hue[hair]) < HUE[0]
        return hair if shaved else nothing
    way = main - local
    share = np.einsum("ijk,ijk->ij", off, way) / np.maximum(length(way) ** 2, 1.0)
    hairy = np.max(
        [
            smoothstep(*LIKE, blurred(share, WIDE)),
            smoothstep(*HUE, of_hue),
            smoothstep(*STRANDS, strands),
        ],
        0,
    )
    hairy = blurred(hairy, WIDE, hair.astype(np.float32))
    found = _in_large_patches(hair & (hairy < 0.5), hair, skin, scale)
    if found.sum() >= least * hair.sum() and between < near:
        return hair
    shine = main[0] > np.median(tone[forehead], 0)[0]
    return nothing if shine and _above(hair & ~found, found) else found


def ear_tops(picture: np.ndarray, hair: np.ndarray, ears: np.ndarray, scale: float) -> np.ndarray:
    """Where [H, W] bool labelled hair is the top of an ear: it goes on from the ear, nearer to its colour.

    Args:
        picture: [H, W, 3] sRGB-encoded.
        hair, ears: [H, W] bool, as labelled.
        scale: pixels a millimetre.
    """
    out = np.zeros_like(hair)
    count, number, stats, _ = cv2.connectedComponentsWithStats(ears.astype(np.uint8))
    smooth = normalized_blur(picture, (hair | ears).astype(np.float32), max(SMOOTH * scale, 0.3))
    lab = cv2.cvtColor(np.clip(smooth, 0, 1), cv2.COLOR_RGB2LAB)
    for ear in range(1, count):
        if stats[ear, cv2.CC_STAT_AREA] < SPECK * scale**2:
            continue
        own = number == ear
        near = hair & (cv2.dilate(own.astype(np.uint8), disk(EAR_TOP * scale)) > 0)
        strands = hair & ~near
        if not near.any() or not strands.any():
            continue
        main = np.median(lab[strands], 0)
        way = np.median(lab[own], 0) - main
        if np.linalg.norm(way) < UNLIKE_EAR:
            continue
        share = ((lab - main) @ way) / (way @ way)
        out |= touching(opened(near & (share > 0.5), THREAD * scale), own)
    return out


def _tones(picture, forehead):
    """CIELAB of a picture, lightness at half its weight, a and b as in the forehead's light, [H, W, 3]."""
    lab = cv2.cvtColor(picture.astype(np.float32), cv2.COLOR_RGB2LAB)
    lightness = lab[..., :1] + 16  # a and b over this do not change with the light, but for noise
    hue = np.median(lightness[forehead]) * lab[..., 1:] / lightness
    return np.concatenate([LIGHT * lightness, hue], -1)


def _above(one, other):
    """Whether a mask [H, W] lies above another: the middle of its rows does.

    No head is bald at its sides alone: cropped hair is as dark as dark skin there, and shines on top.
    """
    middles = [np.median(np.nonzero(mask)[0]) for mask in (one, other) if mask.any()]
    return len(middles) == 2 and middles[0] < middles[1]


def _in_large_patches(found, hair, skin, scale):
    """Bare scalp [H, W] bool that goes on from skin, without specks of it in hair, or of hair in it."""
    found = found & opened(found | skin, NARROW * scale)  # no narrow way into hair
    found = found & ~_specks(found, ~beside(skin), scale)
    left = hair & ~found
    found = found | (left & ~opened(left, THREAD * scale) & beside(found))
    return found | _specks(hair & ~found, beside(found), scale)


def opened(mask: np.ndarray, radius: float) -> np.ndarray:
    """A mask [H, W] without what is narrower than a disc of that radius, pixels: bool."""
    wide: np.ndarray = cv2.morphologyEx(mask.astype(np.uint8), cv2.MORPH_OPEN, disk(radius)) > 0
    return wide


def disk(radius: float) -> np.ndarray:
    """The kernel of a disc of that radius, pixels: [n, n] uint8, a pixel at least."""
    size = 2 * int(radius) + 1
    return cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size))


def beside(mask: np.ndarray) -> np.ndarray:
    """Two pixels around a mask [H, W], and it: bool."""
    near: np.ndarray = cv2.dilate(mask.astype(np.uint8), np.ones((5, 5), np.uint8)) > 0
    return near


def touching(mask: np.ndarray, other: np.ndarray) -> np.ndarray:
    """The patches of a mask [H, W] that come within two pixels of another: bool."""
    _, patch = cv2.connectedComponents(mask.astype(np.uint8))
    found: np.ndarray = mask & np.isin(patch, patch[beside(other)])
    return found


def _specks(mask, where, scale):
    """Patches of a mask [H, W] that are small, if they are anywhere in `where`; and that are all in it."""
    _, number, stats, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8), connectivity=4)
    inside = np.bincount(number[where], minlength=len(stats))
    area = stats[:, cv2.CC_STAT_AREA]
    chosen = ((area < SPECK * scale**2) & (inside > 0)) | (inside == area)
    chosen[0] = False
    return chosen[number]


def without_clothes(solid: np.ndarray, clothes: np.ndarray, scale: float) -> np.ndarray:
    """Hair [H, W] bool without patches that lie on clothes, below the end of the head's own hair.

    Collars, suits and shaded necks are labelled so. Hair that falls on shoulders hangs from the head.

    Args:
        solid, clothes: [H, W] bool.
        scale: pixels a millimetre.
    """
    count, number, found, _ = cv2.connectedComponentsWithStats(solid.astype(np.uint8))
    if count < 3:
        return solid
    top, height, area = (
        found[:, k] for k in (cv2.CC_STAT_TOP, cv2.CC_STAT_HEIGHT, cv2.CC_STAT_AREA)
    )
    main = 1 + int(area[1:].argmax())
    worn = _on_clothes(number, count, clothes, scale) & (top >= top[main] + height[main])
    return solid & ~worn[number]


def _on_clothes(number, count, clothes, scale):
    """Which patches [count] bool, by their numbers [H, W], touch clothes along ON_CLOTHES; not patch 0."""
    on = np.bincount(number[beside(clothes)], minlength=count)  # two pixels of a border are near
    return (on > 2 * ON_CLOTHES * scale) & (np.arange(count) > 0)


def without_cloth_colors(
    picture: np.ndarray, solid: np.ndarray, clothes: np.ndarray, scale: float
) -> np.ndarray:
    """Hair [H, W] bool without what lies on clothes and has their colour: scarves, ribbons, long earrings.

    Only colours that the hair is far from tell; dark cloth beside dark hair stays.

    Args:
        picture: [H, W, 3] sRGB-encoded.
        solid, clothes: [H, W] bool.
        scale: pixels a millimetre.
    """
    if not solid.any() or not clothes.any():
        return solid
    chroma = cv2.cvtColor(picture, cv2.COLOR_RGB2LAB)[..., 1:]
    chroma = normalized_blur(chroma, (solid | clothes).astype(np.float32), 1.5 * scale)
    core = cv2.erode(clothes.astype(np.uint8), np.ones((5, 5), np.uint8)).astype(np.float32)
    off_hair = length(chroma - np.median(chroma[solid], 0))
    least, share = GAUDY
    gaudy = solid & (off_hair > least)
    if not gaudy.any():
        return solid
    off_cloth = length(chroma - diffuse(chroma, core))
    gaudy &= off_cloth < share * off_hair
    count, number = cv2.connectedComponents(gaudy.astype(np.uint8))
    worn = _on_clothes(number, count, clothes, scale)
    if not worn.any():
        return solid
    away = cv2.distanceTransform((~worn[number]).astype(np.uint8), cv2.DIST_L2, 3)
    return solid & (away > FOLDS * scale)
