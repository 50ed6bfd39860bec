"""Hairlines beside the face: on each side one smooth line from the forehead to the ear.

There a photo sees the skin at a slant: a pixel is a streak of it, an error of the fit is a centimetre, and
the arms of glasses lie over it. What it tells is ragged, with notches behind locks.
"""

from dataclasses import dataclass

import cv2
import numpy as np

from bakery.geometry.fill import normalized_blur, smoothstep
from bakery.geometry.sample import bilinear
from bakery.heads.base import HeadModel
from bakery.heads.scalp import ear_box, unrolled

CELL = 3.0  # mm
FIRST = 40.0  # mm across from the face's middle, from where on a hairline is looked for
BESIDE = 52.0, 68.0  # mm across, from which it is smoothed, not and wholly
EAR = 2.0, -6.0  # mm beyond the front of an ear, from which it is not, up to which wholly
PEAK = 115.0, 95.0  # mm up, the same: higher, the unrolled head is not true to scale
SIDEBURN = -38.0, -30.0  # mm from the top of an ear, the same
FIRM = 0.2, 0.45  # cosine to the camera up to which the line counts, and from which on the photo
LEAST = 0.06  # of a full weight, of what nobody sees
STEADY = 7  # rows of which the middle one counts: a notch or spike of 9 mm is none
SMOOTH = 2.0  # rows
# What grows above an ear, as the photo shows it edge on: mm beyond its front, from which on it does and
# wholly, from which on no more and up to which wholly; mm above its top, the same.
BEHIND, BACK = (-8.0, 0.0), (60.0, 45.0)
RISES, OVER = (-4.0, 0.0), (35.0, 20.0)
# Shares of an ear's height, from the lobe up, at which `sideburns` are told, and mm before the ear where
# they begin at least; above it they go on in the hairline.
HEIGHTS = np.array([0.46, 0.54, 0.62, 0.70, 0.78, 0.85, 0.93, 1.01, 1.09, 1.17, 1.25, 1.33])
BEFORE = np.array([18.0, 18.0, 18.0, 18.0, 18.0, 18.0, 18.0, 18.0, 16.0, 13.0, 10.0, 6.0])
FULL = -2  # of HEIGHTS: what is told there goes for all above the ear
SOFT = 10.0  # mm on both sides of the line over which hair begins


@dataclass(frozen=True)
class Temples:
    """Places on the skin of a head, and where its ears are."""

    flat: np.ndarray  # [..., 2] mm on the unrolled head (`heads.scalp.unrolled`)
    left: np.ndarray  # [...] bool, on the subject's left
    front: float  # mm across, where ears begin
    bottom: float  # mm up, where they begin
    top: float  # mm up, where they end

    def smooth(self, hair: np.ndarray, cosine: np.ndarray, burns: np.ndarray) -> np.ndarray:
        """Where hair grows [...] 0..1, with one smooth line beside the face on each side.

        Above the ears all behind the first hair is hair; beside them, what joins the ear, and
        sideburns.

        Args:
            hair: [...] 0..1, as it was told.
            cosine: [...] between the skin and the line of sight, 0 where nothing is told.
            burns: [2, 12] 0..1 of `sideburns` (left, right).
        """
        values, flat = hair.ravel(), self.flat.reshape(-1, 2)
        weight = np.maximum(cosine.ravel(), 0) + LEAST
        lowest = self.top + SIDEBURN[0]
        wide, tall = (int(size / CELL) + 1 for size in (self.front - FIRST, PEAK[0] - lowest))
        cells = (flat - [FIRST, lowest]) / CELL
        inside = ((cells >= 0) & (cells < [wide, tall])).all(1)
        index = cells[:, 1].astype(int) * wide + cells[:, 0].astype(int)
        rows = lowest + (np.arange(tall) + 0.5) * CELL
        share = self._share(flat, cosine.ravel())
        out = np.array(values, np.float32)
        for side, burn in zip((self.left.ravel(), ~self.left.ravel()), burns):
            mine = np.flatnonzero(inside & side)
            total, known = (
                np.bincount(index[mine], each, wide * tall).reshape(tall, wide).astype(np.float32)
                for each in (weight[mine] * values[mine], weight[mine])
            )
            grown = normalized_blur(total / np.maximum(known, 1e-6), known, 1.0)
            begins = _line(grown, rows > self.top, self._columns(burn, rows))
            mine = np.flatnonzero((share > 0) & side)
            row = np.stack([np.zeros(len(mine)), cells[mine, 1]], -1)
            beyond = CELL * (cells[mine, 0] - bilinear(begins[:, None], row))
            out[mine] += share[mine] * (smoothstep(-SOFT, SOFT, beyond) - out[mine])
        return out.reshape(hair.shape)

    def above_ears(self, burns: np.ndarray) -> np.ndarray:
        """Where hair grows above the ears [...] 0..1, since the photo shows it there edge on.

        Args:
            burns: [2, 12] 0..1 of `sideburns` (left, right).
        """
        across, up = self.flat[..., 0] - self.front, self.flat[..., 1] - self.top
        region = smoothstep(*BEHIND, across) * smoothstep(*BACK, across)
        region = region * smoothstep(*RISES, up) * smoothstep(*OVER, up)
        found: np.ndarray = region * np.where(self.left, burns[0, FULL], burns[1, FULL])
        return found.astype(np.float32)

    def _columns(self, burn, rows):
        """Columns [rows] at which a sideburn [12] 0..1 begins; infinite where there is none."""
        height = (rows - self.bottom) / (self.top - self.bottom)
        column = (self.front - FIRST - np.interp(height, HEIGHTS, BEFORE)) / CELL
        there = np.interp(height, HEIGHTS, burn, left=0, right=0) > 0.5
        return np.where(there, column, np.inf)

    def _share(self, flat, cosine):
        """How far the line counts at places [n]."""
        across, up = flat.T
        share = smoothstep(*BESIDE, across) * smoothstep(*(self.front + np.array(EAR)), across)
        share = share * smoothstep(*PEAK, up) * smoothstep(*(self.top + np.array(SIDEBURN)), up)
        return share * (1 - smoothstep(*FIRM, cosine))


def temples_of(head: HeadModel, points: np.ndarray) -> Temples:
    """The temples of a head at points [..., 3] mm on its skin."""
    front, _, bottom, top = ear_box(head)
    return Temples(
        unrolled(head)(points), points[..., 0] > 0, float(front), float(bottom), float(top)
    )


def _line(hair, above, burn):
    """Columns [rows] at which hair begins; the number of columns where there is none.

    Args:
        hair: [rows, columns] 0..1, from the face to the ear.
        above: [rows] bool, above the ear.
        burn: [rows] columns at which a sideburn begins, infinite where there is none.
    """
    there = hair > 0.5
    joined = np.logical_and.accumulate(there[:, ::-1], 1)[:, ::-1]
    solid = np.where(above[:, None], there, joined)
    begins = np.where(solid.any(1), solid.argmax(1), hair.shape[1]).astype(np.float32)
    padded = np.pad(begins, STEADY // 2, "edge")
    steady = np.median(np.lib.stride_tricks.sliding_window_view(padded, STEADY), 1)
    steady = np.minimum(steady, burn)
    line: np.ndarray = cv2.GaussianBlur(
        steady[:, None], (1, 0), 1e-3, sigmaY=SMOOTH, borderType=cv2.BORDER_REPLICATE
    )[:, 0]
    return line
