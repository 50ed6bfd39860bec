"""The photo around a head, at the scale that hair is measured at."""

from dataclasses import dataclass

import cv2
import numpy as np

from bakery.geometry import camera as cameras
from bakery.geometry.color import LUMA, to_linear
from bakery.geometry.fill import diffuse, normalized_blur, smoothstep
from bakery.geometry.masks import beside, disk, touching
from bakery.geometry.raster import rasterize
from bakery.heads.base import HeadModel
from bakery.landmarks import EYES
from bakery.stages.segment import (
    BACKGROUND,
    CLOTHES,
    EARS,
    HAIR,
    HAT,
    HIDDEN,
    SKIN,
    Segmentation,
)
from bakery.types import Camera, Fit

FINE = 1.6  # pixels a millimetre at most
ASIDE, ABOVE, BELOW = 190.0, 160.0, 330.0  # mm around the middle of the head that are looked at
SPECK = 60.0, 0.08  # mm2, share of all hair: smaller patches of hair are mistakes
WISP = 5.0  # mm around the outline in which the photo says what is hair
GLARES = 0.12, 0.06  # of sRGB: lighter than skin and hair, and less red than skin
BESIDE_SKIN, HALF_LIT = 12.0, 2.0  # mm beside skin that it glares; around it, what is half as light
# mm around what glares that hair is beside it, and of the skin's light, which that has less: of nine people
# one who is lit from behind, and one beside white skin, have 0.74 and 0.80, those with white hair 0.94 to 1.24.
HAIR_BESIDE, DARK_HAIR = 8.0, 0.87
UNLIKE = 0.35  # distance of sRGB colours of two patches that are not both hair
POCKETS = 18.0, 45.0  # mm from the backdrop, above and below the eyes: how far it is seen in hair
ALIKE = 0.2  # distance of sRGB colours of what may be the same
# Of the distance of hair's and backdrop's colours: off the way between them, and on it.
STRANGE = 0.5, 0.25
NEARBY = 12.0  # mm over which hair's own colour is taken
HANGS = 20.0, 40.0  # mm below the eyes, from which hair hangs
HANGING = 15.0  # mm along which what hides the face touches the hair that it hangs from
INNER, HALO = 1.6, 3.0  # mm from what is no hair, and from the backdrop: nearer, colours are mixed
# mm from skin and from clothes up to which they may show in hair, and within them from their border,
# where they surely are.
HAIRLINE, COLLAR, BARE = 12.0, 25.0, 3.0
# Of the way from the skin's colour to the hair's: none up to there, hair from there on, and its own colour.
LIKE_SKIN, MIXED = (0.15, 0.4), (0.5, 0.85)
# Of the skin's hue (red less blue) that grey hair has less, from which on, and surely.
GREYER = 0.25, 0.6
PATCH = 1.5  # mm over which that is taken: a comb of single strands is no hairline
APART = (
    0.15,
    0.3,
)  # distance of two sRGB colours, below which nothing is told by them, and from which all is
APART_CLOTHES = 0.08, 0.2  # the same of clothes, of whose colour little is enough to be seen
SURELY_HAIR = 0.5  # of the way to the middle hair's colour
JEWEL, JEWEL_RIM = 5.0, 2.0  # mm, half the width of the largest, and around what glitters
GLITTERS = 1.6  # log by which it is lighter than the hair around
NOTHING = 1e5  # mm, depth where no head is


@dataclass(frozen=True, eq=False)
class Portrait:
    """What hair is made from; all pictures [H, W] of one camera."""

    camera: Camera
    scale: float  # pixels a millimetre, at the head
    hair: np.ndarray  # float32 0..1, how much of a pixel is hair
    solid: np.ndarray  # bool, what the labels call hair
    linear: np.ndarray  # [H, W, 3] float32, the photo
    color: np.ndarray  # [H, W, 3] float32 linear, hair continued beyond its outline
    sharp: np.ndarray  # float32 0..1, how far that is the photo's, not a smooth continuation
    behind: np.ndarray  # bool, background
    skin: np.ndarray  # bool, ears and neck too
    ears: np.ndarray  # bool
    known: np.ndarray  # bool, inside the photo and where it was labelled
    depth: np.ndarray  # float32 mm to the bare head, NOTHING where it is not

    def pixels(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Pixels [..., 2] and depths [...] mm of points [..., 3] in head space."""
        seen = cameras.to_camera(points, self.camera)
        depth = np.maximum(-seen[..., 2], 1.0)
        flat = cameras.project_camera(
            np.stack([seen[..., 0], seen[..., 1], -depth], -1), self.camera
        )
        return flat.astype(np.float32), depth

    def inside(self, pixels: np.ndarray) -> np.ndarray:
        """Whether pixels [..., 2] are known [...] bool."""
        height, width = self.known.shape
        x, y = pixels[..., 0], pixels[..., 1]
        return (x > 0) & (y > 0) & (x < width) & (y < height) & at(self.known, pixels)


def at(picture: np.ndarray, pixels: np.ndarray) -> np.ndarray:
    """The nearest values of a picture [H, W, ...] at pixels [..., 2]; its border goes on."""
    height, width = picture.shape[:2]
    column = np.clip(pixels[..., 0], 0, width - 1).astype(int)
    row = np.clip(pixels[..., 1], 0, height - 1).astype(int)
    found: np.ndarray = picture[row, column]
    return found


def look(
    encoded: np.ndarray, segmentation: Segmentation, fit: Fit, head: HeadModel, neutral: np.ndarray
) -> Portrait:
    """Cut the surroundings of a head out of its photo.

    Args:
        encoded: [H, W, 3] float32 sRGB-encoded photo.
        neutral: [V, 3] mm.
    """
    middle = neutral[head.part_vertices("skin")]
    middle = np.array([0.0, 0.0, (middle[:, 2].min() + middle[:, 2].max()) / 2])
    camera = fit.camera
    mm = float(camera.focal / max(-cameras.to_camera(middle, camera)[2], 1.0))
    x, y = cameras.project(middle, camera)
    scale = min(1.0, FINE / mm)
    corner = np.floor([x - ASIDE * mm, y - ABOVE * mm])
    size = np.ceil(np.array([2 * ASIDE, ABOVE + BELOW]) * mm * scale).astype(int)
    cut = cameras.crop(camera, *corner, *np.maximum(size, 8), scale)
    matrix = np.array([[scale, 0, -corner[0] * scale], [0, scale, -corner[1] * scale]])
    matrix[:, 2] += 0.5 * scale - 0.5
    frame = (cut.width, cut.height)

    def warped(plane, how=cv2.INTER_LINEAR):
        if scale < 1 and how == cv2.INTER_LINEAR:
            plane = cv2.GaussianBlur(plane, (0, 0), 0.5 * np.sqrt(1 / scale**2 - 1) + 1e-3)
        return cv2.warpAffine(plane, matrix, frame, flags=how)

    labels = warped(segmentation.labels, cv2.INTER_NEAREST)
    regions = warped(segmentation.regions, cv2.INTER_NEAREST)
    rows, columns = (np.flatnonzero(segmentation.labels.any(axis)) for axis in (1, 0))
    known = np.zeros(segmentation.labels.shape, np.uint8)
    if len(rows):  # labels end at a box around the face
        known[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1] = 1
        known[: rows[-1] + 1] = 1
    picture = np.clip(warped(np.ascontiguousarray(encoded, np.float32)), 0, 1)
    scale_mm = mm * scale
    solid = (regions == HAIR) & (labels != HAT)
    marks = cameras.project(head.landmarks(neutral), cut)
    solid = without_glare(picture, solid, regions == SKIN, marks, scale_mm)
    solid = before_face(picture, solid, labels, regions, scale_mm)
    solid = _patches(picture, solid, scale_mm)
    level = float(cameras.project(np.zeros(3), cut)[1])
    hair = _matte(picture, solid, regions, scale_mm)
    hair = hair * unlike_backdrop(picture, hair, regions == BACKGROUND, level, scale_mm)
    share = _share_of_hair(picture, hair, labels == SKIN, HAIRLINE, scale_mm, bare=True)
    # A collar that shows between strands is hair's, in shape; in colour it is not.
    dressed = _share_of_hair(picture, hair, labels == CLOTHES, COLLAR, scale_mm, bare=False)
    pure = hair * smoothstep(*MIXED, np.minimum(share, dressed))
    hair = hair * smoothstep(*LIKE_SKIN, share)
    linear = to_linear(picture)
    points = cameras.to_camera(neutral, cut)
    faces = head.faces[head.part_faces("skin", "eye_left", "eye_right")]
    found = rasterize(
        cameras.project_camera(points, cut),
        -points[:, 2],
        faces,
        (cut.height, cut.width),
        cull=True,
    )
    return Portrait(
        cut, scale_mm, hair, solid, linear,
        *_continued(linear, pure, regions == BACKGROUND, level, scale_mm),
        regions == BACKGROUND, regions == SKIN, labels == EARS,
        warped(known, cv2.INTER_NEAREST) > 0,
        np.where(np.isfinite(found.depth), found.depth, NOTHING).astype(np.float32),
    )  # fmt: skip


def before_face(
    picture: np.ndarray, solid: np.ndarray, labels: np.ndarray, regions: np.ndarray, scale: float
) -> np.ndarray:
    """Hair [H, W] bool with what hides the face, where that hangs from it and looks like it.

    Args:
        picture: [H, W, 3] sRGB-encoded.
        solid: [H, W] bool, hair beside it.
        labels, regions: [H, W].
        scale: pixels a millimetre.
    """
    hiding = regions == HIDDEN
    out = solid | (hiding & (labels == HAIR))
    if not solid.any():
        return out
    main = np.median(picture[solid], 0)
    near = beside(solid)
    count, number = cv2.connectedComponents((hiding & ~out).astype(np.uint8))
    for patch in range(1, count):
        piece = number == patch
        hangs = (piece & near).sum() > HANGING * scale * 2  # two pixels of it are near
        if hangs and np.linalg.norm(np.median(picture[piece], 0) - main) < ALIKE:
            out = out | piece
    return out


def _patches(picture, solid, scale):
    """The patches of hair [H, W] that are large, and like the largest: a collar is neither."""
    count, number, found, _ = cv2.connectedComponentsWithStats(solid.astype(np.uint8))
    area = found[:, cv2.CC_STAT_AREA] * (np.arange(count) > 0)
    kept = area > max(SPECK[0] * scale**2, SPECK[1] * solid.sum())
    main = np.median(picture[number == area.argmax()], 0) if area.any() else np.zeros(3)
    for patch in np.flatnonzero(kept):
        unlike = np.linalg.norm(np.median(picture[number == patch], 0) - main) > UNLIKE
        kept[patch] = not (unlike and area[patch] < 0.3 * area.max())
    return kept[number]


def without_glare(
    picture: np.ndarray, solid: np.ndarray, skin: np.ndarray, points: np.ndarray, scale: float
) -> np.ndarray:
    """Labelled hair [H, W] bool without light from behind that glares on the temples beside it.

    It is whiter than skin, and far lighter than skin and the hair beside it both.

    Args:
        picture: [H, W, 3] sRGB-encoded.
        solid, skin: [H, W] bool, what is labelled hair and skin.
        points: [L, 2] pixels, landmarks.
        scale: pixels a millimetre.
    """
    if not skin.any() or not solid.any():
        return solid
    smooth = normalized_blur(picture, (solid | skin).astype(np.float32), max(0.6 * scale, 0.3))
    level, tint = smooth @ LUMA, smooth[..., 0] - smooth[..., 2]
    of_skin = np.median(level[skin])
    if np.median(level[solid]) > of_skin:
        return solid
    white = solid & (level > of_skin + GLARES[0]) & (tint < np.median(tint[skin]) - GLARES[1])
    eyes = points[np.concatenate([*EYES])]
    row, column = (np.arange(n) + 0.5 for n in solid.shape)
    white &= (column < eyes[:, 0].min()) | (column > eyes[:, 0].max())
    white &= (row < eyes[:, 1].max())[:, None]  # lower, a white backdrop shows below ears
    across = np.ones((1, 2 * int(BESIDE_SKIN * scale) + 1), np.uint8)
    white &= cv2.dilate(skin.astype(np.uint8), across) > 0
    white = touching(white, skin)  # the rest are highlights of light hair
    around = cv2.dilate(white.astype(np.uint8), disk(max(HALF_LIT * scale, 1))) > 0
    near = cv2.dilate(white.astype(np.uint8), disk(HAIR_BESIDE * scale)) > 0
    hair = near & solid & ~around
    # White hair lies beside hair that is nearly as light as skin.
    glares = hair.any() and np.median(level[hair]) < DARK_HAIR * of_skin
    return solid & ~around if glares else solid


def _matte(picture, solid, regions, scale):
    """How much of each pixel is hair: as labelled, and near the outline as the photo says."""
    radius = max(int(WISP * scale), 1)
    mask = solid.astype(np.float32)
    soft = cv2.ximgproc.guidedFilter(picture, mask, radius, 1e-3)
    soft = np.clip(1.3 * soft - 0.15, 0, 1)
    # Skin beside hair may be as dark: there the labels are surer than the colours.
    backdrop = cv2.GaussianBlur((regions == BACKGROUND).astype(np.float32), (0, 0), radius)
    trust = np.clip(2 * backdrop, 0, 1)
    plain = cv2.GaussianBlur(mask, (0, 0), max(0.6 * scale, 0.3))
    return (trust * soft + (1 - trust) * plain).astype(np.float32)


def unlike_backdrop(
    picture: np.ndarray, hair: np.ndarray, backdrop: np.ndarray, level: float, scale: float
) -> np.ndarray:
    """How surely a pixel [H, W] is not the backdrop that shows between strands, 0..1.

    Args:
        picture: [H, W, 3] sRGB-encoded.
        hair: [H, W] 0..1.
        backdrop: [H, W] bool.
        level: row of the eyes; below it strands hang apart.
        scale: pixels a millimetre.
    """
    off = cv2.distanceTransform((~backdrop).astype(np.uint8), cv2.DIST_L2, 3) / scale
    rows = np.arange(len(hair))[:, None]
    inner = hair > 0.9
    if not backdrop.any() or not inner.any():
        return np.ones_like(hair)
    far = cv2.erode(backdrop.astype(np.uint8), np.ones((5, 5), np.uint8))
    behind = diffuse(picture, far.astype(np.float32))
    # Grey temples are between dark hair's colour and a grey backdrop's: the hair's is told nearby. Hair that
    # hangs is of one colour, and what shows through it may be wide.
    own = normalized_blur(picture, inner.astype(np.float32), NEARBY * scale)
    hangs = smoothstep(*HANGS, (rows - level) / scale)[..., None]
    own = own + hangs * (np.median(picture[inner], 0) - own)
    way, length, share = _on_the_way(picture, behind, own)
    off_it = picture - behind
    # What is neither like the one nor like the other is hair in the shade, or in a highlight.
    strange = np.linalg.norm(off_it - np.clip(share, 0, 1)[..., None] * way, axis=-1)
    between = smoothstep(*STRANGE, strange / np.sqrt(np.maximum(length, 1e-6)))
    reach = np.where(rows < level, *POCKETS)
    apart = smoothstep(*APART, np.sqrt(length)) * smoothstep(0, 0.3, 1 - off / reach)
    return (1 - apart * between * smoothstep(0.6, 0.25, share)).astype(np.float32)


def _share_of_hair(picture, hair, other, reach, scale, bare):
    """How far a pixel [H, W] is on the way from the colour of what lies beside hair to the hair's, 0..1; 1 elsewhere.

    Labels know a hairline to a few millimetres. What is left of temples in them is skin on hair.

    Args:
        other: [H, W] bool, skin or clothes.
        reach: mm from it, beyond which all is hair.
        bare: whether it is skin. What is greyer than that is hair, as at temples; of clothes little colour is
            enough to be seen, and labels of locks before them hold some.
    """
    core = cv2.distanceTransform(other.astype(np.uint8), cv2.DIST_L2, 3) / scale > BARE
    if not core.any():
        return np.ones_like(hair)
    away = cv2.distanceTransform((~other).astype(np.uint8), cv2.DIST_L2, 3) / scale
    inner = (hair > 0.9) & (away > reach)
    if not inner.any():
        return np.ones_like(hair)
    behind = diffuse(picture, core.astype(np.float32))
    if not bare:
        _, length, share = _on_the_way(picture, behind, np.median(picture[inner], 0))
        inner &= (share > SURELY_HAIR) | (length < APART_CLOTHES[1] ** 2)
    own = diffuse(picture, inner.astype(np.float32))
    smooth = normalized_blur(picture, np.maximum(hair, other), max(PATCH * scale, 0.3))
    _, length, share = _on_the_way(smooth, behind, own)
    if bare:
        share = np.maximum(share, _greyer(smooth, behind))
    apart = smoothstep(*(APART if bare else APART_CLOTHES), np.sqrt(length))
    apart = apart * smoothstep(reach, 0.7 * reach, away)
    return (1 - apart * (1 - np.clip(share, 0, 1))).astype(np.float32)


def _greyer(picture, skin):
    """How surely a picture [H, W] is grey hair, which lies between dark hair's colour and skin's: 0..1, by its hue.

    Glare on skin is grey too, but lighter than the skin.
    """
    light, bare = (each @ LUMA for each in (picture, skin))
    hue, of_skin = (
        (each[..., 0] - each[..., 2]) / (level + 0.05)
        for each, level in ((picture, light), (skin, bare))
    )
    less = smoothstep(*GREYER, 1 - hue / np.maximum(of_skin, 0.05))
    found: np.ndarray = less * smoothstep(1.1, 1.0, light / np.maximum(bare, 0.05))
    return found


def _on_the_way(picture, start, end):
    """The way [H, W, 3] between two colours, its squared length [H, W], and how far on it a picture is."""
    way = end - start
    length = (way**2).sum(-1)
    return way, length, ((picture - start) * way).sum(-1) / np.maximum(length, 1e-6)


def _jewels(linear, level, scale):
    """Where [H, W] small things glare below the eyes: earrings that hair lies around.

    Args:
        level: row of the eyes; above it such spots are highlights.
    """
    light = np.log(np.maximum(linear @ LUMA.astype(np.float32), 2e-3))
    wide, rim = (disk(max(mm * scale, 1)) for mm in (JEWEL, JEWEL_RIM))
    spots = light - cv2.morphologyEx(light, cv2.MORPH_OPEN, wide) > GLITTERS
    spots &= np.arange(len(light))[:, None] > level
    return cv2.dilate(spots.astype(np.uint8), rim) > 0


def _continued(linear, hair, backdrop, level, scale):
    """The hair's colours, continued over what is not hair: nothing of skin or backdrop bleeds in.

    Returns:
        [H, W, 3] linear, and [H, W] 0..1 how far it is the photo's.
    """
    off = cv2.distanceTransform((~backdrop).astype(np.uint8), cv2.DIST_L2, 3) / scale
    inner = cv2.distanceTransform((hair > 0.9).astype(np.uint8), cv2.DIST_L2, 3) / scale
    sure = (inner > INNER) & (off > HALO) & ~_jewels(linear, level, scale)
    if not sure.any():
        sure = hair >= min(0.9, float(hair.max()))
    spread = diffuse(linear, sure.astype(np.float32))
    keep = cv2.GaussianBlur(sure.astype(np.float32), (0, 0), max(0.5 * scale, 0.3))
    return (spread + keep[..., None] * (linear - spread)).astype(np.float32), keep
