"""Identity features: a small network that tells people apart whatever their faces do.

The identity loss of paGAN (section 4) compares such features of two pictures, and so does
`bakery evaluate identity`. The pictures are those of the generator's frame, black outside the face.
"""

from dataclasses import dataclass

import numpy as np
import torch
from torch import nn
from torch.nn import functional

from bakery.detectors.blocks import Conv, stage
from bakery.errors import ModelError
from bakery.paths import ASSETS

WEIGHTS = ASSETS / "identity" / "identity.safetensors"
SIZE = 112  # pixels a side that the network looks at
FEATURES = 128
WIDTHS = (16, 32, 64, 96, 160)  # channels at 56, 28, 14, 7 and 4 pixels a side


class IdentityNet(nn.Module):
    """Pictures [B, 3, H, W] sRGB-encoded 0..1, any square size, to unit features [B, FEATURES]."""

    def __init__(self, folded=False):
        super().__init__()
        layers = [Conv(3, WIDTHS[0], stride=2, folded=folded)]
        for wide, deep, blocks in zip(WIDTHS, WIDTHS[1:], (1, 2, 2, 1)):
            layers.append(stage(wide, deep, blocks, folded))
        self.body = nn.Sequential(*layers)
        # Where in the face a feature lies matters: one weight a place, no pooling.
        self.place = nn.Conv2d(WIDTHS[-1], WIDTHS[-1], 4, groups=WIDTHS[-1])
        self.head = nn.Linear(WIDTHS[-1], FEATURES)

    def forward(self, pictures):
        small = functional.interpolate(pictures, (SIZE, SIZE), mode="bilinear", antialias=True)
        return functional.normalize(self.head(self.place(self.body(2 * small - 1)).flatten(1)))


def load_features(path=WEIGHTS):
    """The trained network, ready to use: evaluation mode, no gradients in its weights.

    Raises:
        ModelError: no weights, or not of this network.
    """
    from safetensors import SafetensorError
    from safetensors.torch import load_file

    try:
        tensors = load_file(path)
        network = IdentityNet(folded=True)
        network.load_state_dict({name: value.float() for name, value in tensors.items()})
    except (OSError, SafetensorError, RuntimeError) as error:
        raise ModelError(
            f"{path}: no weights of the identity network ({str(error).splitlines()[0]}); make them "
            "with `bakery train identity`"
        ) from None
    return network.eval().requires_grad_(False).to(memory_format=torch.channels_last)


def features_of(network, pictures):
    """Unit features [n, FEATURES] of pictures [n, H, W, 3] uint8 sRGB."""
    with torch.inference_mode():
        batch = torch.from_numpy(np.ascontiguousarray(pictures)).permute(0, 3, 1, 2).float() / 255
        return np.concatenate([network(part).numpy() for part in batch.split(32)])


@dataclass(frozen=True)
class Verification:
    """How well features tell whether two pictures show one person."""

    auc: float  # chance that a pair of one person is more alike than a pair of two
    equal_error: float  # share of wrong answers at the threshold where both kinds are as frequent
    same: np.ndarray  # [n] cosines of pairs of one person
    other: np.ndarray  # [m] cosines of pairs of two people


def verify(features, people, against=None, people_against=None):
    """Compare all pairs of pictures.

    Args:
        features: [n, d] unit; people: [n] who each shows.
        against, people_against: the second pictures [m, d], [m]; None pairs the first among themselves.

    Returns:
        Verification.
    """
    people = np.asarray(people)
    if against is None:
        first, second = np.triu_indices(len(features), 1)
        cosine = (features[first] * features[second]).sum(1)
        alike = people[first] == people[second]
    else:
        cosine = (features @ against.T).ravel()
        alike = (people[:, None] == np.asarray(people_against)[None]).ravel()
    same, other = cosine[alike], cosine[~alike]
    # Mann-Whitney: how many of the other pairs each same pair exceeds, ties half.
    ordered = np.sort(other)
    below = np.searchsorted(ordered, same, "left"), np.searchsorted(ordered, same, "right")
    auc = float((below[0] + below[1]).mean() / 2 / len(other))
    thresholds = np.unique(cosine)
    missed = np.searchsorted(np.sort(same), thresholds, "left") / len(same)
    taken = 1 - np.searchsorted(ordered, thresholds, "left") / len(other)
    at = int(np.abs(missed - taken).argmin())
    return Verification(auc, float((missed[at] + taken[at]) / 2), same, other)
