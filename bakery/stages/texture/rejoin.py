"""Where the skin of a smile was changed much, it gets tone and pores of the skin around.

What folds, glare and shade were filled with is flat, ends at an edge, and has no pores: it shows as a
patch beside the mouth. A membrane over the tone of what was hardly changed takes its place, and the
person's own grain what it lacks of detail.

References:
    Perez, Gangnet and Blake, "Poisson Image Editing", ACM TOG 22(3), 2003, section 2: the membrane.
    Heitz and Neyret 2018: the grain; see grain.py.
"""

import cv2
import numpy as np

from bakery import landmarks as marks
from bakery.geometry.color import LUMA
from bakery.geometry.fill import diffuse, normalized_blur, smoothstep
from bakery.geometry.masks import disk
from bakery.heads.base import HeadModel
from bakery.stages.atlas import Atlas
from bakery.stages.texture.calm import Cheeks
from bakery.stages.texture.grain import own_grain

CHANGED = (0.06, 0.2)  # log of a change, over SOFT, that leaves the tone as it is, that does not
SOFT, RIM = 1.0, 1.0  # mm, of the blur, and how far around it the tone is not believed
PLAIN = 0.5  # of the cheeks' weight, from which skin tells the tone beside it
TONE = 1.4  # mm, standard deviation of the blur above which it is tone
EVEN = 2.0  # mm, of the blur of the membrane, which has ridges
GRAIN = 1.0  # mm, of the blur below which it is grain
# mm below the eyes' corners, over which it begins: bags and lines are the person's own.
BELOW = (12.0, 22.0)
FAINTEST = 1e-8  # variance of grain below which it is none
AMONG = 2.5  # mm, of the blur over which grain has its strength


def rejoined(
    made: np.ndarray,
    seen: np.ndarray,
    cheeks: Cheeks,
    head: HeadModel,
    on_skin: Atlas,
    share: float,
) -> np.ndarray:
    """Colours [N, 3] linear of the skin's texels, with cheeks that show no patches.

    Args:
        made: [N, 3] linear, with cheeks as even as at rest; seen: the same before any change.
        cheeks: Cheeks of the face; head: HeadModel; on_skin: its skin, N texels.
        share: 0..1, how surely the face is not at rest.
    """
    if not share:
        return made
    weight = cheeks.weight * (1 - cheeks.beard)
    now, before = cheeks.log(made, on_skin), cheeks.log(seen, on_skin)
    change = np.abs(_blur(now - before, SOFT, cheeks)).max(2)
    change = cv2.dilate(change, disk(round(RIM / cheeks.texel)))  # its border belongs to it
    changed = np.float32(smoothstep(*CHANGED, _blur(change, SOFT, cheeks)))
    sure = cv2.erode((weight > PLAIN) * (1 - changed), np.ones((5, 5), np.uint8))
    if not (sure > PLAIN).any():
        return made
    tone = normalized_blur(now, sure, TONE / cheeks.texel) * (sure > 0)[..., None]
    membrane = _blur(diffuse(tone, sure), EVEN, cheeks)
    level = head.landmarks(head.mean)[marks.EYE_CORNERS, 1].mean()
    lower = smoothstep(*BELOW, level - on_skin.at(head.mean)[:, 1]).astype(np.float32)
    lower = on_skin.paint(lower)[cheeks.window]
    new = now + (weight * changed * lower)[..., None] * (membrane - now)
    trusted = np.zeros((on_skin.size, on_skin.size), np.float32)
    trusted[cheeks.window] = sure
    on_cheeks = on_skin.some(cheeks.rows(cheeks.weight, on_skin) > 0)
    grain = own_grain(on_skin.paint(made), trusted, head.mean, on_cheeks)
    if grain is not None:
        grain = _fine(grain[cheeks.window], cheeks)
        lack = _lack(new, now, changed * lower, sure, cheeks)
        usual = np.median(_energy(grain, cheeks)[weight > PLAIN])
        gain = smoothstep(0, PLAIN, weight) * np.sqrt(lack / max(usual, FAINTEST))
        new += gain.astype(np.float32)[..., None] * grain
    return made * np.exp(share * cheeks.rows(new - now, on_skin))


def _lack(new, now, patch, sure, cheeks):
    """What new logarithms [h, w, 3] lack of detail [h, w], by energy.

    A patch has as much as skin that was hardly changed; what is beside it no more than it had.
    """
    own = _energy(_fine(now, cheeks), cheeks)
    usual = np.median(own[sure > PLAIN])
    wanted = patch * usual + (1 - patch) * np.minimum(own, usual)
    return np.maximum(wanted - _energy(_fine(new, cheeks), cheeks), 0)


def _fine(log, cheeks):
    return log - _blur(log, GRAIN, cheeks)


def _energy(fine, cheeks):
    """Variance [h, w] of luminance around each texel, of what is fine [h, w, 3]."""
    return _blur((fine @ LUMA) ** 2, AMONG, cheeks)


def _blur(picture, width, cheeks):
    """A blur of the cheeks alone, by mm."""
    known = (cheeks.weight > 0).astype(np.float32)
    return normalized_blur(picture, known, width / cheeks.texel)
