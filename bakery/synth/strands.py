"""Hair as many thin lines: how they are shaded, shadowed and drawn."""

from dataclasses import dataclass

import cv2
import numba
import numpy as np

from bakery.synth.light import shine_on


@dataclass(frozen=True)
class Strands:
    """Lines of one kind of hair."""

    points: np.ndarray  # [S, K, 3] float32 mm, root first
    width: np.ndarray  # [S] mm at the root
    color: np.ndarray  # [S, 3] linear reflectance
    normals: np.ndarray  # [S, 3] of the skin at the root
    gloss: float = 1.0  # strength of the highlight
    opacity: float = 1.0
    kind: str = "hair"  # "hair", "brow", "lash" or "beard"
    taper: float = 0.6  # share of the width lost at the tip


class Volume:
    """How densely hair fills space, for soft shadows."""

    def __init__(self, sets, cell=4.0):
        points = np.concatenate([s.points.reshape(-1, 3) for s in sets])
        area = np.concatenate(
            [
                np.repeat(
                    s.width * np.linalg.norm(np.diff(s.points, axis=1), axis=2).sum(1),
                    s.points.shape[1],
                )
                / s.points.shape[1]
                for s in sets
            ]
        )
        self.cell = cell
        self.low = points.min(0) - 3 * cell
        self.shape = tuple(np.ceil((points.max(0) - self.low) / cell).astype(int) + 3)
        index = np.floor((points - self.low) / cell).astype(int)
        flat = np.ravel_multi_index(tuple(index.T), self.shape)
        grid = np.bincount(flat, area, int(np.prod(self.shape))).reshape(self.shape) / cell**3
        for axis in range(3):
            moved = np.ascontiguousarray(np.moveaxis(grid, axis, 0).reshape(self.shape[axis], -1))
            moved = cv2.GaussianBlur(moved, (1, 5), 0.1, None, 0.9)
            rest = [n for k, n in enumerate(self.shape) if k != axis]
            grid = np.moveaxis(moved.reshape([self.shape[axis], *rest]), 0, axis)
        self.grid = np.ascontiguousarray(grid, np.float32)

    def thickness(self, points, toward, start, reach):
        """Optical thickness [N] met from points [N, 3] along `toward` ([3] or [N, 3]).

        Args:
            start: mm left out at the beginning.
            reach: mm walked.
        """
        points = np.ascontiguousarray((points - self.low) / self.cell - 0.5, np.float32)
        toward = np.broadcast_to(np.asarray(toward, np.float32), points.shape)
        steps = max(2, int(np.ceil(reach / self.cell)))
        out = np.zeros(len(points), np.float32)
        _march(
            self.grid,
            points,
            np.ascontiguousarray(toward),
            np.float32(start / self.cell),
            steps,
            out,
        )
        return out * self.cell


@numba.njit(cache=True, nogil=True, fastmath=True)
def _march(grid, points, toward, start, steps, out):
    nx, ny, nz = grid.shape
    for i in range(points.shape[0]):
        total = np.float32(0)
        for k in range(steps):
            t = start + np.float32(k)
            x = points[i, 0] + toward[i, 0] * t
            y = points[i, 1] + toward[i, 1] * t
            z = points[i, 2] + toward[i, 2] * t
            ix, iy, iz = int(np.floor(x)), int(np.floor(y)), int(np.floor(z))
            if ix < 0 or iy < 0 or iz < 0 or ix >= nx - 1 or iy >= ny - 1 or iz >= nz - 1:
                continue
            fx, fy, fz = x - ix, y - iy, z - iz
            a = grid[ix, iy, iz] * (1 - fz) + grid[ix, iy, iz + 1] * fz
            b = grid[ix, iy + 1, iz] * (1 - fz) + grid[ix, iy + 1, iz + 1] * fz
            c = grid[ix + 1, iy, iz] * (1 - fz) + grid[ix + 1, iy, iz + 1] * fz
            d = grid[ix + 1, iy + 1, iz] * (1 - fz) + grid[ix + 1, iy + 1, iz + 1] * fz
            total += (a * (1 - fy) + b * fy) * (1 - fx) + (c * (1 - fy) + d * fy) * fx
        out[i] = total


def shade_strands(strands, environment, volume, ambient_scale=1.0):
    """Colour [S, K, 3] linear of strands in camera space.

    Two highlights, shifted toward root and tip, and diffuse light that turns with the hair.

    References:
        Kajiya and Kay, "Rendering fur with three dimensional textures", SIGGRAPH 1989.
        Marschner et al., "Light scattering from human hair fibers", SIGGRAPH 2003.
    """
    points = strands.points
    count, knots, _ = points.shape
    tangent = np.gradient(points, axis=1)
    tangent /= np.linalg.norm(tangent, axis=2, keepdims=True) + 1e-6
    view = -points / np.linalg.norm(points, axis=2, keepdims=True)
    color = strands.color[:, None]
    luminance = color.mean(-1, keepdims=True)
    flat = points.reshape(-1, 3)
    outward = np.repeat(strands.normals, knots, 0)
    wisp = 1.0 if strands.kind == "hair" else 0.35  # short hairs hardly shade each other
    density = 0.20 * (1 - 0.55 * np.sqrt(luminance.clip(0, 1))).reshape(count, 1) * wisp
    thick = volume.thickness(flat, outward, 2.0, 24.0).reshape(count, knots)
    sky = 0.12 + 0.88 * np.exp(-1.1 * density * thick)
    irradiance = shine_on(outward, environment.irradiance_ambient())
    irradiance = irradiance.reshape(count, knots, 3) * sky[..., None] * ambient_scale
    out = (color * 0.9 + 0.022 * strands.gloss) * irradiance
    for lamp in environment.lamps:
        thick = volume.thickness(flat, lamp.direction, 2.5, 60.0).reshape(count, knots)
        lit = np.exp(-density * thick)[..., None] * lamp.color
        side = outward @ lamp.direction
        lit = lit * np.clip(0.75 + side, 0.0, 1).reshape(count, knots, 1)
        along = tangent @ lamp.direction
        across = np.sqrt(np.clip(1 - along**2, 0, 1))
        seen = (tangent * view).sum(-1)
        across_view = np.sqrt(np.clip(1 - seen**2, 0, 1))
        half = np.clip(across * across_view - along * seen, -1, 1)
        shifted = np.clip(half * np.cos(0.10) - 0.0, 0, 1)
        first = shifted ** (70 / (1 + lamp.radius / 8)) * 0.10
        second = np.clip(half, 0, 1) ** 11
        glow = color**0.6 * 0.30 * second[..., None]
        out = out + lit * (
            color * 0.85 * across[..., None] + strands.gloss * (first[..., None] + glow)
        )
    return out.astype(np.float32)


@numba.njit(cache=True, nogil=True, fastmath=True)
def _draw(order, pixels, depth, width, opacity, color, knots, wall, image, coverage, bias):
    rows, columns = coverage.shape
    for n in range(order.shape[0]):
        s = order[n] // (knots - 1)
        a = s * knots + order[n] % (knots - 1)
        b = a + 1
        ax, ay, bx, by = pixels[a, 0], pixels[a, 1], pixels[b, 0], pixels[b, 1]
        dx, dy = bx - ax, by - ay
        length = dx * dx + dy * dy
        if length < 1e-6:
            continue
        reach = max(width[a], width[b]) * 0.5 + 1
        left = max(0, int(min(ax, bx) - reach))
        right = min(columns - 1, int(max(ax, bx) + reach))
        top = max(0, int(min(ay, by) - reach))
        bottom = min(rows - 1, int(max(ay, by) + reach))
        steep = abs(dy) > abs(dx)
        first, last = (top, bottom) if steep else (left, right)
        low, high = (left, right) if steep else (top, bottom)
        for i in range(first, last + 1):
            # walk the long axis and visit only the few pixels across the line
            along = (i + 0.5 - ay) / dy if steep else (i + 0.5 - ax) / dx
            if along < -0.5 or along > 1.5:
                middle_low, middle_high = low, high
            mid = ax + along * dx if steep else ay + along * dy
            span = reach * 1.5
            middle_low, middle_high = max(low, int(mid - span)), min(high, int(mid + span))
            for j in range(middle_low, middle_high + 1):
                x, y = (j, i) if steep else (i, j)
                px, py = x + 0.5 - ax, y + 0.5 - ay
                t = (px * dx + py * dy) / length
                if t < 0 or t >= 1:
                    continue
                away = abs(px * dy - py * dx) / np.sqrt(length)
                w = width[a] + (width[b] - width[a]) * t
                thick = max(w, 1.0)
                amount = min(1.0, thick * 0.5 + 0.5 - away)
                if amount <= 0:
                    continue
                z = depth[a] + (depth[b] - depth[a]) * t
                if z > wall[y, x] + bias:
                    continue
                amount *= (opacity[a] + (opacity[b] - opacity[a]) * t) * w / thick
                keep = 1 - amount
                for c in range(3):
                    image[y, x, c] = image[y, x, c] * keep + amount * (
                        color[a, c] + (color[b, c] - color[a, c]) * t
                    )
                coverage[y, x] = coverage[y, x] * keep + amount


def draw_strands(sets, colors, camera, wall, image, coverage, bias=1.5):
    """Draw strands, far ones first, into a picture.

    Args:
        sets: Strands in camera space.
        colors: for each set [S, K, 3] linear.
        camera: intrinsics in pixels of the picture.
        wall: [H, W] mm depth of what hides hair.
        image: [H, W, 3] float32 linear, painted over.
        coverage: [H, W] float32, gains the share of each pixel that hair covers.
        bias: mm that hair may lie behind the wall, since roots do.
    """
    from bakery.geometry.camera import project_camera

    for strands, color in zip(sets, colors):
        count, knots, _ = strands.points.shape
        depth = -strands.points[..., 2]
        taper = 1 - strands.taper * np.linspace(0, 1, knots) ** 2
        width = strands.width[:, None] * taper * (camera.focal / depth)
        fade = np.full((count, knots), strands.opacity)
        fade[:, -1] *= 0.35
        middle = (depth[:, 1:] + depth[:, :-1]).ravel()
        _draw(
            np.argsort(-middle, kind="stable"),
            project_camera(strands.points, camera).reshape(-1, 2).astype(np.float32),
            depth.ravel().astype(np.float32),
            width.ravel().astype(np.float32),
            fade.ravel().astype(np.float32),
            color.reshape(-1, 3).astype(np.float32),
            knots,
            wall,
            image,
            coverage,
            np.float32(bias),
        )
