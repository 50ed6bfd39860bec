"""The picture of lashes and tear line: strands in alpha, on the cards of `heads.lashes`."""

import cv2
import numpy as np

from bakery.geometry.color import LUMA
from bakery.geometry.fill import smoothstep
from bakery.geometry.sample import bilinear
from bakery.heads.lashes import BANDS, card_rectangle, card_texels
from bakery.landmarks import BROW_LEFT, BROW_RIGHT, LIDS_UPPER
from bakery.stages.texture.lids import FOLD

FINE = 6  # times finer than the atlas that strands are drawn
LONG = 30.0  # mm, about the length of a rim: what a card's picture is wide
# Lashes of a lid: how many, how many grow toward one tip, mm at the root, alpha.
STRANDS = {"upper": (84, 3, 0.17, 0.9), "lower": (46, 2, 0.13, 0.65)}
APART, LEAST = 2.4, 0.8  # texels between lashes, and of their width: fewer and thicker where coarse
SWAY = {"upper": 0.03, "lower": 0.016}  # share of the card that tips stray along it
DARK = 0.35  # of the brow's darkest hair, which the photo mixes with skin
LIMITS = (0.03, 0.2)  # luminance of lashes over the skin's: never black, never pale
# Luminance of the rim of the lid over that of the lid above, as photographed, at which lashes are as
# strong as they get, and as weak; and how weak that is.
RIM = (0.15, 0.65)
WEAKEST = 0.6
WET = np.array([1.0, 0.98, 0.95], np.float32)
GLEAM, CONTACT = 0.42, 0.22  # alpha of the highlight on the fluid and of the dark line beside it


def lash_color(texture, head):
    """Colour [3] linear of the lashes: that of the brows' darkest hair, darker.

    Args:
        texture: [T, T, 3] float32 linear, T_0.
    """
    size = texture.shape[0]
    places = head.landmark_uv() * size
    mask = np.zeros((size, size), np.uint8)
    for brow in (BROW_LEFT, BROW_RIGHT):
        cv2.fillPoly(mask, [np.round(cv2.convexHull(np.float32(places[brow]))).astype(np.int32)], 1)
    brow = texture[mask > 0]
    light = brow @ LUMA
    hair = brow[light <= np.percentile(light, 15)].mean(0)
    skin = float(np.percentile(light, 90))
    low, high = (limit * skin for limit in LIMITS)
    dark = DARK * hair
    return dark * np.clip(dark @ LUMA, low, high) / max(float(dark @ LUMA), 1e-6)


def presence(texture, head):
    """How strong the photographed lashes are, WEAKEST..1: made-up ones are nearly black."""
    places = head.landmark_uv() * texture.shape[0]
    found = []
    for rim, fold in zip(LIDS_UPPER, FOLD):
        rim, fold = places[rim][2:-2], places[list(fold)][2:-2]
        dark, lid = (
            np.median(bilinear(texture, rim + share * (fold - rim)) @ LUMA) for share in (0.1, 0.5)
        )
        found.append(dark / max(lid, 1e-6))
    return WEAKEST + (1 - WEAKEST) * float(smoothstep(*RIM[::-1], np.mean(found)))


def lay_lashes(layer, texture, head, white):
    """The hair layer with lashes and tear line in their place.

    Args:
        layer: [T, T, 4] float32 linear, colour multiplied by alpha.
        texture: [T, T, 3] float32 linear, T_0.
        head: HeadModel with cards.
        white: [3] linear, the white of the eye.

    Returns:
        [T, T, 4] float32; the layer itself where the head has no place for cards.
    """
    if card_rectangle(head) is None:
        return layer
    place = card_texels(head, layer.shape[0])
    height, width = layer[place].shape[:2]
    sheet = np.zeros((height, width, 4), np.float32)
    color, strength = lash_color(texture, head), presence(texture, head)
    rng = np.random.default_rng(11)
    for name in ("upper", "lower"):
        first, last = (round(share * height) for share in BANDS[name])
        alpha = strength * _strands(rng, name, width, last - first)
        sheet[first:last] = np.dstack([alpha[..., None] * color, alpha])
    first, last = (round(share * height) for share in BANDS["tear"])
    sheet[first:last] = _fluid(rng, width, last - first, white)
    out = layer.copy()
    out[place] = sheet
    return out


def _strands(rng, name, width, height):
    """Alpha [height, width] of the lashes of one lid; roots on the top."""
    count, cluster, thick, most = STRANDS[name]
    count, thick = min(count, int(width / APART)), max(thick, LEAST * LONG / width)
    wide, high = width * FINE, height * FINE
    picture = np.zeros((high, wide), np.float32)
    roots = (np.arange(count) + rng.uniform(-0.35, 0.35, count) + 0.5) / count
    groups = np.cumsum(rng.random(count) < 1 / cluster)
    lean = SWAY[name] * rng.normal(0, 1, groups.max() + 1)
    reach = rng.uniform(0.72, 1.0, groups.max() + 1)
    along = np.linspace(0, 1, 14)
    for root, group in zip(roots, groups):
        middle = roots[groups == group].mean()
        tip = middle + 0.35 * (root - middle) + lean[group] + 0.25 * SWAY[name] * rng.normal()
        length = reach[group] * rng.uniform(0.75, 1.0) * rng.choice([1, 0.6], p=[0.8, 0.2])
        x = (
            root
            + (tip - root) * along**1.6
            + 0.2 * SWAY[name] * rng.normal() * np.sin(np.pi * along)
        )
        y = 0.98 * length * along
        mm = thick * rng.uniform(0.75, 1.15) * (1 - along) ** 0.8 + 0.02
        places = np.stack([x * wide, y * high], 1)
        for a, b, w in zip(places[:-1], places[1:], mm * wide / LONG):
            cv2.line(
                picture, *(tuple(int(c * 16) for c in p) for p in (a, b)),
                1.0, max(1, round(float(w))), cv2.LINE_AA, 4,
            )  # fmt: skip
    alpha = cv2.resize(picture, (width, height), interpolation=cv2.INTER_AREA)
    alpha = cv2.GaussianBlur(alpha, (0, 0), 0.6)
    down = np.linspace(0, 1, height, dtype=np.float32)[:, None]
    across = np.linspace(0, 1, width, dtype=np.float32)
    ends = np.clip(np.minimum(across, 1 - across) / 0.06, 0, 1)
    alpha = most * alpha * (1 - 0.45 * down) * (0.35 + 0.65 * ends)
    alpha[-1], alpha[:, 0], alpha[:, -1] = 0, 0, 0
    return np.clip(alpha, 0, 1)


def _fluid(rng, width, height, white):
    """The tear line [height, width, 4], colour multiplied by alpha; the lid on the top."""
    down = (np.arange(height, dtype=np.float32) + 0.5)[:, None] / height
    across = np.linspace(0, 1, width, dtype=np.float32)
    knots = rng.uniform(0.35, 1.0, 13)
    uneven = np.interp(across, np.linspace(0, 1, len(knots)), knots)
    ends = np.clip(np.minimum(across / 0.12, (1 - across) / 0.03), 0, 1)
    gleam = GLEAM * np.exp(-(((down - 0.4) / 0.13) ** 2)) * uneven * ends
    dark = CONTACT * np.exp(-(((down - 0.6) / 0.17) ** 2)) * ends
    gleam, dark = np.float32(gleam), np.float32(dark * (1 - gleam))
    light = np.clip(1.5 * white, 0, 1) * WET
    shade = 0.35 * np.asarray(white) * [1.0, 0.72, 0.66]
    color = gleam[..., None] * light + dark[..., None] * shade
    return np.dstack([color, gleam + dark]).astype(np.float32)
