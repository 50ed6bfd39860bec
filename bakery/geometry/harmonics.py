"""Second-order spherical-harmonic light.

A light is nine rows of linear RGB: the coefficients, in the order of `basis`, of the irradiance over
pi, which is the colour that a white (albedo 1), matt surface shows.
"""

import numpy as np

# Constants of the real spherical harmonics up to order 2.
C0, C1, C2, C20, C22 = 0.282095, 0.488603, 1.092548, 0.315392, 0.546274
# Convolution with the clamped cosine, per coefficient (Ramamoorthi and Hanrahan 2001).
COSINE = np.array([np.pi] + [2 * np.pi / 3] * 3 + [np.pi / 4] * 5)


def basis(normals: np.ndarray) -> np.ndarray:
    """Y_k at unit normals: [..., 3] to [..., 9] (1, y, z, x, xy, yz, 3z^2-1, xz, x^2-y^2)."""
    x, y, z = normals[..., 0], normals[..., 1], normals[..., 2]
    return np.stack(
        [
            np.full_like(x, C0),
            C1 * y,
            C1 * z,
            C1 * x,
            C2 * x * y,
            C2 * y * z,
            C20 * (3 * z * z - 1),
            C2 * x * z,
            C22 * (x * x - y * y),
        ],
        -1,
    )


def basis_jacobian(normals: np.ndarray) -> np.ndarray:
    """Derivative of `basis` by the normal: [..., 3] to [..., 9, 3]."""
    x, y, z = normals[..., 0], normals[..., 1], normals[..., 2]
    out = np.zeros(normals.shape[:-1] + (9, 3), normals.dtype)
    out[..., 1, 1] = out[..., 2, 2] = out[..., 3, 0] = C1
    out[..., 4, 0], out[..., 4, 1] = C2 * y, C2 * x
    out[..., 5, 1], out[..., 5, 2] = C2 * z, C2 * y
    out[..., 6, 2] = 6 * C20 * z
    out[..., 7, 0], out[..., 7, 2] = C2 * z, C2 * x
    out[..., 8, 0], out[..., 8, 1] = 2 * C22 * x, -2 * C22 * y
    return out


def turned(light: np.ndarray, turn: np.ndarray) -> np.ndarray:
    """A light [9, ...] as it is once `turn` [3, 3] has rotated it."""
    rng = np.random.default_rng(0)
    directions = rng.normal(size=(32, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    values = basis(directions @ turn) @ light  # the old light, turned back
    return np.linalg.lstsq(basis(directions), values, rcond=None)[0]


def irradiance(normals: np.ndarray, light: np.ndarray) -> np.ndarray:
    """Light [9, 3] at unit normals [..., 3]: [..., 3] linear RGB."""
    return basis(normals) @ light


def direction(azimuth: float, elevation: float) -> np.ndarray:
    """Unit vector [3] of angles in degrees: azimuth to +x, elevation up, 0 straight along +z."""
    a, e = np.radians(azimuth), np.radians(elevation)
    return np.array([np.sin(a) * np.cos(e), np.sin(e), np.cos(a) * np.cos(e)])


def lamp(toward: np.ndarray, color: np.ndarray) -> np.ndarray:
    """The light [9, 3] of a far lamp that gives a surface facing it the colour [3]."""
    return np.outer(basis(toward) * COSINE, color)


def of_map(radiance: np.ndarray) -> np.ndarray:
    """The light [9, 3] of a latitude-longitude map of what is around.

    Args:
        radiance: [H, W, 3] linear; the top row is up (+y), the middle lies at +z, and columns go on
            to -x: as the subject sees the world, looking ahead.

    References:
        Ramamoorthi and Hanrahan, "An Efficient Representation for Irradiance Environment Maps",
        SIGGRAPH 2001.
    """
    height, width = radiance.shape[:2]
    edges = np.cos(np.linspace(0, np.pi, height + 1))
    share = (edges[:-1] - edges[1:]) * 2 * np.pi / width  # solid angle of a pixel, by rows
    elevation = 90 - (np.arange(height) + 0.5) * 180 / height
    azimuth = 180 - (np.arange(width) + 0.5) * 360 / width
    e, a = np.radians(elevation)[:, None], np.radians(azimuth)[None]
    toward = np.stack(
        [np.sin(a) * np.cos(e), np.broadcast_to(np.sin(e), (height, width)), np.cos(a) * np.cos(e)],
        -1,
    )
    rows = basis(toward) * share[:, None, None]
    found: np.ndarray = np.einsum("hwk,hwc->kc", rows, radiance) * COSINE[:, None] / np.pi
    return found
