"""A flat map of the mean head: a cylinder around it, unrolled, on which skin is designed.

Everything is placed by the 478 landmarks, so the same design fits every head model.
"""

from dataclasses import dataclass, field

import cv2
import numpy as np

from bakery import landmarks as marks
from bakery.geometry.sample import bilinear

RADIUS = 85.0  # mm, of the cylinder that the map is unrolled from

# Rings of the public face-mesh order, named for the subject's side.
BROW_UPPER = {"right": marks.BROW_RIGHT[:5], "left": marks.BROW_LEFT[:5]}  # outer to inner
BROW_LOWER = {"right": marks.BROW_RIGHT[:4:-1], "left": marks.BROW_LEFT[:4:-1]}
LID_UPPER = {"right": marks.LID_RIGHT_UPPER, "left": marks.LID_LEFT_UPPER}
LID_LOWER = {"right": marks.LID_RIGHT_LOWER, "left": marks.LID_LEFT_LOWER}
IRIS = {"right": (468, 469, 470, 471, 472), "left": (473, 474, 475, 476, 477)}
SIDES = ("right", "left")
SIGN = {"right": -1.0, "left": 1.0}


def smoothstep(low, high, x):
    """0 below `low`, 1 above `high`, smooth between (also for low > high)."""
    t = np.clip((np.asarray(x, np.float32) - low) / (high - low), 0, 1)
    return t * t * (3 - 2 * t)


@dataclass(frozen=True)
class Chart:
    """The unrolled cylinder of one head model."""

    axis: float  # z of the cylinder's axis, mm
    top: float  # y of row 0, mm
    width: int  # pixels
    height: int  # pixels
    density: float  # pixels a mm
    landmarks: np.ndarray  # [L, 3] mm on the mean head
    ear: np.ndarray  # [4] the left ear on the map: left, right, bottom, top, mm
    crown: float  # y of the top of the head, mm
    grids: dict = field(default_factory=dict, compare=False)

    def flat(self, points):
        """Mean-head points [..., 3] to map coordinates [..., 2]: mm along the cylinder, y mm."""
        angle = np.arctan2(points[..., 0], points[..., 2] - self.axis)
        return np.stack([angle * RADIUS, points[..., 1]], -1)

    def pixels(self, flat):
        """Map coordinates [..., 2] mm to pixels of the map [..., 2]."""
        return np.stack(
            [
                flat[..., 0] * self.density + self.width / 2,
                (self.top - flat[..., 1]) * self.density,
            ],
            -1,
        )

    def spot(self, index):
        """Map coordinates [2] mm (or [n, 2] for a sequence) of landmarks."""
        return self.flat(self.landmarks[np.asarray(index)])

    def grid(self):
        """Map coordinates of all pixels: x [W] and y [H] mm."""
        x = (np.arange(self.width) + 0.5 - self.width / 2) / self.density
        y = self.top - (np.arange(self.height) + 0.5) / self.density
        return x.astype(np.float32), y.astype(np.float32)

    def blank(self):
        return np.zeros((self.height, self.width), np.float32)

    def blur(self, picture, sigma):
        """Gaussian blur; sigma in mm (one, or x and y). Wide ones go by a smaller picture."""
        sx, sy = (np.broadcast_to(np.asarray(sigma, float), (2,)) * self.density).tolist()
        shrink = max(1, int(min(sx, sy) / 3))
        if shrink > 1:
            size = (max(2, self.width // shrink), max(2, self.height // shrink))
            small = cv2.resize(picture, size, interpolation=cv2.INTER_AREA)
            small = cv2.GaussianBlur(small, (0, 0), sx / shrink, None, sy / shrink)
            return cv2.resize(small, (self.width, self.height), interpolation=cv2.INTER_LINEAR)
        return cv2.GaussianBlur(picture, (0, 0), max(sx, 0.3), None, max(sy, 0.3))

    def blob(self, center, sigma):
        """A Gaussian spot of height 1 at map coordinates [2]; sigma mm (one, or x and y)."""
        x, y = self.grid()
        sx, sy = np.broadcast_to(np.asarray(sigma, float), (2,))
        return np.outer(
            np.exp(-0.5 * ((y - center[1]) / sy) ** 2), np.exp(-0.5 * ((x - center[0]) / sx) ** 2)
        ).astype(np.float32)

    def polygon(self, flat, edge=0.0):
        """Filled polygon [n, 2] mm, its edge softened by a blur of `edge` mm."""
        picture = self.blank()
        points = np.round((self.pixels(np.asarray(flat)) - 0.5) * 16).astype(np.int32)
        cv2.fillPoly(picture, [points], 1.0, cv2.LINE_AA, 4)
        return self.blur(picture, edge) if edge else picture

    def line(self, flat, width, closed=False):
        """Poly-line [n, 2] mm, `width` mm thick, drawn finely."""
        picture = self.blank()
        points = np.round((self.pixels(np.asarray(flat)) - 0.5) * 16).astype(np.int32)
        thick = max(1, int(round(width * self.density)))
        cv2.polylines(picture, [points], closed, 1.0, thick, cv2.LINE_AA, 4)
        return picture

    def sample(self, picture, points):
        """A map picture at mean-head points [N, 3]."""
        return bilinear(picture, self.pixels(self.flat(points)))


def chart_of(head, density=4.0):
    """The map of a head model; density in pixels a mm."""
    skin = head.mean[head.part_vertices("skin")]
    crown = skin[skin[:, 1] > 20]
    axis = float((crown[:, 2].min() + crown[:, 2].max()) / 2)
    side = skin[(skin[:, 1] > -70) & (skin[:, 1] < 40)]
    tip = side[side[:, 0].argmax()]
    above = skin[(skin[:, 1] > tip[1] + 22) & (skin[:, 1] < tip[1] + 45)]
    ear = side[(side[:, 0] > above[:, 0].max() + 2.5) & (side[:, 2] < axis + 25)]
    across = np.arctan2(ear[:, 0], ear[:, 2] - axis) * RADIUS
    box = np.array([across.min(), across.max(), ear[:, 1].min(), ear[:, 1].max()])
    top, bottom = float(skin[:, 1].max()) + 5, float(skin[:, 1].min()) - 5
    return Chart(
        axis=axis,
        top=top,
        width=int(2 * np.pi * RADIUS * density),
        height=int((top - bottom) * density),
        density=density,
        landmarks=head.landmarks(head.mean),
        ear=box,
        crown=top - 5,
    )
