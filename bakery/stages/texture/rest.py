"""A resting face of a photo that smiles: what an expression does to the colours of the skin is undone.

Folds, raised cheeks and stretched lips change the skin's shading and colour. How much, on average over
people, was learned from pairs of photos (`train.rest`): the logarithm of the ratio of both textures on
the chart that all head models share (`fit.albedo.chart`), as a few modes whose amounts follow from the
expression weights of the fit. A face without expression is not changed.

References:
    Liu, Shan and Zhang, "Expressive expression mapping with ratio images", SIGGRAPH 2001: the ratio of
    two expressions is nearly the same for all people.
"""

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from bakery.formats.tensors import reading
from bakery.geometry.fill import smoothstep
from bakery.geometry.sample import bilinear
from bakery.heads.base import HeadModel
from bakery.paths import ASSETS
from bakery.stages.atlas import Atlas
from bakery.stages.fit.albedo import load_albedo, texel_chart
from bakery.stages.fit.rest import REMEDY
from bakery.stages.texture import TextureOptions

FILE = ASSETS / "rest" / "rest.safetensors"
EDGE = 0.06  # of the chart: there the change fades, since nothing was learned beyond
MOST = 0.7  # of the logarithm: folds of nobody are darker by more than a half
# Of what a face gets darker by when it comes to rest, as below cheeks that a smile lifts: that is the light
# of the studio in which it was learned. Elsewhere it is a grey patch beside the jaw.
DARKER = 0.2


@dataclass(frozen=True, eq=False)
class RestBasis:
    """How expressions change the skin, on the chart; S texels a side, E expressions."""

    modes: np.ndarray  # [K, S, S, 3] float32, log of (resting / expressive) linear colour
    response: np.ndarray  # [E, K] float32, amount of each mode a unit of expression weight


@lru_cache(maxsize=4)
def load_rest(path: Path = FILE) -> RestBasis:
    """Read a RestBasis.

    Raises:
        ModelError: the file is missing or damaged.
    """
    from safetensors.numpy import load_file

    with reading("resting basis", path, REMEDY):
        arrays = load_file(path)
        return RestBasis(*(arrays[key].astype(np.float32) for key in ("modes", "response")))


def rest_of(options: TextureOptions) -> RestBasis | None:
    """The basis that the options ask for.

    Raises:
        ModelError: it is missing or damaged.
    """
    return load_rest() if options.neutral == "rest" else None


def log_change(basis: RestBasis, expression: np.ndarray) -> np.ndarray:
    """Log ratio [S, S, 3] of the resting to the expressive skin on the chart.

    Args:
        expression: [E] weights of the fit.
    """
    amounts = np.asarray(expression, np.float32) @ basis.response
    return np.clip(np.einsum("k,kyxc->yxc", amounts, basis.modes), -MOST, MOST)


def change_of(
    basis: RestBasis, head: HeadModel, on_skin: Atlas, expression: np.ndarray
) -> np.ndarray:
    """The same [N, 3] at the texels of an atlas of the head's skin, as far as it is believed in any light."""
    change = log_change(basis, expression)
    change = np.where(change < 0, DARKER * change, change)
    place = texel_chart(head, load_albedo(), on_skin)
    border = np.minimum(place, 1 - place).min(1)
    within = smoothstep(0.0, EDGE, border)[:, None]
    return bilinear(change, np.clip(place, 0, 1) * change.shape[0]) * within
