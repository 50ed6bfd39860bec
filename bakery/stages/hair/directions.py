"""Which way hair runs: as the photo shows it, and from the crown down where it shows nothing."""

import cv2
import numpy as np

from bakery.geometry.color import LUMA
from bakery.geometry.fill import diffuse, smoothstep
from bakery.geometry.sample import bilinear
from bakery.stages.hair import chart as charts
from bakery.stages.hair.chart import COLUMNS
from bakery.stages.hair.portrait import Portrait
from bakery.stages.hair.shell import Shell

TURNS = 16  # directions that are told apart
WAVE = 3.2  # mm, of the filters: wisps, not single hairs
LONG = 6.0  # mm, length of the filters
WIDE = 4.0  # mm, over which answers are gathered
PRIOR = 0.02  # weight of hanging down, beside what the photo says


def photographed(portrait: Portrait) -> tuple[np.ndarray, np.ndarray]:
    """The direction of hair in each pixel.

    Returns:
        [H, W] radians 0..pi, anticlockwise from the right as y goes up, and [H, W] 0..1 how sure.

    References:
        Paris et al., "Capture of hair geometry from multiple images", SIGGRAPH 2004: oriented filters.
    """
    scale = portrait.scale
    gray = np.log(np.maximum(portrait.color @ LUMA.astype(np.float32), 1e-3)).astype(np.float32)
    hair = portrait.hair
    wide = max(2 * WAVE * scale, 1)
    mass = np.maximum(cv2.GaussianBlur(hair, (0, 0), wide), 1e-3)
    gray = (gray - cv2.GaussianBlur(gray * hair, (0, 0), wide) / mass) * hair
    spread = np.sqrt(cv2.GaussianBlur(gray**2, (0, 0), wide) / mass) + 0.02
    gray = gray / spread
    half = int(np.ceil(1.5 * LONG * scale))
    y, x = np.mgrid[-half : half + 1, -half : half + 1].astype(np.float32)
    total = np.zeros(gray.shape + (2,), np.float32)
    power = np.zeros(gray.shape, np.float32)
    for k in range(TURNS):
        turn = k * np.pi / TURNS
        along, across = x * np.cos(turn) - y * np.sin(turn), x * np.sin(turn) + y * np.cos(turn)
        shape = np.exp(
            -0.5 * ((along / (LONG * scale / 2)) ** 2 + (across / (WAVE * scale / 3)) ** 2)
        )
        answer = 0.0
        for phase in (0, np.pi / 2):
            kernel = shape * np.cos(across * 2 * np.pi / (WAVE * scale) + phase)
            kernel -= shape * (kernel.sum() / shape.sum())
            kernel /= np.abs(kernel).sum()
            answer = answer + cv2.filter2D(gray, cv2.CV_32F, kernel) ** 2
        total += answer[..., None] * np.array([np.cos(2 * turn), np.sin(2 * turn)], np.float32)
        power += answer
    total, power = (cv2.GaussianBlur(p * hair[(...,) + (None,) * (p.ndim - 2)], (0, 0), WIDE * scale)
                    for p in (total, power))  # fmt: skip
    strength = np.hypot(total[..., 0], total[..., 1])
    coherence = strength / np.maximum(power, 1e-9)
    angle = 0.5 * np.arctan2(total[..., 1], total[..., 0]) % np.pi
    return angle.astype(np.float32), (coherence * (hair > 0.3)).astype(np.float32)


def frame(shell: Shell) -> np.ndarray:
    """Unit vectors of each cell: [ROWS, COLUMNS, 3 (to the left, down, outward), 3]."""
    points = shell.surface(charts.grid(), 1.0)
    left = np.roll(points, -1, 1) - np.roll(points, 1, 1)
    down = np.gradient(points, axis=0)
    down = down / np.maximum(np.linalg.norm(down, axis=-1, keepdims=True), 1e-6)
    left = left - (left * down).sum(-1, keepdims=True) * down
    left = left / np.maximum(np.linalg.norm(left, axis=-1, keepdims=True), 1e-6)
    return np.stack([left, down, -np.cross(left, down)], 2)


def flow(
    portrait: Portrait, shell: Shell, angle: np.ndarray, sure: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Where hair runs on the shell.

    Args:
        angle, sure: [H, W], of `photographed`.

    Returns:
        [ROWS, COLUMNS, 3] unit vectors from root to tip, and [ROWS, COLUMNS] 0..1 how sure.
    """
    cells = charts.grid()
    points = shell.surface(cells, 1.0)
    axes = frame(shell)
    pixels, _ = portrait.pixels(points)
    ahead = [portrait.pixels(points + axes[:, :, k])[0] - pixels for k in (0, 1)]
    double = np.stack([np.cos(2 * angle), np.sin(2 * angle)], -1) * sure[..., None]
    double = bilinear(double.astype(np.float32), pixels)
    turn = 0.5 * np.arctan2(double[..., 1], double[..., 0])
    wanted = np.stack([np.cos(turn), -np.sin(turn)], -1)  # pixels: y goes down
    matrix = np.stack(ahead, -1)  # a mm to the left, a mm down -> pixels
    size = np.linalg.det(matrix)
    safe = np.where(np.abs(size) > 1e-3, size, 1)
    left = (wanted[..., 0] * matrix[..., 1, 1] - wanted[..., 1] * matrix[..., 0, 1]) / safe
    down = (wanted[..., 1] * matrix[..., 0, 0] - wanted[..., 0] * matrix[..., 1, 0]) / safe
    square = smoothstep(0.15, 0.5, np.abs(size) / portrait.scale**2)  # not seen at a slant
    weight = np.hypot(double[..., 0], double[..., 1]) * square * shell.seen * shell.there
    length = np.maximum(np.hypot(left, down), 1e-6)
    seen = left[..., None] / length[..., None] * axes[:, :, 0]
    seen = seen + down[..., None] / length[..., None] * axes[:, :, 1]
    usual = _usual(shell, axes)
    seen = seen * np.where((seen * usual).sum(-1, keepdims=True) < 0, -1, 1)
    # Carried around the head as shares of left, down: what one side shows the back goes on with.
    shares = np.stack([(seen * axes[:, :, k]).sum(-1) for k in (0, 1)], -1)
    normal = np.stack([(usual * axes[:, :, k]).sum(-1) for k in (0, 1)], -1)
    own = np.clip(weight * 2, 0, 1)
    other = own[:, ::-1] * (1 - own)  # a side that is hardly seen is combed as the other one
    told = own + other
    off = own[..., None] * (shares - normal)
    off += other[..., None] * ((shares - normal)[:, ::-1] * [-1.0, 1])
    off /= np.maximum(told, 1e-6)[..., None]
    wide = COLUMNS // 2
    padded = np.pad(off, ((0, 0), (wide, wide), (0, 0)), "wrap").astype(np.float32)
    amount = np.pad(told, ((0, 0), (wide, wide)), "wrap").astype(np.float32)
    on = diffuse(padded, amount)[:, wide:-wide]
    near = smoothstep(0.0, 0.15, charts.smooth(told, 20.0))[..., None]
    both = charts.smooth(normal + on * near, 4.0)
    out = both[..., :1] * axes[:, :, 0] + both[..., 1:] * axes[:, :, 1]
    out = out / np.maximum(np.linalg.norm(out, axis=-1, keepdims=True), 1e-6)
    return out, own


def _usual(shell: Shell, axes: np.ndarray) -> np.ndarray:
    """Directions [ROWS, COLUMNS, 3] of hair that nobody has seen: from the crown, and down."""
    points = shell.surface(charts.grid(), 1.0)
    center = shell.chart.center
    crown = center + np.array([0.0, 78.0, -45.0])
    away = points - crown
    away = away / np.maximum(np.linalg.norm(away, axis=-1, keepdims=True), 1e-6)
    lower = smoothstep(20, 80, crown[1] - points[..., 1])[..., None]
    want = away * (1 - lower) + np.array([0.0, -1.0, 0.0]) * (0.3 + lower)
    outward = axes[:, :, 2]
    want = want - (want * outward).sum(-1, keepdims=True) * outward
    return want / np.maximum(np.linalg.norm(want, axis=-1, keepdims=True), 1e-6)
