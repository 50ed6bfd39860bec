"""Weights that ship as the beginning of a run: their normalisation is measured anew."""

from pathlib import Path

import torch
from torch import nn

from bakery.detectors import segmenter
from bakery.detectors.blocks import unfold
from bakery.detectors.segmenter import SegmentNet


@torch.no_grad()
def begin(network: SegmentNet, weights: Path, stack: torch.Tensor) -> None:
    """Load weights as they ship, and normalise as if the network had been trained with them.

    Folded weights have lost their statistics. With those of a batch put back, and a scale and an offset
    that undo them, the network answers as before, in training and out of it, and learns at the rates
    of one that never was folded: without statistics a rate of 6e-4 was too much (docs/log-segment.md).

    Args:
        network: not folded; changed in place, left in `eval`.
        weights: .safetensors as `export` writes them.
        stack: [B, 3 + outlines, S, S], a batch as the network is shown it, the larger the better.

    Raises:
        ModelError: the weights are missing or damaged.
    """
    network.load_state_dict(unfold(network, segmenter.load(Path(weights)).state_dict()))
    network.eval()
    norms = [module for module in network.modules() if isinstance(module, nn.BatchNorm2d)]
    hooks = [norm.register_forward_pre_hook(_measured) for norm in norms]
    network(stack)
    for hook in hooks:
        hook.remove()


def _measured(norm, inputs):
    """Give a layer that changes nothing the statistics of its input, and still change nothing."""
    x = inputs[0].float()
    var, mean = torch.var_mean(x, (0, 2, 3), correction=0)
    norm.running_mean.copy_(mean)
    norm.running_var.copy_(var)
    norm.weight.copy_((var + norm.eps).sqrt())
    norm.bias.add_(mean)
