"""Skin with one even tone, out of skin that is lit unevenly.

Harmonics of the second order leave much of a lamp's light in the albedo: the terminator, the darker
half, what the neck and the hair's shadow do. Tone and detail are told apart by their width. Detail
stays. The tone is what is likely for a face, moved by one wide field that both halves share; what the
photo says beyond is believed while it is small, and less the larger it is, so that nothing has an edge.
"""

from dataclasses import dataclass

import cv2
import numpy as np

from bakery.geometry.color import LUMA
from bakery.geometry.fill import diffuse, normalized_blur, smoothstep, soft_limit, sparse_blur
from bakery.geometry.masks import disk

FINE, WIDE = 1 / 70, 1 / 25  # of the atlas's side: what is finer is detail; the field is as wide
RIM = 1 / 60  # of the atlas's side: tones of borders off the face are the least sure
LIGHTER = 2.0  # how much more the lighter half says: by the power of this of their ratio
# The same of the half whose colour is nearer to that of the face's middle, and how wide that is, in
# shares of the atlas's side to both sides.
COLORED, MIDDLE = 12.0, 0.1
# Log of luminance, and of colour beside it, by which tones may differ from the field: where both halves
# do, or one does, and of each where the tone is no more believed than at a slant.
BOTH, ONE = (0.4, 0.12), (0.08, 0.03)
BOTH_SLANTING, ONE_SLANTING = (0.06, 0.03), (0.03, 0.01)
# The same of the field against the face's mean, on the face and beside it.
FACE, BESIDE = (3.0, 2.0), (0.05, 0.05)
# The same of the field itself, against what is likely: people's cheeks and chins differ less in colour.
FIELD, FIELD_BESIDE = (3.0, 0.08), (0.1, 0.05)
DARKER = 3.5  # log of what a shadow takes away, at most
LOST = (0.5, 0.9)  # log lost to shadow off the face: detail stays up to it, and none beyond
EDGE = (0.2, 0.4)  # log of what is lifted, over FINE: a shadow's edge, which is filled in
STRIP = 1 / 64  # of the atlas's side, half the width of a shadow that is lost with its edges
TINGED = (0.1, 0.25)  # log of a colour beside luminance: of skin, and of a border that is none
SHADY = (0.3, 0.6)  # the same of luminance
DOUBT = (0.3, 0.9)  # how far skin is known: its tone is as little believed as a border's, and fully
HOLE = 1 / 45  # of the atlas's side, half the width of a hole in what is known that is none
UNSEEN = 0.003  # how strongly unseen skin leans to what is likely, against its borders


@dataclass(frozen=True, eq=False)
class Evened:
    """Skin in one tone."""

    albedo: np.ndarray  # [T, T, 3] linear
    known: np.ndarray  # [T, T] 0..1, how surely
    tone: np.ndarray  # [T, T, 3] linear, smooth, of all skin
    lift: np.ndarray  # [T, T] log of how much lighter it was made


def evened(
    albedo: np.ndarray,
    known: np.ndarray,
    even: np.ndarray,
    twice: np.ndarray,
    sure: np.ndarray,
    likely: np.ndarray,
    plain: np.ndarray,
    face: np.ndarray,
    on_skin: np.ndarray,
) -> Evened:
    """Take the unevenness of its light out of a skin's tone.

    Args:
        albedo: [T, T, 3] linear; known: [T, T] 0..1.
        even: [T, T] 0..1, how far its tone is believed; twice: 0..1, where the photo shows both halves: one
            that stands in for the other is no second witness; sure: the same, of texels that tell the field.
        likely: [T, T, 3] linear, smooth, positive.
        plain: [T, T] 0..1, 0 on brows, beard and lips, which are lifted as the skin beside them.
        face: [T, T] 0..1, 1 well within the face; on_skin: 1 on the skin's charts.
    """
    size = len(albedo)
    known, even, sure = (np.float32(x) for x in (np.minimum(known, 1), even, sure))
    beside = known * (plain + 1e-3)

    nearby = smoothstep(0.02, 0.2, cv2.GaussianBlur(beside, (0, 0), FINE * size))

    def log_of(color):
        # In the middle of a beard: the skin beside it, however far.
        return diffuse(_log(normalized_blur(color, beside, FINE * size)), nearby)

    low, both = log_of(albedo), np.sqrt(likely * likely[:, ::-1])
    inner = np.maximum(face, _well_known(known, RIM * size))
    weight = sure * inner * (plain + 1e-3)
    middle = (weight * face + UNSEEN * on_skin)[..., None]
    field = _field(np.clip(low - log_of(both), -DARKER, DARKER), weight, on_skin)
    level = (field * middle).sum((0, 1)) / middle.sum()
    field = level + _held(field - level, FIELD, face, FIELD_BESIDE)
    log = np.log(both) + field
    mean = (log * middle).sum((0, 1)) / middle.sum()
    base = np.exp(mean + _held(log - mean, FACE, face, BESIDE))
    ratio = np.clip(low - log_of(base), -DARKER, DARKER)
    wanted = _believed(ratio, known, even * inner, twice)
    # A border that is seen squarely, as a hairline, goes on as the skin inside; at a slant as is likely.
    inside = diffuse(wanted, known * even * inner) * (even * (1 - inner))[..., None]
    wanted = inside + _believed(ratio - inside, known, even * inner, twice)
    lift = wanted - ratio
    lost = smoothstep(*LOST, lift @ LUMA) * (1 - even) * (1 - face)
    edges = _edges(lift @ LUMA) * _inside(known, FINE * size)
    # What is left between the edges of a narrow shadow, as beside a nose, is none of the skin around.
    lost = np.maximum(lost, cv2.morphologyEx(edges, cv2.MORPH_CLOSE, disk(STRIP * size)))
    lost = np.maximum(lost, _strange(ratio, known) * plain)
    anchor = np.maximum(known * (1 - lost) * inner, UNSEEN * on_skin)
    tone = base * np.exp(diffuse(wanted * (known > 0)[..., None], anchor))
    return Evened(albedo * np.exp(lift), known * (1 - lost), tone, lift @ LUMA * (known > 0))


def alike(albedo: np.ndarray, sure: np.ndarray) -> np.ndarray:
    """Colours [T, T, 3] linear with the wide tone that both halves share, the lighter saying more.

    Args:
        albedo: [T, T, 3] linear; sure: [T, T] 0..1.
    """
    low = _log(normalized_blur(albedo, sure, FINE * len(albedo)))
    shared, _ = _shared(low, sure)
    out: np.ndarray = albedo * np.exp(np.clip(shared - low, -DARKER, DARKER))
    return out


def _field(ratio: np.ndarray, weight: np.ndarray, on_skin: np.ndarray) -> np.ndarray:
    """A wide log ratio [T, T, 3] that both halves share, continued to all skin."""
    sigma = WIDE * len(ratio)
    mass = sparse_blur(weight, sigma)
    wide = sparse_blur(ratio * weight[..., None], sigma)
    wide /= np.maximum(mass, 1e-4)[..., None]
    shared, mass = _shared(wide, mass)
    return diffuse(shared, np.clip(np.maximum(mass, UNSEEN * on_skin), 0, 1))


def _believed(
    ratio: np.ndarray, known: np.ndarray, even: np.ndarray, twice: np.ndarray
) -> np.ndarray:
    """What of a log ratio [T, T, 3] is believed."""
    shared, _ = _shared(ratio, known)
    rest = ratio - shared
    return _held(shared, BOTH, even * twice, BOTH_SLANTING) + _held(rest, ONE, even, ONE_SLANTING)


def _held(
    ratio: np.ndarray,
    most: tuple[float, float],
    share: np.ndarray,
    least: tuple[float, float],
) -> np.ndarray:
    """A log ratio [T, T, 3], luminance and colour held to `most` where the share [T, T] is 1, to `least` at 0."""
    gray = (ratio @ LUMA)[..., None]
    gray_most, tint_most = (
        (low + (high - low) * share)[..., None] for low, high in zip(least, most)
    )
    return soft_limit(gray, gray_most) + soft_limit(ratio - gray, tint_most)


def _shared(ratio: np.ndarray, weight: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """What two halves [T, T, 3] say together, and how surely.

    Of luminance the lighter says more; of colour the one that is more like the middle of the face: a
    coloured lamp lights one side.
    """
    gray = (ratio @ LUMA)[..., None]
    tint = ratio - gray
    off = tint - _middle(tint, weight)
    off = np.sqrt(np.einsum("...c,...c", off, off))  # a third of the time of np.linalg.norm
    level, color = (
        _of_both(part, weight * np.exp(np.clip(says - says[:, ::-1], -DARKER, DARKER) / 2))
        for part, says in ((gray, LIGHTER * gray[..., 0]), (tint, -COLORED * off))
    )
    return level + color, np.maximum(weight, weight[:, ::-1])


def _middle(tint: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """The median colour [3] of the weighed texels between both halves of a face [T, T, 3]."""
    size = len(tint)
    columns = slice(int((0.5 - MIDDLE) * size), int((0.5 + MIDDLE) * size))
    sure = weight[:, columns] > 0.5 * weight.max()
    return np.median(tint[:, columns][sure], 0) if sure.any() else np.zeros(3, tint.dtype)


def _of_both(values: np.ndarray, says: np.ndarray) -> np.ndarray:
    """The mean [T, T, C] of values and their mirror image, by what each half `says` [T, T]."""
    total = says + says[:, ::-1]
    share = (says / np.maximum(total, 1e-9))[..., None]
    out: np.ndarray = values * share + values[:, ::-1] * share[:, ::-1]
    return out


def _edges(lift: np.ndarray) -> np.ndarray:
    """Where [T, T] 0..1 a hard shadow ends: light leaks in there, redder than skin."""
    slope = np.hypot(*np.gradient(lift))
    out: np.ndarray = smoothstep(*EDGE, slope * FINE * len(lift))
    return out


def _strange(ratio: np.ndarray, known: np.ndarray) -> np.ndarray:
    """Where [T, T] 0..1 the border of something large that is not known is unlike the skin around."""
    closed = _closed(known > 0.8, WIDE / 2)
    gray = ratio @ LUMA
    tint = np.abs(ratio - gray[..., None]).max(2)
    unlike = np.maximum(smoothstep(*TINGED, tint), smoothstep(*SHADY, np.abs(gray)))
    out: np.ndarray = unlike * (1 - _inside(closed, 2 * RIM * len(known)))
    return out


def _inside(known: np.ndarray, width: float) -> np.ndarray:
    """1 well inside what is known [T, T], 0 from its border on."""
    away = cv2.distanceTransform((known > 0.8).astype(np.uint8), cv2.DIST_L2, 5)
    return np.float32(smoothstep(0.3 * width, width, away))


def _well_known(known: np.ndarray, width: float) -> np.ndarray:
    """1 well inside what is known [T, T], less where it is doubted nearby, 0 from its border on.

    Soft: a place that is known by four fifths is no border, and skin there is not another's.
    """
    least = cv2.erode(without_holes(known), disk(0.65 * width), borderType=cv2.BORDER_REPLICATE)
    return np.float32(smoothstep(*DOUBT, cv2.GaussianBlur(least, (0, 0), 0.2 * width)))


def without_holes(known: np.ndarray) -> np.ndarray:
    """What is known [T, T] 0..1 with its small holes closed: around a mole or a speck, tones are as sure as beside it."""
    return np.maximum(known, _closed(known, HOLE)).astype(np.float32)


def _closed(known: np.ndarray, radius: float) -> np.ndarray:
    """A mask [T, T] 0..1 closed by a disc of that radius, in shares of its side.

    At a quarter of the size: the disc is wide, and its cost grows with the square of that.
    """
    size = len(known)
    small = (max(size // 4, 1),) * 2
    coarse = cv2.resize(np.float32(known), small, interpolation=cv2.INTER_AREA)
    closed = cv2.morphologyEx(coarse, cv2.MORPH_CLOSE, disk(radius * small[0]))
    return cv2.resize(closed, (size, size), interpolation=cv2.INTER_LINEAR)


def _log(color: np.ndarray) -> np.ndarray:
    out: np.ndarray = np.log(np.maximum(color, 1e-3))
    return out
