"""What the segmentation network is told it did wrong."""

import torch
from torch.nn import functional

from bakery.detectors import portrait
from bakery.train.segment.augment import Batch

# How much a pixel of a class counts: rare and thin ones more.
WEIGHT = {
    portrait.BROWS: 2.0, portrait.EYES: 3.0, portrait.LIPS: 2.0, portrait.MOUTH: 3.0,
    portrait.BEARD: 1.5, portrait.EARS: 1.5, portrait.FRAME: 4.0, portrait.LENS: 2.0,
    portrait.HAT: 1.5, portrait.THING: 1.5,
}  # fmt: skip


def weights(device) -> torch.Tensor:
    """[15] of the classes."""
    return torch.tensor([WEIGHT.get(k, 1.0) for k in range(len(portrait.CLASSES))], device=device)


def loss_of(logits: torch.Tensor, shadow: torch.Tensor, batch: Batch, weight: torch.Tensor):
    """The parts of the loss: {name: scalar}.

    Args:
        logits: [B, 15, S, S]; shadow: [B, S, S], as `SegmentNet` answers.
        weight: from `weights`.
    """
    logits, shadow = logits.float(), shadow.float()
    cross = functional.cross_entropy(logits, batch.label, weight, ignore_index=portrait.UNSURE)
    known = (batch.label != portrait.UNSURE)[:, None]
    shares = logits.softmax(1) * known
    # `scatter` needs a class for each pixel; those that nobody knows are taken out again.
    label = batch.label.masked_fill(~known[:, 0], 0)[:, None]
    truth = torch.zeros_like(shares).scatter_(1, label, 1.0) * known
    both, total = (shares * truth).sum((0, 2, 3)), (shares + truth).sum((0, 2, 3))
    there = truth.sum((0, 2, 3)) > 20
    dice = ((1 - (2 * both + 1) / (total + 1)) * there).sum() / there.sum().clamp(min=1)
    somebody = logits[:, 1:].logsumexp(1) - logits[:, 0]
    person = _binary(somebody, batch.person)
    shade = _binary(shadow, batch.shadow, 2.0)
    seen = (batch.shadow != portrait.UNSURE).float()
    share, is_shadow = shadow.sigmoid() * seen, (batch.shadow == 1).float()
    overlap = (2 * (share * is_shadow).sum() + 1) / ((share + is_shadow).sum() + 1)
    return {"cross": cross, "dice": dice, "person": person, "shadow": shade + 0.5 * (1 - overlap)}


def _binary(logits, truth, positive=1.0):
    """Cross entropy of yes and no where the truth [B, S, S] is 0 or 1."""
    known = (truth != portrait.UNSURE).float()
    each = functional.binary_cross_entropy_with_logits(
        logits, (truth == 1).float(), reduction="none", pos_weight=logits.new_tensor(positive)
    )
    return (each * known).sum() / known.sum().clamp(min=1)


def agreement(logits: torch.Tensor, other: torch.Tensor, batch: Batch) -> torch.Tensor:
    """How far an answer is from the averaged network's for the mirror image, where nobody knows.

    Args:
        logits, other: [B, 15, S, S], the other mirrored back.
    """
    unknown = (batch.label == portrait.UNSURE).float()
    each = -(other.softmax(1) * logits.float().log_softmax(1)).sum(1)
    return (each * unknown).sum() / unknown.sum().clamp(min=1)
