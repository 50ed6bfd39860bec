"""Other skin for performers: the texture augmentation of Olszewski 2017, section 7.2.

The paper adds principal components of the albedos to each albedo, as far as their eigenvalues times a draw
from N(0, 0.1) say. In what unit an eigenvalue is, it does not say, and 0.1 of one means anything; here
a person's step along mode i is

    sigma_1 * (lambda_i / lambda_1) * spread * N(0, 1)

so that a spread of 1 varies the tone as much as people do, and finer modes by less than they do.
"""

from dataclasses import dataclass

import cv2
import numpy as np

MODES = 12
COARSE = 4  # texels of a texture on a side for one of the analysis


@dataclass(frozen=True)
class Tones:
    """Principal components of resting skin."""

    modes: np.ndarray  # [M, t, t, 3] of one standard deviation each, linear reflectance
    eigenvalues: np.ndarray  # [M], of the largest
    skin: np.ndarray  # [T, T] 0..1, where they are added


def analyse(albedos, seen, skin, modes=MODES):
    """Principal components of textures at rest.

    Args:
        albedos: [P, T, T, 3] linear.
        seen: [P, T, T] 0..1; what is unseen counts as the mean.
        skin: [T, T] bool.

    Returns:
        Tones; at most P - 1 modes.
    """
    size = albedos.shape[1] // COARSE

    def shrunk(pictures):
        return np.stack(
            [cv2.resize(p, (size, size), interpolation=cv2.INTER_AREA) for p in pictures]
        )

    small = shrunk(albedos.astype(np.float32))
    weight = shrunk(seen.astype(np.float32) * skin)[..., None]
    mean = (small * weight).sum(0) / np.maximum(weight.sum(0), 1e-3)
    rows = ((small - mean) * (weight > 0.5)).reshape(len(small), -1)
    _, scale, right = np.linalg.svd(rows, full_matrices=False)
    count = min(modes, len(small) - 1)
    spread = scale[:count] / np.sqrt(max(len(small), 1))
    found = (right[:count] * spread[:, None]).reshape((count,) + small.shape[1:])
    edge = cv2.GaussianBlur(skin.astype(np.float32), (0, 0), 2.0) * skin
    return Tones(found.astype(np.float32), spread**2, edge.astype(np.float32))


def shift(rng, tones, spread):
    """What one imagined person's skin has over another's: [T, T, 3] linear, to add to every frame.

    Args:
        rng: numpy Generator.
        spread: see the module.
    """
    lean = tones.eigenvalues / tones.eigenvalues[0]
    # A mode is one standard deviation long: that of the first over its own gives all one unit.
    unit = np.sqrt(tones.eigenvalues[0] / np.maximum(tones.eigenvalues, 1e-12))
    step = lean * unit * spread * rng.normal(size=len(lean))
    small = np.tensordot(step.astype(np.float32), tones.modes, 1)
    side = tones.skin.shape[0]
    return cv2.resize(small, (side, side), interpolation=cv2.INTER_LINEAR) * tones.skin[..., None]
