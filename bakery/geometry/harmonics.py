"""Second-order spherical-harmonic light."""

import numpy as np

# Constants of the real spherical harmonics up to order 2.
C0, C1, C2, C20, C22 = 0.282095, 0.488603, 1.092548, 0.315392, 0.546274


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
