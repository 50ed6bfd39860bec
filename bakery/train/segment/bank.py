"""All that the segmentation network learns from, in the memory of the device that it learns on."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch

from bakery.detectors import portrait, segmenter
from bakery.synth import portrait_shards
from bakery.train.backgrounds import procedural_background
from bakery.train.segment import real

TRUSTED = 0.9  # share of a teacher's class from which it is believed


@dataclass(frozen=True)
class Pictures:
    """Portraits with truth as far as it is known; S is `portrait.SIDE`. All uint8 but the points."""

    image: torch.Tensor  # [N, 3, S, S] sRGB
    alpha: torch.Tensor  # [N, S, S] share of the person; 255 everywhere if the backdrop stays
    label: torch.Tensor  # [N, S, S] into portrait.CLASSES, portrait.UNSURE
    shadow: torch.Tensor  # [N, S, S] 0, 1, portrait.UNSURE
    person: torch.Tensor  # [N, S, S] 0, 1, portrait.UNSURE
    points: torch.Tensor  # [N, 478, 2] float32 pixels

    def __len__(self):
        return len(self.image)

    def __add__(self, other: "Pictures") -> "Pictures":
        return Pictures(
            *(torch.cat([getattr(self, name), getattr(other, name)]) for name in FIELDS)
        )

    def rows(self, at) -> "Pictures":
        """The pictures of an index."""
        return Pictures(*(getattr(self, name)[at] for name in FIELDS))


FIELDS = tuple(Pictures.__dataclass_fields__)


def painted(folder: Path, device: str, seen: set[Path] | None = None) -> Pictures:
    """The pictures of `bakery synth portraits` but for the shards `seen`, which grow by these."""
    table = portrait_shards.read(folder, seen=seen)
    label = table["label"]
    return _moved(
        device,
        image=table["image"].transpose(0, 3, 1, 2),
        alpha=table["alpha"],
        label=label,
        shadow=table["shadow"],
        person=(label != portrait.BACKGROUND).astype(np.uint8),
        points=table["points"],
    )


def photographed(path: Path, device: str, teacher: Path | None = None) -> Pictures:
    """The photos of `bakery train portraits`, with a teacher's sure answers where nobody knew."""
    table = real.read(path)
    label = table["label"]
    pictures = _moved(
        device,
        image=table["image"].transpose(0, 3, 1, 2),
        alpha=np.full(label.shape, 255, np.uint8),
        label=label,
        shadow=table["shadow"],
        person=table["person"],
        points=table["points"],
    )
    if teacher is not None:
        _learn_from(pictures, segmenter.load(teacher).to(device))
    return pictures


def _moved(device, **arrays):
    # A copy of its own each, so that the arrays read from files can go.
    return Pictures(*(torch.from_numpy(np.ascontiguousarray(arrays[n])).to(device) for n in FIELDS))


@torch.inference_mode()
def _learn_from(pictures, network):
    """Fill labels nobody knew with a network's where it and its mirror image are sure and agree."""
    for start in range(0, len(pictures), 16):
        some = pictures.rows(slice(start, start + 16))
        stack = torch.cat([some.image.float() / 255, segmenter.outlines(some.points)], 1)
        shares = network(stack)[0].softmax(1)
        other = network(stack.flip(-1))[0].softmax(1).flip(-1)
        top, label = shares.max(1)
        top2, label2 = other.max(1)
        person = (label != portrait.BACKGROUND).to(torch.uint8)
        sure = (torch.minimum(top, top2) > TRUSTED) & (label == label2) & (person == some.person)
        fill = sure & (some.label == portrait.UNSURE)
        some.label[fill] = label[fill].to(torch.uint8)  # a view of the pictures


def backgrounds(count: int, seed: int, device: str) -> torch.Tensor:
    """Procedural pictures without people [count, 3, S, S] uint8."""
    out = [
        procedural_background(np.random.default_rng([seed, 8, k]), portrait.SIDE)
        for k in range(count)
    ]
    return torch.from_numpy(np.stack(out).transpose(0, 3, 1, 2).copy()).to(device)
