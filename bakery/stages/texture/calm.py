"""The cheeks of a smile, no more uneven than cheeks at rest are.

A smile lifts and folds the cheeks, the fit follows roughly, and at rest what lay on a fold is pulled
apart: bright streaks, dents, the glare of glasses. Each octave of the texture is held to the amplitude
that resting cheeks have; what is fainter, pores and moles among it, stays as it is.

References:
    Boyadzhiev, Bala, Paris and Adelson, "Band-Sifting Decomposition for Image Based Material Editing",
    ACM TOG 34(5), 2015: wrinkles, blotches and gloss of skin are scaled by octave, sign and amplitude.
"""

from dataclasses import dataclass

import cv2
import numpy as np

from bakery import landmarks as marks
from bakery.geometry.color import LUMA
from bakery.geometry.fill import around, normalized_blur, smoothstep
from bakery.heads.base import HeadModel
from bakery.stages.atlas import Atlas, texel_size, uv_polygon
from bakery.stages.texture.creases import levelled

# Octaves: standard deviation (mm) of the blur that ends each, and the root mean square that it may have,
# of log luminance and of log colour beside it. In resting cheeks, by 8 neutral photos of london/train,
# three quarters of the skin have less of pores and colours, and half of folds; of the two widest half has
# less than 0.040, and nine tenths than 0.100. They are held lower: dents beside a smile are as wide.
OCTAVES = (
    (0.35, 0.029, 0.0070),
    (0.7, 0.023, 0.0055),
    (1.4, 0.018, 0.0078),
    (2.8, 0.023, 0.0109),
    (5.6, 0.030, 0.0141),
    (11.2, 0.070, 0.0173),
)
NEAR = 1.25  # widths of an octave's blur over which its amplitude is taken
NOSE = np.array([168, 417, 465, 343, 277, 279, 358, 327, 2, 98, 129, 49, 47, 114, 245, 193])
WINGS = np.array([327, 326, 2, 97, 98])  # the nose's base, from its left wing to the right
MOUSTACHE = np.concatenate([marks.LIPS_OUTER_UPPER, WINGS])
RINGS = (  # what has edges of its own, how much larger, and mm over which the skin beside it fades in
    (marks.LIPS_OUTER, 1.0, (1.0, 5.0)),
    (NOSE, 1.0, (1.0, 4.0)),
    (MOUSTACHE, 1.0, (1.0, 5.0)),
    (marks.EYE_RIGHT, 1.2, (3.0, 7.0)),
    (marks.EYE_LEFT, 1.2, (3.0, 7.0)),
    (marks.BROW_RIGHT, 1.0, (1.0, 5.0)),
    (marks.BROW_LEFT, 1.0, (1.0, 5.0)),
)
WITHIN = 1.05  # of the face's contour
FADE = 6.0  # mm over which the contour's border fades
EARS = (
    0.0,
    8.0,
)  # mm before the contour's hindmost point, beside the ears, where nothing and all is changed
# A beard is no fold: how much more detail of HAIRS (mm) there is than on the cheeks. On the chin, from
# which on all stays from the mouth down (its corners, to both sides): shaven 0.9 to 1.2, bearded 1.3 to
# 1.4. Above the lip, from which on all stays beside the moustache: shaven 1.3 to 2.7, for a smile folds it
# too; with one 2.8 to 4.0 (22 of congress, among them 19 of val). mm.
HAIRS, CHIN, MOUSTACHED = (0.2, 0.5), (1.15, 1.3), (2.2, 2.8)
BELOW, BESIDE = 3.0, (20.0, 12.0)
# mm: half the width of the widest hollow, the blur by which folds are none, and above the nose's
# base, where none is filled and where all are. Of the logarithm: how deep one may be, and what of it stays.
HOLLOW, HOLLOW_SOFT, HOLLOW_BELOW, DEEP, FAINT = 15.0, 2.5, (18.0, 4.0), 0.45, 0.015
# mm: half the width of the widest crease in a beard, the blur by which hairs are none, and outward from a
# corner of the mouth, where none is filled and where all are: moustache and goatee are as narrow.
CREASE, CREASE_SOFT, ASIDE = 7.0, 1.2, (6.0, 14.0)
# Above the lip: how much larger its ring is, of its shade what is filled, and mm: from lips and nose, where
# none is and where all is, and the same below the nose's base.
UPPER_LIP, SHADE, OFF_LIPS, OFF_NOSE, UNDER_NOSE = 1.15, 0.9, (0.5, 3.0), (0.5, 2.5), (1.0, -3.0)
LIT = 0.01  # log by which it was made lighter, from which
FADES = 6.0  # it loses detail that is finer than FINE: e to the power of so many times that
FINE = 1.5  # mm
DARK = 2e-3  # linear


@dataclass(frozen=True, eq=False)
class Cheeks:
    """The plain skin below the brows, in a window [h, w] of the atlas."""

    window: tuple[slice, slice]
    weight: np.ndarray  # [h, w] 0..1, how surely it is plain skin
    beard: np.ndarray  # [h, w] 0..1, how surely a beard may grow there
    shaven: float  # 0..1, how surely none does
    texel: float  # mm

    def log(self, colors: np.ndarray, on_skin: Atlas) -> np.ndarray:
        """Logarithm [h, w, 3] of linear colours [N, 3]."""
        return _log(colors, on_skin, self.window)

    def rows(self, picture: np.ndarray, on_skin: Atlas) -> np.ndarray:
        """Values [h, w, ...] in the window at all texels [N, ...], 0 elsewhere."""
        whole = np.zeros((on_skin.size, on_skin.size, *picture.shape[2:]), np.float32)
        whole[self.window] = picture
        return whole.reshape(-1, *picture.shape[2:])[on_skin.index]


def cheeks_of(colors: np.ndarray, plain: np.ndarray, head: HeadModel, on_skin: Atlas) -> Cheeks:
    """The cheeks of a face.

    Args:
        colors: [N, 3] linear; plain: [N] 0..1, 0 where hair on the face is dark by nature.
        head: HeadModel; on_skin: its skin, N texels.
    """
    weight, texel = _cheeks(head, on_skin)
    window = around(weight > 0, 0)
    log = _log(colors, on_skin, window)
    beard, shaven = _beard(head, on_skin, log, weight, window, texel)
    return Cheeks(window, (weight * on_skin.paint(plain))[window], beard, shaven, texel)


def calmed(
    colors: np.ndarray,
    plain: np.ndarray,
    cheeks: Cheeks,
    head: HeadModel,
    on_skin: Atlas,
    share: float,
) -> np.ndarray:
    """Colours [N, 3] linear of the skin's texels, with cheeks as even as resting ones.

    Args:
        colors, plain, head, on_skin: as for `cheeks_of`; cheeks: what that gave.
        share: 0..1, how surely the face is not at rest.
    """
    if not share:
        return colors
    beard, texel = cheeks.beard, cheeks.texel
    log, whole = cheeks.log(colors, on_skin), share * cheeks.weight
    weight = whole * (1 - beard)
    change, fine, known = np.zeros_like(log), log, (weight > 0).astype(np.float32)
    for width, *most in OCTAVES:
        coarse = normalized_blur(log, known, width / texel)
        luma = ((fine - coarse) @ LUMA)[..., None]
        for part, limit in zip((luma, fine - coarse - luma), most):
            square = normalized_blur((part**2).mean(2), known, NEAR * width / texel)
            gain = np.minimum(1, limit / np.sqrt(np.maximum(square, 1e-10)))
            change += part * (gain - 1)[..., None]
        fine = coarse
    made = colors * np.exp(cheeks.rows(change * weight[..., None], on_skin))
    made = _without_hollows(made, cheeks.rows(weight, on_skin), head, on_skin, texel)
    made = _without_creases(made, cheeks.rows(whole * beard, on_skin), head, on_skin, texel)
    return _without_shade(made, plain, head, on_skin, share * cheeks.shaven, texel)


def _log(colors, on_skin, window):
    return np.log(np.maximum(on_skin.paint(colors.astype(np.float32))[window], DARK))


def _without_hollows(colors, share, head, on_skin, texel):
    """Colours [N, 3] without the wide dark places that the shade of a smile leaves from the nose down.

    Args:
        share: [N] 0..1, how far each texel may change.
    """
    nose = head.landmarks(head.mean)[marks.NOSE_BASE[0], 1]
    share = share * smoothstep(*HOLLOW_BELOW, on_skin.at(head.mean)[:, 1] - nose)
    rows = np.flatnonzero(share > 0)
    where = rows, share[rows], texel
    return levelled(colors, on_skin, where, 1.0, HOLLOW, DEEP, HOLLOW_SOFT, FAINT)


def _without_creases(colors, share, head, on_skin, texel):
    """Colours [N, 3] of a beard without the creases that a smile cuts into its sides, from cheek to jaw.

    Args:
        share: [N] 0..1, how far each texel may change.
    """
    corner = np.abs(head.landmarks(head.mean)[marks.MOUTH_CORNERS, 0]).mean()
    share = share * smoothstep(*ASIDE, np.abs(on_skin.at(head.mean)[:, 0]) - corner)
    rows = np.flatnonzero(share > 0)
    return levelled(colors, on_skin, (rows, share[rows], texel), 1.0, CREASE, DEEP, CREASE_SOFT)


def _without_shade(colors, plain, head, on_skin, share, texel):
    """Colours [N, 3] whose upper lip is about as light as the cheeks beside it.

    A smile draws it wide: shade and stubble are pushed together at rest, and look like a moustache.
    """
    if not share:
        return colors

    def off(ring):
        inside = uv_polygon(head, ring, 1.0, on_skin.size).astype(np.uint8)
        away = cv2.distanceTransform(1 - inside, cv2.DIST_L2, 5) * texel
        return away.reshape(-1)[on_skin.index]

    lips, nose = off(marks.LIPS_OUTER), off(NOSE)
    base = head.landmarks(head.mean)[marks.NOSE_BASE[0], 1]
    lip = uv_polygon(head, MOUSTACHE, UPPER_LIP, on_skin.size).astype(np.float32)
    lip = cv2.GaussianBlur(lip, (0, 0), HOLLOW_SOFT / texel).reshape(-1)[on_skin.index]
    weight = smoothstep(0.2, 0.8, lip) * smoothstep(*OFF_LIPS, lips) * smoothstep(*OFF_NOSE, nose)
    weight = SHADE * share * plain * weight
    weight = weight * smoothstep(*UNDER_NOSE, on_skin.at(head.mean)[:, 1] - base)
    rows = np.flatnonzero(weight > 0)
    known = ((lips > OFF_LIPS[0]) & (nose > OFF_NOSE[0])).astype(np.float32)
    where = rows, weight[rows], texel
    made = levelled(colors, on_skin, where, 1.0, HOLLOW, DEEP, HOLLOW_SOFT, FAINT, known)
    return _as_fine(made, colors, on_skin, rows, texel)


def _as_fine(made, colors, on_skin, rows, texel):
    """Colours [N, 3] made lighter at some rows [n] than they were, with less detail by as much.

    In the shade below a nose a photo has noise, stubble and folds that a smile draws together: lit, they
    are scars.
    """
    log, before = (np.log(np.maximum(c[rows], DARK)) for c in (made, colors))
    lift = (log - before).mean(1)
    lit = lift > LIT
    if not lit.any():
        return made
    rows, log, lift = rows[lit], log[lit], lift[lit]
    sigma = FINE / texel
    among = np.zeros((on_skin.size, on_skin.size), np.float32)
    among.reshape(-1)[on_skin.index[rows]] = 1
    window = around(among > 0, 5 * sigma)  # more than the blur reaches
    grid = np.zeros((*among.shape, 3), np.float32)
    grid.reshape(-1, 3)[on_skin.index[rows]] = log
    smooth = np.zeros_like(grid)
    smooth[window] = normalized_blur(grid[window], among[window], sigma)
    smooth = smooth.reshape(-1, 3)[on_skin.index[rows]]
    out = made.copy()
    out[rows] = np.exp(smooth + (log - smooth) * np.exp(-FADES * lift)[:, None])
    return out


def _beard(head, on_skin, log, weight, window, texel):
    """How surely a texel of the window [h, w] may hold a beard, as the detail on chin and upper lip tells.

    And how surely the face is shaven, 0..1.
    """
    places, points = on_skin.at(head.mean), head.landmarks(head.mean)
    level = points[marks.MOUTH_CORNERS, 1].mean()
    below = on_skin.paint(smoothstep(level + BELOW, level - BELOW, places[:, 1]))[window]
    skin = on_skin.paint(np.ones(len(places), np.float32))[window]
    fine, coarse = (normalized_blur(log @ LUMA, skin, width / texel) for width in HAIRS)
    detail = np.abs(fine - coarse)
    lip = uv_polygon(head, MOUSTACHE, 0.8, on_skin.size)[window].astype(np.uint8)
    plain = weight[window] > 0.9
    usual = max(float(np.median(detail[plain & (below == 0)])), 1e-6)
    chin, above = (np.median(detail[part]) / usual for part in (plain & (below > 0.5), lip > 0))
    away = cv2.distanceTransform(1 - lip, cv2.DIST_L2, 5) * texel
    moustache = smoothstep(*BESIDE, away) * smoothstep(*MOUSTACHED, above)
    bearded, grown = smoothstep(*CHIN, chin), smoothstep(*MOUSTACHED, above)
    return np.maximum(below * bearded, moustache), float((1 - bearded) * (1 - grown))


def _cheeks(head: HeadModel, on_skin: Atlas) -> tuple[np.ndarray, float]:
    """How surely a texel [T, T] is plain skin below the brows; mm a texel."""
    size, places = on_skin.size, on_skin.at(head.mean)
    points = head.landmarks(head.mean)
    texel = texel_size(places, on_skin.index)
    brows, eyes = points[marks.BROWS, 1].max(), points[marks.EYE_CORNERS, 1].mean()
    weight = on_skin.paint(smoothstep(brows, eyes, places[:, 1]).astype(np.float32))
    face = uv_polygon(head, marks.OVAL, WITHIN, size).astype(np.uint8)
    window = around(face > 0, 2)
    within = cv2.distanceTransform(face[window], cv2.DIST_L2, 5) * texel
    part = weight[window] * np.float32(smoothstep(0, FADE, within))
    before = places[:, 2] - points[marks.OVAL, 2].min()  # an ear's folds are its own, in any face
    part *= on_skin.paint(np.float32(smoothstep(*EARS, before)))[window]
    for ring, larger, fade in RINGS:
        inside = uv_polygon(head, ring, larger, size)[window].astype(np.uint8)
        away = cv2.distanceTransform(1 - inside, cv2.DIST_L2, 5) * texel
        part *= np.float32(smoothstep(*fade, away))
    weight[:] = 0
    weight[window] = part
    return weight, texel
