"""Lines of age and expression as a height map on the chart."""

import cv2
import numpy as np

from bakery.geometry.curve import spline
from bakery.synth.chart import LID_LOWER, SIDES, SIGN


class Relief:
    """Collects strokes of given depth and width into one height map (mm, + outward)."""

    def __init__(self, chart, rng):
        self.chart, self.rng = chart, rng
        self.layers = {}  # blur width -> picture of summed depth

    def stroke(self, flat, depth, width, wander=0.8):
        """A groove along map points [n, 2] mm: depth and width in mm, tapering, slightly irregular."""
        if depth <= 0:
            return
        count = 60
        path = spline(flat, count)
        noise = np.convolve(self.rng.normal(size=count + 14), np.hanning(15) / 3, "valid")[:count]
        tangent = np.gradient(path, axis=0)
        tangent /= np.linalg.norm(tangent, axis=1, keepdims=True) + 1e-9
        path = path + np.stack([-tangent[:, 1], tangent[:, 0]], 1) * noise[:, None] * wander
        t = np.linspace(0, 1, count)
        fade = np.clip(np.sin(np.pi * np.clip(t * 0.96 + 0.02, 0, 1)), 0, 1) ** 0.7
        fade *= np.clip(1 + 0.35 * np.roll(noise, 20), 0.3, 1.5)
        layer = self.layers.setdefault(round(width, 1), self.chart.blank())
        points = np.round((self.chart.pixels(path) - 0.5) * 16).astype(np.int32)
        for a, b, strength in zip(points[:-1], points[1:], fade * depth):
            cv2.line(layer, a.tolist(), b.tolist(), float(strength), 1, cv2.LINE_AA, 4)

    def height(self):
        """The height map [H, W] mm: each groove a valley between low shoulders."""
        total = self.chart.blank()
        for width, layer in self.layers.items():
            sigma = width * 0.45
            sharp = self.chart.blur(layer, sigma) * sigma * self.chart.density * 2.5
            broad = self.chart.blur(layer, 2.2 * sigma) * 2.2 * sigma * self.chart.density * 2.5
            total += -1.25 * sharp + 0.42 * broad
        return total


def age_lines(chart, rng, age, smile=0.0, brow_raise=0.0, frown=0.0):
    """Height map [H, W] mm of the lines that a face of this age and expression shows.

    Args:
        age: years.
        smile, brow_raise, frown: 0..1, deepen crow's feet and nasolabial folds, forehead lines,
            lines between the brows.
    """
    old = 1.25 * float(np.clip((age - 25) / 50, 0, 1.15))
    relief = Relief(chart, rng)
    spot = chart.spot
    upper = (spot(107)[1] + spot(336)[1]) / 2
    hair = spot(10)[1] + 4
    rows = 5
    for k in range(rows):
        y = upper + 6 + (hair - upper - 12) * (k + 0.5 + rng.uniform(-0.2, 0.2)) / rows
        half = rng.uniform(26, 40) * (1 - 0.1 * abs(k - 2))
        shift = rng.uniform(-6, 6)
        x = np.linspace(-half, half, 7) + shift
        wave = 2.5 * np.cos(x / 15 + rng.uniform(-0.5, 0.5)) + rng.normal(size=7) * 0.9
        depth = (0.30 * old**1.4 + 0.5 * brow_raise * (0.4 + old)) * rng.uniform(0.4, 1)
        relief.stroke(np.stack([x, y - 0.004 * x * x + wave], 1), depth, rng.uniform(1.4, 2.2))
    for side in SIDES:
        s = SIGN[side]
        left = side == "left"
        inner = spot(336 if left else 107)
        foot = [s * rng.uniform(5.5, 7.5), inner[1] - 9]
        tip = [s * rng.uniform(6, 8.5), inner[1] + rng.uniform(3, 8)]
        middle = [s * rng.uniform(6, 7), inner[1] - 3]
        relief.stroke([foot, middle, tip], 0.34 * old**1.3 + 0.6 * frown * (0.3 + old), 1.8)

        outer = spot(263 if left else 33)
        for k in range(5):
            angle = np.radians(28 - 19 * k + rng.uniform(-5, 5))
            start = outer + [s * rng.uniform(5, 8), 3.5 - 2.6 * k]
            length = rng.uniform(9, 17)
            reach = start + length * np.array([s * np.cos(angle), np.sin(angle)])
            bend = (start + reach) / 2 + [0, rng.uniform(0.3, 1.2) * (1 if k < 2 else -1)]
            depth = (0.28 * old**1.3 + 0.30 * smile * (0.25 + old)) * rng.uniform(0.5, 1)
            relief.stroke([start, bend, reach], depth, 1.3, 0.4)

        lid = spot(LID_LOWER[side])
        center = lid.mean(0)
        for k, drop in enumerate((4.2, 7.2, 11.5)):
            depth = (0.10, 0.17, 0.24)[k] * (0.25 + old) * rng.uniform(0.6, 1.1)
            arc = lid + (lid - center) * [0.06 * k, 0.12 * k]
            path = arc[[7, 5, 3, 1]] + [[0, -drop * 0.9], [0, -drop], [0, -drop], [0, -drop * 0.75]]
            relief.stroke(path, depth + 0.1 * smile * (k < 2), 1.3 + 0.6 * k, 0.5)

        wing, corner = spot(278 if left else 48), spot(291 if left else 61)
        fold = [
            wing + [s * 1.5, 5],
            wing + [s * 5.5, -1],
            wing * 0.45 + corner * 0.55 + [s * 9.5, 0],
            corner + [s * 8.5, 1],
            corner + [s * 8, -9],
        ]
        relief.stroke(fold, 0.26 + 0.42 * old + 0.7 * smile, 4.6, 0.9)
        marionette = [corner + [s * 3, -3], corner + [s * 5, -9], corner + [s * 6.5, -20]]
        relief.stroke(marionette, 0.34 * old**1.6, 3.4, 0.9)
        for _ in range(int(9 * old)):
            x = rng.uniform(0.1, 0.9) * corner[0]
            top = spot(0)[1] + rng.uniform(3, 7)
            path = [[x, top], [x * 0.97, top - 3], [x * 0.95, spot(0)[1] + rng.uniform(-2, 1)]]
            relief.stroke(path, 0.12 * old**2, 1.0, 0.2)
    chin = spot(152)[1]
    for drop in (24, 46):
        y = chin - drop + rng.uniform(-5, 5)
        x = np.linspace(-75, 75, 7)
        relief.stroke(np.stack([x, y + 0.0012 * x * x], 1), 0.12 + 0.5 * old**1.5, 2.4)
    return relief.height()
