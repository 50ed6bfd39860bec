"""Learns the tones of the skin database: mean and modes of people's log albedo on the chart."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class ToneOptions:
    size: int = 224  # texels on a side of the chart: 0.9 to 1.1 mm each
    modes: int = 20
    rounds: int = 8  # of filling what was not seen from the modes
    fewest: float = 4.0  # people who must show a texel
    most: float = 2.0  # log ratio to the face's median; more is no skin


DEFAULTS = ToneOptions()


def learn(
    tones: np.ndarray, trusts: np.ndarray, options: ToneOptions = DEFAULTS
) -> tuple[np.ndarray, np.ndarray]:
    """Mean and modes of faces that are partly unseen, each as it is and mirrored.

    Args:
        tones: [P, S, S, 3] log of linear albedo; trusts: [P, S, S] 0..1.

    Returns:
        mean [S, S, 3] and modes [A, S, S, 3], for one standard deviation; relative to the median of
        each face. What hardly anybody shows is continued from the border.
    """
    tones = np.concatenate([tones, tones[:, :, ::-1]])
    trusts = np.concatenate([trusts, trusts[:, :, ::-1]])
    trusts = np.where(trusts > 0.5, trusts, 0)
    level = np.stack([np.median(face[trust > 0.9], 0) for face, trust in zip(tones, trusts)])
    inside = trusts.sum(0) > options.fewest
    rows = np.clip((tones - level[:, None, None])[:, inside], -options.most, options.most)
    weight = trusts[:, inside][..., None]
    usual = (rows * weight).sum(0) / weight.sum(0)
    filled = weight * rows + (1 - weight) * usual
    for _ in range(options.rounds):
        center = filled.mean(0)
        flat = (filled - center).reshape(len(filled), -1)
        energy, left = np.linalg.eigh(flat @ flat.T)
        left = left[:, ::-1][:, : options.modes]
        modes = left.T @ flat
        filled = weight * rows + (1 - weight) * ((left @ modes).reshape(filled.shape) + center)
    modes = modes / np.sqrt(len(filled))
    pictures = [_picture(part, inside) for part in (center, *modes.reshape(len(modes), -1, 3))]
    return pictures[0], np.stack(pictures[1:])


def _picture(values: np.ndarray, inside: np.ndarray) -> np.ndarray:
    """Texels [N, 3] as a chart [S, S, 3], continued to what no face shows."""
    from bakery.geometry.fill import diffuse

    out = np.zeros(inside.shape + (3,), np.float32)
    out[inside] = values
    return diffuse(out, inside.astype(np.float32))
