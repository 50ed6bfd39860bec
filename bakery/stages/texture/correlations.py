"""Feature correlations of skin, in windows of the chart that all head models share.

Saito 2017, section 4.1 (equations 1 and 2), takes the correlations of a network's activations as what a
face looks like, whatever is where. The features here are our own: in each octave the skin's band and
its two derivatives, split into what is lighter and what is darker. Such shallow features know no layout,
so that correlations are taken in windows: lips are compared with lips.
"""

from dataclasses import dataclass

import cv2
import numpy as np

from bakery.geometry.color import LUMA
from bakery.heads.base import HeadModel
from bakery.stages.atlas import Atlas
from bakery.stages.fit.albedo import load_albedo, texel_chart

OCTAVES = 4  # of bands; the finest is one texel wide in an atlas of DENSITY
KINDS = 6  # features an octave: band, along u, along v, each lighter and darker
FEATURES = OCTAVES * KINDS
DENSITY = 1024  # texels on a side that octaves are counted from
WINDOWS = 20  # a side of the chart
LEAST = 0.25  # of a window's texels that must be seen
DARKEST = 2e-3  # linear


@dataclass(frozen=True, eq=False)
class Windows:
    """The windows of the texels of an atlas."""

    atlas: Atlas  # of the skin
    place: np.ndarray  # [N, 2] in windows, from 0 to WINDOWS; outside the chart below 0 or above
    number: np.ndarray  # [N] int, row by row; -1 outside the chart
    size: np.ndarray  # [W] texels of each


@dataclass(frozen=True, eq=False)
class Correlations:
    """Windowed correlations of one skin, or a blend of some; W = WINDOWS * WINDOWS."""

    gram: np.ndarray  # [W, F, F] mean products of features; 0 where unknown
    known: np.ndarray  # [W] float32 0..1: share of the window that was seen

    def energy(self) -> np.ndarray:
        """Mean square of each octave's band [W, OCTAVES]."""
        diagonal = np.diagonal(self.gram, axis1=1, axis2=2)
        out: np.ndarray = diagonal[:, 0::KINDS] + diagonal[:, 1::KINDS]
        return out


def windows_of(head: HeadModel, atlas: Atlas) -> Windows:
    """Which window of the chart each texel of an atlas of the skin lies in."""
    place = texel_chart(head, load_albedo(), atlas) * WINDOWS
    cell = np.floor(place).astype(int)
    inside = ((cell >= 0) & (cell < WINDOWS)).all(1)
    number = np.where(inside, cell[:, 1] * WINDOWS + cell[:, 0], -1)
    size = np.bincount(number[inside], minlength=WINDOWS**2)
    return Windows(atlas, place, number, size)


class Filters:
    """The linear part of the features: Gaussian bands and their derivatives, over what has weight.

    The adjoint is exact for what is nonzero only farther than REACH from the picture's border.
    """

    REACH = 4 * 0.7 * 2 ** (OCTAVES - 1) + 2  # texels of DENSITY that the widest blur reaches

    def __init__(self, weight: np.ndarray, size: int) -> None:
        """Prepare filters for pictures [H, W].

        Args:
            weight: [H, W] float32 0..1; size: texels on a side of the atlas they are cut from.
        """
        self.weight = weight
        scales = [2**octave * size / DENSITY for octave in range(OCTAVES)]
        self.sigmas = [max(0.7 * scale, 0.3) for scale in scales]
        self.reaches = [max(round(scale), 1) for scale in scales]
        masses = [cv2.GaussianBlur(weight, (0, 0), sigma) for sigma in self.sigmas]
        self.found = [mass > 1e-3 for mass in masses]
        self.masses = [np.maximum(mass, 1e-3) for mass in masses]

    def levels(self, luma: np.ndarray) -> list[np.ndarray]:
        """A log-luma [H, W], and ever more blurred: OCTAVES + 1 pictures."""
        weighted = luma * self.weight
        out = [luma]
        for sigma, found, mass in zip(self.sigmas, self.found, self.masses):
            blurred = cv2.GaussianBlur(weighted, (0, 0), sigma) / mass
            out.append(np.where(found, blurred, luma).astype(np.float32))
        return out

    def features(self, pyramid: list[np.ndarray]) -> np.ndarray:
        """Band and derivatives of each octave [3 * OCTAVES, H, W], of levels."""
        out = []
        for reach, fine, coarse in zip(self.reaches, pyramid, pyramid[1:]):
            out.append(fine - coarse)
            for axis in (1, 0):
                out.append((np.roll(fine, -reach, axis) - np.roll(fine, reach, axis)) / 2)
        return np.stack(out)

    def levels_adjoint(self, slopes: list[np.ndarray]) -> np.ndarray:
        """What slopes of the levels mean for the log-luma [H, W]."""
        out = slopes[0].copy()
        for sigma, found, mass, slope in zip(self.sigmas, self.found, self.masses, slopes[1:]):
            out += self.weight * cv2.GaussianBlur(found * slope / mass, (0, 0), sigma)
            out += np.where(found, 0, slope)
        return out


def correlations(albedo: np.ndarray, seen: np.ndarray, windows: Windows) -> Correlations:
    """Correlations of the part of an albedo that is seen.

    Args:
        albedo: [T, T, 3] linear; seen: [T, T] 0..1.
    """
    luma = np.log(np.maximum(albedo @ LUMA, DARKEST)).astype(np.float32)
    known = (seen > 0.9).astype(np.float32)
    reach = 2 * (int(2**OCTAVES * len(luma) / DENSITY) // 2) + 1
    sure = cv2.erode(known, np.ones((reach, reach), np.uint8)).reshape(-1)[windows.atlas.index]
    rows = np.flatnonzero((sure > 0) & (windows.number >= 0))
    order = rows[np.argsort(windows.number[rows], kind="stable")]
    filters = Filters(known, len(luma))
    linear = filters.features(filters.levels(luma)).reshape(3 * OCTAVES, -1)
    features = split_by_sign(linear[:, windows.atlas.index[order]])
    count = np.bincount(windows.number[order], minlength=WINDOWS**2)
    ends = np.concatenate([[0], np.cumsum(count)])
    gram = np.zeros((WINDOWS**2, FEATURES, FEATURES), np.float32)
    for window in np.flatnonzero(count > 0):
        part = features[:, ends[window] : ends[window + 1]]
        gram[window] = part @ part.T / count[window]
    share = (count / np.maximum(windows.size, 1)).astype(np.float32)
    return Correlations(gram, share * (share > LEAST))


def split_by_sign(linear: np.ndarray) -> np.ndarray:
    """What is lighter and what is darker of each of the linear features [n, N]: [2 n, N]."""
    out = np.empty((2 * len(linear),) + linear.shape[1:], linear.dtype)
    np.maximum(linear, 0, out=out[0::2])
    np.maximum(-linear, 0, out=out[1::2])
    return out
