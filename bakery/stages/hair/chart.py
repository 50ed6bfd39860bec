"""A chart around the head: half a ball over the skull, and a tube that hangs from its rim.

Every place around the head has an azimuth and a row, and a distance from the chart's axis. Hair is a
distance per cell: however long it hangs, it is seen from within only once.
"""

from dataclasses import dataclass

import cv2
import numpy as np

from bakery.geometry.fill import diffuse
from bakery.geometry.sample import bilinear
from bakery.heads.base import HeadModel

COLUMNS = 96  # around
DOME = 32  # rows from the top of the ball to its equator
STEP = 5.0  # mm between rows of the tube
TUBE = 62  # rows of it
ROWS = DOME + TUBE
EQUATOR = 22.0  # mm, height of the ball's middle in head space
EAR = 46.0  # mm, wider than an ear from front to back
WIDEST = 125.0  # mm from the axis, beyond which nothing is skull


@dataclass(frozen=True, eq=False)
class Chart:
    """Where the chart of a head lies, and how far its skin is."""

    center: np.ndarray  # [3] mm, middle of the ball
    skull: np.ndarray  # [ROWS, COLUMNS] mm from the axis to the skin, without ears
    ears: np.ndarray  # the same with them

    def cell(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Rows and columns of points [..., 3] ([..., 2] as `bilinear` has them: x, y), and distances."""
        relative = points - self.center
        x, y, z = relative[..., 0], relative[..., 1], relative[..., 2]
        flat = np.hypot(x, z)
        column = np.arctan2(x, z) / (2 * np.pi) + 0.5
        down = np.arctan2(flat, np.maximum(y, 0)) / (np.pi / 2) * DOME
        row = np.where(y > 0, down, DOME - y / STEP)
        distance = np.where(y > 0, np.hypot(flat, y), flat)
        return np.stack([column * COLUMNS, row], -1), distance

    def step(self, cells: np.ndarray, points: np.ndarray, way: np.ndarray) -> np.ndarray:
        """By how many cells [..., 2] a way [..., 3] mm leads on from points [..., 3] in cells [..., 2]."""
        ahead, _ = self.cell(points + way)
        step = ahead - cells
        step[..., 0] = (step[..., 0] + COLUMNS / 2) % COLUMNS - COLUMNS / 2  # the short way around
        return step

    def take(self, grid: np.ndarray, cells: np.ndarray) -> np.ndarray:
        """Values of a grid [ROWS, COLUMNS(, C)], or a finer one, at its cells [..., 2]; columns go around."""
        wide = ((0, 0), (1, 1)) + ((0, 0),) * (grid.ndim - 2)
        padded = np.pad(np.asarray(grid, np.float32), wide, "wrap")
        found: np.ndarray = bilinear(padded, cells + [1.0, 0.0])
        return found

    def mirrored(self, points: np.ndarray) -> np.ndarray:
        """Points [..., 3] on the other side of the head."""
        return points * [-1.0, 1, 1] + [2 * self.center[0], 0, 0]

    def place(self, cells: np.ndarray, distance: np.ndarray) -> np.ndarray:
        """Points [..., 3] of cells [..., 2] at distances [...] mm."""
        around = (cells[..., 0] / COLUMNS - 0.5) * 2 * np.pi
        row = cells[..., 1]
        polar = np.minimum(row / DOME, 1) * np.pi / 2
        flat = np.sin(polar) * distance
        up = np.where(row < DOME, np.cos(polar) * distance, (DOME - row) * STEP)
        return self.center + np.stack([np.sin(around) * flat, up, np.cos(around) * flat], -1)


def grid(finer: int = 1) -> np.ndarray:
    """The middles of all cells, each cut into so many either way: [ROWS * finer, COLUMNS * finer, 2]."""
    column, row = np.meshgrid(np.arange(COLUMNS * finer) + 0.5, np.arange(ROWS * finer) + 0.5)
    return np.stack([column, row], -1) / finer


def gathered(cells: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Sums [ROWS, COLUMNS] of values [n] in each cell that cells [n, 2] lie in, or nearest to."""
    column, row = (np.clip(cells[:, k].astype(int), 0, n - 1) for k, n in ((0, COLUMNS), (1, ROWS)))
    return np.bincount(row * COLUMNS + column, values, ROWS * COLUMNS).reshape(ROWS, COLUMNS)


def mirrored(cells: np.ndarray) -> np.ndarray:
    """Cells [..., 2] on the other side of the head."""
    return cells * [-1.0, 1] + [COLUMNS, 0]


def azimuth() -> np.ndarray:
    """Radians of each column [COLUMNS]: 0 before the face, rising to the subject's left."""
    return (np.arange(COLUMNS) + 0.5) / COLUMNS * 2 * np.pi - np.pi


def around() -> np.ndarray:
    """Share [ROWS, 1] of the full way around that each row's ring has: small at the pole."""
    return np.sin(np.minimum((np.arange(ROWS)[:, None] + 0.5) / DOME, 1) * np.pi / 2)


def smooth(values: np.ndarray, sigma: float) -> np.ndarray:
    """A grid [ROWS, COLUMNS(, C)] blurred by `sigma` mm, about the same at the pole as elsewhere."""
    shape = (-1,) + (1,) * (values.ndim - 1)
    turn = sigma / (100.0 * around()).reshape(shape)
    waves = np.arange(COLUMNS // 2 + 1).reshape((1, -1) + (1,) * (values.ndim - 2))
    spectrum = np.fft.rfft(values, axis=1) * np.exp(-0.5 * (waves * turn) ** 2)
    rounded = np.fft.irfft(spectrum, COLUMNS, axis=1).reshape(ROWS, -1)
    size = 2 * int(np.ceil(3 * sigma / STEP)) + 1
    kernel = cv2.getGaussianKernel(size, max(sigma / STEP, 1e-3))
    one = np.ones(1)
    border = cv2.BORDER_REPLICATE
    blurred = cv2.sepFilter2D(rounded, cv2.CV_64F, one, kernel, borderType=border)
    return blurred.reshape(values.shape)


def distance_inside(mask: np.ndarray) -> np.ndarray:
    """Distance [ROWS, COLUMNS] mm within a mask of cells from its border, less than 0 outside."""
    wide = np.pad(mask, ((1, 0), (COLUMNS // 2, COLUMNS // 2)), "wrap").astype(np.uint8)
    wide[0] = wide[1].max()
    inner = cv2.distanceTransform(wide, cv2.DIST_L2, 3)
    outer = cv2.distanceTransform(1 - wide, cv2.DIST_L2, 3)
    away = (inner - outer)[1:, COLUMNS // 2 : -COLUMNS // 2]
    return np.clip(away, -1000.0, 1000.0) * STEP  # rows; none of it may be beside a mask


def make_chart(head: HeadModel, neutral: np.ndarray) -> Chart:
    """The chart of a neutral shape [V, 3] mm."""
    faces = head.faces[head.part_faces("skin")]
    upper = neutral[np.unique(faces)]
    upper = upper[upper[:, 1] > 15]
    center = np.array([upper[:, 0].mean(), EQUATOR, (upper[:, 2].min() + upper[:, 2].max()) / 2])
    chart = Chart(center, np.zeros((ROWS, COLUMNS)), np.zeros((ROWS, COLUMNS)))
    shares = np.array(
        [[1, 0, 0], [0.5, 0.5, 0], [1 / 3, 1 / 3, 1 / 3], [0, 0.5, 0.5], [0.5, 0, 0.5]]
    )
    points = np.einsum("sk,fkc->sfc", shares, neutral[faces]).reshape(-1, 3)
    cells, distance = chart.cell(points)
    row, column = (np.clip(cells[:, k].astype(int), 0, n - 1) for k, n in ((1, ROWS), (0, COLUMNS)))
    inside = (distance < WIDEST) & (cells[:, 1] < ROWS)
    far = np.zeros((ROWS, COLUMNS), np.float32)
    np.maximum.at(far, (row[inside], column[inside]), distance[inside].astype(np.float32))
    filled = np.where(far > 0, far, _filled(far))
    last = np.flatnonzero((far > 0).mean(1) > 0.5)[-1]  # below the neck's end it goes on straight
    filled[last + 1 :] = filled[max(last - 1, 0)]
    filled = np.maximum(smooth(filled, 3.0), 20)
    reach = int(EAR / 2 / (2 * np.pi * 80 / COLUMNS)) + 1
    kernel = np.ones((1, 2 * reach + 1), np.uint8)
    wrapped = np.pad(filled.astype(np.float32), ((0, 0), (3 * reach, 3 * reach)), "wrap")
    flat = cv2.morphologyEx(wrapped, cv2.MORPH_OPEN, kernel)[:, 3 * reach : -3 * reach]
    return Chart(center, smooth(flat, 5.0), np.maximum(filled, smooth(flat, 5.0)))


def _filled(far: np.ndarray) -> np.ndarray:
    wide = np.pad(far, ((0, 0), (COLUMNS // 2, COLUMNS // 2)), "wrap")
    known = (wide > 0).astype(np.float32)
    return diffuse(wide[..., None], known)[:, COLUMNS // 2 : -COLUMNS // 2, 0]
