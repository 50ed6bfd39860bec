"""The skin database, and what hidden skin most likely looks like by it: a convex blend of correlations.

Saito 2017, section 4.2 (B4 of the paper's pipeline): the correlations of the database are taken where the
photo shows skin, too, and weights are found that sum to one and are not negative; with them, the
correlations of the whole faces are blended. The database that ships holds no person's correlations, but
averages of several people's, and modes of their tones (`train.skin`).
"""

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from bakery.formats.tensors import reading
from bakery.paths import ASSETS
from bakery.stages.texture.correlations import FEATURES, KINDS, WINDOWS, Correlations

FILE = ASSETS / "skin" / "skin.safetensors"
REMEDY = "reinstall bakery, or complete without it: --complete mirror"
FEWEST = 20  # windows that must be seen before weights are told apart


@dataclass(frozen=True, eq=False)
class SkinDatabase:
    """What is known of skin: D averages of people, as they are and mirrored; W windows, F features."""

    gram: np.ndarray  # [D, W, F, F] float32
    known: np.ndarray  # [D, W] bool
    tone: np.ndarray  # [S, S, 3] float32, mean log albedo on the chart, against a face's median
    tone_modes: np.ndarray  # [A, S, S, 3] float32, for one standard deviation


@lru_cache(maxsize=2)
def load_database(path: Path = FILE) -> SkinDatabase:
    """Read a SkinDatabase.

    Raises:
        ModelError: the file is missing or damaged.
    """
    from safetensors.numpy import load_file

    with reading("skin database", path, REMEDY):
        arrays = load_file(path)
        upper, windows = arrays["upper"].astype(np.float32), arrays["windows"]
        tone = arrays["tone"].astype(np.float32)
        modes = arrays["tone_modes"] * arrays["tone_scale"][:, None, None, None]
    rows, columns = np.triu_indices(FEATURES)
    gram = np.zeros((len(upper), WINDOWS**2, FEATURES, FEATURES), np.float32)
    for index, values in enumerate(upper):
        part = np.zeros((len(windows), FEATURES, FEATURES), np.float32)
        part[:, rows, columns] = values
        part[:, columns, rows] = values
        gram[index, windows] = part
    return database_of(gram, tone, modes)


def database_of(gram: np.ndarray, tone: np.ndarray, modes: np.ndarray) -> SkinDatabase:
    """A SkinDatabase of correlations [D, W, F, F] that are not mirrored yet, and of tones."""
    gram = np.concatenate([gram, mirrored(gram)])
    return SkinDatabase(gram, gram[:, :, 0, 0] > 0, tone, modes.astype(np.float32))


def mirrored(gram: np.ndarray) -> np.ndarray:
    """Correlations [.., W, F, F] of the same skins, left and right exchanged."""
    order = np.arange(FEATURES)
    # What gets lighter to the left gets darker to the right.
    for first in range(0, FEATURES, KINDS):
        order[first + 2], order[first + 3] = first + 3, first + 2
    grid = gram.reshape(gram.shape[:-3] + (WINDOWS, WINDOWS, FEATURES, FEATURES))
    out: np.ndarray = grid[..., ::-1, :, :][..., order, :][..., order].reshape(gram.shape)
    return out


def blended(partial: Correlations, database: SkinDatabase) -> Correlations:
    """The most likely correlations of the whole of a skin that is partly seen.

    Photos differ in sharpness and noise, people in contrast: every feature is compared with its own
    mean over the windows that are seen, and brought back to it at the end.

    Returns:
        Correlations; `known` is 1 where the database knows the window.
    """
    seen = partial.known
    scale = _scale(partial.gram, seen)
    scales = np.stack([_scale(gram, seen * ok) for gram, ok in zip(database.gram, database.known)])
    shared = (seen > 0) & database.known.all(0)
    count = len(database.gram)
    weights = np.full(count, 1 / count)
    if shared.sum() >= FEWEST:
        mine = np.diagonal(partial.gram[shared], axis1=1, axis2=2) / scale**2
        theirs = np.diagonal(database.gram[:, shared], axis1=2, axis2=3) / scales[:, None] ** 2
        weights = convex_weights(theirs.reshape(count, -1), mine.reshape(-1))
    share = weights[:, None] * database.known
    mass = share.sum(0)
    per = share / np.maximum(mass, 1e-6)
    gram = np.zeros_like(partial.gram)
    for one, entry, own in zip(per, database.gram, scales):
        ratio = scale / own
        gram += one[:, None, None] * entry * (ratio[:, None] * ratio)
    return Correlations(gram, (mass > 0.2).astype(np.float32))


def _scale(gram: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Root mean square [F] of each feature over windows of some weight [W]."""
    diagonal = np.diagonal(gram, axis1=1, axis2=2)
    total: np.ndarray = np.sqrt((diagonal * weight[:, None]).sum(0) / max(weight.sum(), 1e-6))
    return np.maximum(total, 1e-5)


def convex_weights(entries: np.ndarray, wanted: np.ndarray, steps: int = 400) -> np.ndarray:
    """Weights [D] that sum to one and are not negative, whose blend of entries is nearest.

    Args:
        entries: [D, n]; wanted: [n]; steps: of accelerated projected gradient descent.

    References:
        Beck and Teboulle, "A Fast Iterative Shrinkage-Thresholding Algorithm", SIAM J. Imaging
        Sciences 2(1), 2009; Duchi et al., "Efficient Projections onto the l1-Ball", ICML 2008.
    """
    system, aim = entries @ entries.T, entries @ wanted
    reach = np.linalg.eigvalsh(system.astype(np.float64))[-1]
    weights = ahead = np.full(len(entries), 1 / len(entries))
    pace = 1.0
    for _ in range(steps):
        before, weights = weights, _onto_simplex(ahead - (system @ ahead - aim) / reach)
        faster = (1 + np.sqrt(1 + 4 * pace**2)) / 2
        ahead = weights + (pace - 1) / faster * (weights - before)
        pace = faster
    return weights


def _onto_simplex(point: np.ndarray) -> np.ndarray:
    """The nearest weights that sum to one and are not negative."""
    falling = np.sort(point)[::-1]
    over = (np.cumsum(falling) - 1) / np.arange(1, len(point) + 1)
    last = np.flatnonzero(falling > over)[-1]
    out: np.ndarray = np.maximum(point - over[last], 0)
    return out
