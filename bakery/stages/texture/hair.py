"""Hair as a layer of its own over the skin: the photo's where it shows any, continued over the scalp."""

from dataclasses import dataclass

import cv2
import numpy as np

from bakery.geometry.color import LUMA
from bakery.geometry.fill import diffuse, normalized_blur, smoothstep
from bakery.geometry.masks import disk
from bakery.geometry.noise import value_noise
from bakery.geometry.sample import bilinear
from bakery.heads.base import HeadModel
from bakery.landmarks import EYE_CORNERS, OVAL, face_size
from bakery.stages.atlas import Atlas, soften, uv_polygon
from bakery.stages.hair.portrait import unlike_backdrop, without_glare
from bakery.stages.hair.presence import trusted, weighed
from bakery.stages.hair.sideburns import sideburns
from bakery.stages.hair.temples import temples_of
from bakery.stages.segment import (
    BACKGROUND,
    BEARD,
    BROWS,
    CLOTHES,
    EYES,
    GLASSES,
    HAIR,
    HIDDEN,
    LIPS,
    MOUTH,
    SKIN,
    Segmentation,
)
from bakery.stages.segment.refine import EYES_APART
from bakery.stages.texture.growth import (
    above_nape,
    above_the_neck,
    bald_around,
    beside_scalp,
    forehead,
    growth_on,
    on_ears,
)
from bakery.stages.texture.hairtone import from_both, tone_around, tone_of

HAIR_STRIP = (0.07, 0.13)  # of the eye distance, from hair: no skin is taken, all is taken
SHOWN_STRIP = (0.18, 0.13)  # the layer shows none, all: wider, so that nothing gapes between both
HALO = (0.015, 0.04)  # of the eye distance, from the background: its light is on what is nearer
HINGE = (1.0, 3.5)  # mm from glasses: none of hair and its strip is taken, all is
SPECK = 0.04  # of the eye distance, side of the largest hole in hair that is taken for a mistake
# Cosine: at a slant the photo says where hair is, not how it looks: a pixel is a streak.
LOOK = (0.2, 0.45)
STRANDS = (0.45, 0.2)  # of hair they are sooner: none from the first on, all up to the second
# Cosine: on the skin a few mm of the fit are centimetres of hair that is drawn.
SQUARE = (0.1, 0.45)
# Cosine: at a slant what the labels tell of a hairline is a comb: as told from the first on, smooth up to
# the second.
RAGGED = (0.7, 0.4)
COMB = 90  # share of the atlas that its teeth are wide
# Cosine: made-up hair has the tone of the hair around its pixel, not and wholly.
NEARBY = (0.03, 0.15)
# Width and length of the locks that are made up, and of their hairs, mm, and how much of each.
LOCKS = ((3.2, 26.0, 0.5), (1.3, 18.0, 0.65), (0.6, 11.0, 0.55))
BACKWARDS = 0.6  # how far hair goes back as it goes down, at the sides
ON_SKIN = (89.0, 82.0)  # degrees: off the scalp the photo says nothing beyond the first
BESIDE = 40  # share of the atlas that the layer fades out on, beyond what was seen
CRACK = 80  # share of the atlas that cracks between what the labels tell are wide, at most
LINE = 110  # share of the atlas over which a hairline is smooth
HAIRS = (0.4, 4.0)  # mm, width and length of single hairs
APART = 0.5  # of alpha by which hairs differ where half of them grow: more, and the line is a comb
SPARSE = 0.1, 0.7  # of bald scalp around, up to which all hair grows and from which none
FRAY = (0.7, 8.0)  # mm, width and length of hairs at the hairline
FRAYED = 0.06  # how far they reach over it
CROWN = np.array([0.0, 0.94, -0.34], np.float32)  # from the middle of the skull


@dataclass(frozen=True)
class Mattes:
    """What of a photo goes onto the head, and what occludes it: soft masks [H, W] float32 0..1."""

    skin: np.ndarray  # may be unwrapped as skin
    hair: np.ndarray
    strip: np.ndarray  # skin too near to hair to be taken as such; shown together with the hair
    occluder: np.ndarray  # glasses, or what else hides the face
    shadow: np.ndarray  # hard cast shadow on the skin
    frame: np.ndarray  # of glasses, without their lenses
    dark: np.ndarray  # what is darker than skin by nature: brows, beard, lips


def mattes_of(encoded: np.ndarray, segmentation: Segmentation, points: np.ndarray) -> Mattes:
    """Divide a photo into skin, hair and the strip between them.

    Along the hair lie its shadow and loose strands. Left in the skin they are a dark line along the
    hairline of the bald head (PITFALLS 10).

    Args:
        encoded: [H, W, 3] sRGB-encoded photo.
        segmentation: of the photo.
        points: [L, 2] pixels.
    """
    picture = np.ascontiguousarray(encoded, np.float32)
    scale = face_size(points) / EYES_APART
    hair = segmentation.regions == HAIR
    hair = without_glare(picture, hair, segmentation.regions == SKIN, points, scale)
    away = cv2.distanceTransform((~hair).astype(np.uint8), cv2.DIST_L2, 3) / face_size(points)
    taken = smoothstep(*HAIR_STRIP, away) if hair.any() else np.ones(hair.shape)
    shown = smoothstep(*SHOWN_STRIP, away) if hair.any() else np.zeros(hair.shape)
    around = np.isin(segmentation.regions, (BACKGROUND, CLOTHES))
    behind = _large(around, (SPECK * face_size(points)) ** 2)
    off = cv2.distanceTransform((~behind).astype(np.uint8), cv2.DIST_L2, 3) / face_size(points)
    clear = smoothstep(*HALO, off) if behind.any() else np.ones(hair.shape)
    level = float(points[EYE_CORNERS, 1].mean())
    hair = hair * unlike_backdrop(
        picture, hair.astype(np.float32), segmentation.regions == BACKGROUND, level, scale
    )
    strip = shown * ((segmentation.regions == SKIN) | (around & ~behind))
    occluder = np.isin(segmentation.regions, (GLASSES, HIDDEN))
    if occluder.any():  # hinges and arms of glasses are wider than their labels
        off = cv2.distanceTransform((~occluder).astype(np.uint8), cv2.DIST_L2, 3) / scale
        clear = clear * smoothstep(*HINGE, off)
    shadow = np.zeros(hair.shape) if segmentation.shadow is None else segmentation.shadow
    layers = (
        segmentation.skin * taken,
        hair * clear,
        strip * clear * (1 - shadow),
        occluder,
        shadow,
        segmentation.labels == GLASSES,
        np.isin(segmentation.labels, (BROWS, BEARD, LIPS, MOUTH, EYES)),
    )
    return Mattes(*(x.astype(np.float32) for x in layers))


def _large(mask, area):
    """The parts of a boolean mask [H, W] that have more than `area` pixels."""
    _, number, found, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8))
    return mask & (found[:, cv2.CC_STAT_AREA] > area)[number]


def hair_layer(linear, mattes, head, atlas, visibility, square=SQUARE):
    """What lies over the skin of the head.

    Args:
        linear: [H, W, 3] float32 photo.
        mattes: Mattes of the photo.
        atlas: Atlas of the head's skin.
        visibility: Visibility of that atlas through the photo's camera.
        square: cosine up to which the photo says nothing of a place, and from which on all.

    Returns:
        [T, T, 4] float32, linear, colour multiplied by alpha.
    """
    pixels = visibility.pixels
    inside = atlas.paint(np.ones(len(pixels), np.float32))
    growth = growth_on(head, atlas)
    # The strip is of a hairline, or of what a fringe hangs on, not of a cheek.
    strip = np.maximum(beside_scalp(growth), forehead(head, atlas.size))
    here, bare, edge = (bilinear(m, pixels) for m in (mattes.hair, mattes.skin, mattes.strip))
    on_head = above_the_neck(head, atlas)
    here, edge = here * on_head, edge * on_head
    # Background that a skull too large shows is no proof of a bald head.
    whole = _without_cracks(atlas.paint(here + edge + bare)).reshape(-1)[atlas.index]
    proof = smoothstep(0.3, 0.9, whole)
    told, cosine = atlas.paint(visibility.visible * proof), atlas.paint(visibility.cosine)
    on_skin = soften(atlas.paint(visibility.weight(*ON_SKIN) * proof), inside)
    color = atlas.paint(bilinear(linear, pixels))
    here, edge = atlas.paint(here), atlas.paint(edge) * strip
    lost = loose(here, growth)
    here, edge = here * (1 - lost), edge * (1 - lost)

    def blurred(grid):
        return cv2.GaussianBlur((grid * inside).astype(np.float32), (0, 0), atlas.size / LINE)

    along = strands(head, atlas)
    rank = atlas.paint(ranked(locks(along, *HAIRS)))
    beside = 1 - uv_polygon(head, OVAL, 0.8, atlas.size)
    sides = 1 - uv_polygon(head, OVAL, 0.6, atlas.size)  # not of a nose
    labelled, ragged = here, smoothstep(*RAGGED, cosine) * sides
    even = single_hairs(
        smoothstep(0.1, 0.9, normalized_blur(here, inside, atlas.size / COMB)), rank
    )
    here = here + ragged * (even - here)
    edge = edge * (1 - ragged * even)
    # Unseen scalp has hair if the scalp that was seen nearest to it has: thin hair stays thin.
    own, other = trusted(cosine, told, square)
    near = np.minimum(on_skin * (1 - other), growth + 0.02)
    near = from_both(here[..., None], near.astype(np.float32), own)
    usual = growth * smoothstep(0.35, 0.65, both_sides(near, on_skin))[..., 0]
    grown = weighed(own, other, here, usual, blurred)
    places = atlas.at(head.mean)
    temples = temples_of(head, places)
    burns = sideburns(temples, places, pixels, visibility.cosine, mattes.hair)
    grown = temples.smooth(
        grown.reshape(-1)[atlas.index], visibility.cosine * told.reshape(-1)[atlas.index], burns
    )
    grown = np.maximum(atlas.paint(grown), growth * atlas.paint(temples.above_ears(burns)))
    own, look = (
        soften(weight.astype(np.float32), inside)
        for weight in (own, np.minimum(own, smoothstep(*LOOK, cosine)))
    )
    seen = on_skin + strip * (look - on_skin)
    shown = np.clip(seen * here + look * edge, 0, 1)

    lock = here * (on_skin + strip * (own - on_skin))
    if lock.sum() < 1e-4 * len(pixels):
        return np.concatenate([color, np.ones_like(color[..., :1])], -1) * shown[..., None]
    sure = cv2.erode((lock > 0.9).astype(np.float32), np.ones((5, 5), np.uint8)) * growth
    noise = atlas.paint(sum(share * locks(along, *size) for *size, share in LOCKS))
    fray = FRAYED * atlas.paint(locks(along, *FRAY))
    dense = smoothstep(0.1, 0.9, grown + fray)
    dense = dense * (1 - smoothstep(*SPARSE, bald_around(growth * (1 - grown))))
    line = single_hairs(dense * atlas.paint(above_nape(head, atlas)), rank)
    unseen = (1 - seen) * strip * line * (1 - lost) * (1 - atlas.paint(on_ears(head, atlas)))
    dark = np.log(np.maximum(color, 1e-3))  # dark hair stays dark beside its highlights
    local, close = tone_around(linear, mattes.hair)
    close = bilinear(close, pixels) * smoothstep(*NEARBY, visibility.cosine)
    tone = tone_of(
        color, sure if sure.any() else lock, own, linear, mattes.hair, mattes.skin,
        atlas.paint(bilinear(local, pixels)), atlas.paint(close) * told,
    )  # fmt: skip
    smooth = np.exp(both_sides(tone, seen))
    made = smooth * np.exp(_energy(color, sure) * noise)[..., None]
    # A side that is hardly seen looks as the other one does, in its own tone.
    other, there = color[:, ::-1] * smooth / smooth[:, ::-1], (look * sure)[:, ::-1]
    made += cv2.GaussianBlur(there, (0, 0), 2)[..., None] * (other - made)
    # Not bits that no hair grows around: as the photo has them, they look like the skin beside them.
    streaky = here * smoothstep(0.1, 0.4, grown) * soften(smoothstep(*STRANDS, cosine), inside)
    streaky = np.maximum(streaky, np.clip(here - labelled, 0, 1))  # there the photo shows skin
    color = color + streaky[..., None] * (made - color)
    # What hangs before temples and cheeks does not end with the view: it fades out beyond it, but not
    # over skin that is seen.
    fade = np.clip(2 * cv2.GaussianBlur(shown, (0, 0), atlas.size / BESIDE), 0, 1)
    fade *= np.maximum(1 - seen - unseen, 0) * inside * beside
    skin = bilinear(cv2.dilate(mattes.skin, np.ones((9, 9), np.uint8)), pixels)  # and cracks beside
    fade *= 1 - atlas.paint(skin * visibility.weight(*ON_SKIN))
    near = np.exp(diffuse(dark, shown))
    layers = ((color, shown), (made, unseen), (near, fade))
    total = sum(colors * alpha[..., None] for colors, alpha in layers)
    alpha = sum(alpha for _, alpha in layers)[..., None]
    # Where two layers meet, their blurs may add up to more than all.
    return np.concatenate([total, alpha], -1) / np.maximum(alpha, 1)


def _without_cracks(known):
    """What labels tell [T, T] 0..1, cracks between hair, strip and skin closed.

    In such a crack hair would be made up: a dashed dark line along the hairline.
    """
    width = int(len(known) / CRACK) | 1
    return cv2.morphologyEx(known, cv2.MORPH_CLOSE, disk(width / 2))


def loose(here: np.ndarray, growth: np.ndarray) -> np.ndarray:
    """Where hair [T, T] is of patches that do not reach the scalp, 0 or 1.

    Such a patch hangs behind the jaw, or is no hair: a beard, the temple of glasses.

    Args:
        growth: [T, T] 0..1, the scalp.
    """
    _, patch = cv2.connectedComponents((here > 0.3).astype(np.uint8))
    held = np.unique(patch[growth > 0.5])
    lost = ((patch > 0) & ~np.isin(patch, held)).astype(np.float32)
    return cv2.dilate(lost, np.ones((5, 5)))


def both_sides(values, seen):
    """Values [T, T, C] that agree with their mirror image where neither side was seen.

    What is continued around the head from left and right meets at the back without a seam.
    """
    far = 1 - cv2.GaussianBlur(np.maximum(seen, seen[:, ::-1]), (0, 0), seen.shape[0] / 40)
    middle = (values + values[:, ::-1]) / 2
    return values + far[..., None] * (middle - values)


def strands(head: HeadModel, atlas: Atlas) -> np.ndarray:
    """Places [n, 3] mm of an atlas's texels across, across and along strands that run down from the crown.

    At the sides they run back, too.
    """
    points = atlas.at(head.mean)
    out = points - [0.0, points[:, 1].max() - 95, points[:, 2].mean()]
    radius = np.linalg.norm(out, axis=1)
    down = np.arccos(np.clip(out @ CROWN / radius, -1, 1))
    around = np.arctan2(out[:, 0], -out[:, 1] * CROWN[2] + out[:, 2] * CROWN[1])
    # Along a strand it is d(around) / d(down) = BACKWARDS sin(around): the azimuth that it had at the top.
    around = 2 * np.arctan(np.tan(around / 2) * np.exp(-BACKWARDS * down))
    ring = radius * np.sin(np.clip(down, 0.3, np.pi))
    return np.stack([np.cos(around) * ring, np.sin(around) * ring, down * radius], 1)


def locks(places: np.ndarray, width: float, length: float) -> np.ndarray:
    """Noise [n] of unit strength in locks of so many mm, at places [n, 3] as of `strands`."""
    found: np.ndarray = value_noise(places / (width, width, length), 1.0, 7)
    return found


def ranked(noise: np.ndarray) -> np.ndarray:
    """Noise [n] as ranks 0..1: each as often as any other."""
    rank = np.empty(len(noise), np.float32)
    rank[np.argsort(noise, kind="stable")] = np.linspace(0, 1, len(noise))
    return rank


def single_hairs(density: np.ndarray, rank: np.ndarray) -> np.ndarray:
    """Alpha [...] of hair that thins out, by how many hairs [...] 0..1 there are and the rank of each."""
    alpha: np.ndarray = density + 4 * APART * density * (1 - density) * (rank - 0.5)
    return np.clip(alpha, 0, 1)


def _energy(color, sure):
    """How strongly the log-brightness of locks differs, in what is surely hair."""
    gray = np.log(np.maximum(color @ LUMA, 1e-3))
    fine = gray - cv2.GaussianBlur(gray, (0, 0), 4)
    inner = cv2.erode(sure, np.ones((9, 9), np.uint8)) > 0
    return np.float32(min(float(np.std(fine[inner])), 0.5) if inner.any() else 0.1)
