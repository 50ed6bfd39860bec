"""Hair that was taken for an ear.

Hair that hangs over an ear has its place and much of its outline. Its hue tells, and that more hair
stands around it than around an ear that is seen.
"""

import cv2
import numpy as np

from bakery.detectors import portrait
from bakery.geometry.color import LUMA, to_linear
from bakery.stages.segment import prior

# Share of an ear that has the colours of hair, times the share of its border along hair: of 900 ears of
# congress nine have more, which all are hair but for one earring. Bare ears below thick hair have 0.1.
COVERED = 0.2
LEAST = 60  # pixels of an ear, and of the hair and skin beside it; fewer tell nothing
# Log, by which two hues, and the luminance, of the same hair or skin differ at least. Ears lie in shade.
HAIR_SPREAD, SKIN_SPREAD = (0.05, 0.05, 0.2), (0.05, 0.05, 0.5)
FOREIGN = 14.0  # squared distance, in spreads, from which a colour is no hair's: earrings
PALER = 0.05  # log of red over green, by which hair is less red than the skin beside it: ears are redder
BORDER = np.ones((5, 5), np.uint8)


def covered(top: np.ndarray, picture: np.ndarray) -> np.ndarray:
    """Where [S, S] bool hair was taken for an ear.

    Args:
        top: [S, S] of portrait.CLASSES, in the face frame.
        picture: [S, S, 3] float32 sRGB-encoded 0..1.
    """
    out = np.zeros(top.shape, bool)
    ears = top == portrait.EARS
    if not ears.any():
        return out
    linear = cv2.GaussianBlur(to_linear(np.maximum(picture, 0.02)), (0, 0), 1.0)
    red, green, blue = cv2.split(np.log(linear))
    color = np.stack([red - green, green - blue, np.log(linear @ LUMA)], -1)
    middle = prior.SIZE // 2
    for side in (np.s_[:, :middle], np.s_[:, middle:]):
        out[side] = _covered(top[side], color[side])
    return out


def _covered(top, color):
    """`covered` of one side, by labels [H, W] and colours [H, W, 3]."""
    ear = top == portrait.EARS
    if ear.sum() < LEAST:
        return np.zeros_like(ear)
    around = np.ones((2 * (int(ear.any(1).sum()) // 2) + 1,) * 2, np.uint8)  # as wide as it is tall
    near = cv2.dilate(ear.astype(np.uint8), around) > 0
    hair = near & (top == portrait.HAIR)
    skin = near & np.isin(top, (portrait.SKIN, portrait.NECK))
    if min(hair.sum(), skin.sum()) < LEAST:
        return np.zeros_like(ear)
    border = (cv2.dilate(ear.astype(np.uint8), BORDER) > 0) & ~ear
    like = color[ear][:, 0] < np.median(color[skin][:, 0]) - PALER
    for channels in (2, 3):  # by hue, and by luminance too: black hair has any hue
        (to_hair, of_hair), (to_skin, of_skin) = (
            _apart(color[ear][:, :channels], color[of][:, :channels], spread[:channels])
            for of, spread in ((hair, HAIR_SPREAD), (skin, SKIN_SPREAD))
        )
        like &= (to_hair + of_hair < to_skin + of_skin) & (to_hair < FOREIGN)
    if like.mean() * hair[border].mean() < COVERED:
        return np.zeros_like(ear)
    share = np.zeros(ear.shape, np.float32)
    share[ear] = like
    known = cv2.GaussianBlur(ear.astype(np.float32), (0, 0), 2)
    return ear & (cv2.GaussianBlur(share, (0, 0), 2) > 0.5 * known)


def _apart(colors, of, spread):
    """Squared distance [N] of colours [N, C] from those [M, C] of a class, and the log of its volume.

    Their sum is twice the negative log likelihood, but for a constant.
    """
    covariance = np.cov(of.T) + np.diag(np.square(spread))
    off = colors - np.median(of, 0)
    return (off @ np.linalg.inv(covariance) * off).sum(1), np.log(np.linalg.det(covariance))
