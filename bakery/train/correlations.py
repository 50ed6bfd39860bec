"""Learns the correlations of the skin database: averages over people who are alike."""

from dataclasses import dataclass

import numpy as np

from bakery.stages.texture.correlations import WINDOWS, Correlations
from bakery.stages.texture.database import mirrored

FLOOR = 1e-3  # of the usual energy, below which windows do not differ


@dataclass(frozen=True)
class CorrelationOptions:
    entries: int = 32  # averages that are kept; each counts twice, the second time mirrored
    people: int = 6  # in each average: none shows a person
    common: float = 0.25  # of the people of an average who must show a window


DEFAULTS = CorrelationOptions()


def learn(found: list[Correlations], options: CorrelationOptions = DEFAULTS) -> np.ndarray:
    """Average each person with those who are most alike, and keep averages that differ most.

    Args:
        found: of each person; they count twice, the second time mirrored.

    Returns:
        [D, W, F, F], relative to each person's own mean of a feature; 0 where few show the window.
    """
    gram = np.stack([one.gram for one in found])
    gram = np.concatenate([gram, mirrored(gram)])
    known = np.stack([one.known for one in found])
    grid = known.reshape(-1, WINDOWS, WINDOWS)
    known = np.concatenate([known, grid[:, :, ::-1].reshape(known.shape)])
    person = np.tile(np.arange(len(found)), 2)
    diagonal = np.diagonal(gram, axis1=2, axis2=3)
    scale = np.sqrt((diagonal * known[..., None]).sum(1) / np.maximum(known.sum(1), 1e-6)[:, None])
    gram = gram / np.maximum(scale[:, None, :, None] * scale[:, None, None, :], 1e-12)
    apart = _distances(np.log(np.diagonal(gram, axis1=2, axis2=3) + FLOOR), known)
    entries = []
    for first in _spread(apart, person, min(options.entries, len(found))):
        group, taken = [], set()
        for index in np.argsort(apart[first], kind="stable"):
            if person[index] not in taken:
                group.append(index)
                taken.add(person[index])
            if len(group) == options.people:
                break
        weight = known[group]
        mean = (gram[group] * weight[..., None, None]).sum(0)
        enough = (weight > 0).mean(0) >= options.common
        mean *= (enough / np.maximum(weight.sum(0), 1e-6))[:, None, None]
        entries.append(mean)
    return np.stack(entries).astype(np.float32)


def _distances(energy: np.ndarray, known: np.ndarray) -> np.ndarray:
    """Mean squared difference [P, P] of energies [P, W, F] over windows that both know [P, W]."""
    out = np.zeros((len(energy), len(energy)))
    for index, (mine, seen) in enumerate(zip(energy, known)):
        both = np.minimum(seen, known)
        square = ((energy - mine) ** 2).mean(2)
        out[index] = (square * both).sum(1) / np.maximum(both.sum(1), 1e-6)
    return out


def _spread(apart: np.ndarray, person: np.ndarray, count: int) -> list[int]:
    """`count` of those not mirrored, each the farthest from all before."""
    half = len(apart) // 2
    kept = [0]
    while len(kept) < count:
        nearest = apart[:half, kept].min(1)
        nearest[kept] = -1
        kept.append(int(np.argmax(nearest)))
    return kept
