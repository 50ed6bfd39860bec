"""The small networks of the detector: finders of faces, of points, and of points in close-ups.

All are plain residual convolution networks. They are trained with batch normalisation; `fold`
merges it into the convolutions, and what ships is the folded network (`folded=True`).
"""

from collections.abc import Iterator
from contextlib import contextmanager

import torch
from torch import nn
from torch.nn import functional

from bakery.detectors.frames import POINTS

FINDER_STRIDE = 8
FINDER_CHANNELS = 6  # score, x and y offset, log size, cosine and sine of the roll


@contextmanager
def inference() -> Iterator[None]:
    """Run networks for their answers alone, on one thread: the same bytes whatever the machine.

    What a convolution sums up depends in its last bits on how many threads share it (the mouth's
    network: one, two and four give three answers), and in a process that paints (`PaganGenerator`)
    torch has one anyway.
    """
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        with torch.inference_mode():
            yield
    finally:
        torch.set_num_threads(before)


def added(fresh: torch.Tensor, x: torch.Tensor) -> torch.Tensor:
    """fresh + x, in the place of `fresh` where nothing is learned: large maps are slow to come by."""
    return fresh + x if torch.is_grad_enabled() else fresh.add_(x)


class Conv(nn.Module):
    """3x3 (or `kernel`) convolution, batch normalisation unless folded, optional SiLU."""

    def __init__(self, inputs, outputs, stride=1, kernel=3, active=True, folded=False):
        super().__init__()
        self.conv = nn.Conv2d(inputs, outputs, kernel, stride, kernel // 2, bias=folded)
        self.norm = nn.Identity() if folded else nn.BatchNorm2d(outputs)
        self.active, self.folded = active, folded

    def forward(self, x):
        conv = self.conv
        if self.folded:  # calls of modules would take a tenth of a small network's time
            x = torch.conv2d(x, conv.weight, conv.bias, conv.stride, conv.padding)
        else:
            x = self.norm(conv(x))
        return functional.silu(x, inplace=not torch.is_grad_enabled()) if self.active else x


class Residual(nn.Module):
    """x + two convolutions of x.

    Nothing acts on the sum and the branch starts at zero: with SiLU after the sum, the points
    network learned nothing in 250 steps; so, it had halved its error.
    """

    def __init__(self, channels, folded=False):
        super().__init__()
        self.first = Conv(channels, channels, folded=folded)
        self.second = Conv(channels, channels, active=False, folded=folded)
        if not folded:
            nn.init.zeros_(self.second.norm.weight)

    def forward(self, x):
        return added(self.second(self.first(x)), x)


def stage(inputs, outputs, blocks, folded):
    """Halve the resolution, then `blocks` residual blocks."""
    return nn.Sequential(
        Conv(inputs, outputs, stride=2, folded=folded),
        *[Residual(outputs, folded) for _ in range(blocks)],
    )


class FinderNet(nn.Module):
    """Fully convolutional centre, size and roll of every face between 20 and 110 pixels.

    Input [B, 3, H, W] 0..1 with H and W multiples of 16; output [B, 6, H/8, W/8]: logit of a
    centre in this cell, offset of the centre from the cell's middle (cells), natural logarithm
    of the size in units of 48 pixels, cosine and sine of the roll.
    """

    def __init__(self, folded=False):
        super().__init__()
        self.fine = nn.Sequential(
            Conv(3, 16, stride=2, folded=folded),
            stage(16, 24, 1, folded),
            stage(24, 48, 2, folded),
        )
        self.coarse = nn.Sequential(stage(48, 96, 3, folded), Conv(96, 48, kernel=1, folded=folded))
        self.mix = Conv(48, 48, folded=folded)
        self.head = nn.Conv2d(48, FINDER_CHANNELS, 1)

    def forward(self, x):
        fine = self.fine(x - 0.5)
        coarse = functional.interpolate(self.coarse(fine), scale_factor=2, mode="nearest")
        return self.head(self.mix(fine + coarse))


class PointsNet(nn.Module):
    """478 points, their expected error and the presence of a face in an upright crop.

    Input [B, 3, S, S] 0..1, S = `crop_size`. Outputs: points [B, 478, 2] in units of the crop's
    side, origin in its middle; log of the expected distance error in the same unit [B, 478];
    logit of a face [B].
    """

    crop_size = 128

    def __init__(self, folded=False):
        super().__init__()
        self.body = nn.Sequential(
            Conv(3, 24, stride=2, kernel=5, folded=folded),
            stage(24, 40, 2, folded),
            stage(40, 80, 3, folded),
            stage(80, 128, 3, folded),
            stage(128, 192, 2, folded),
            Conv(192, 96, kernel=1, folded=folded),
        )
        self.hidden = nn.Linear(96 * (self.crop_size // 32) ** 2, 384)
        self.out = nn.Linear(384, POINTS * 3 + 1)
        nn.init.zeros_(self.out.weight)
        nn.init.zeros_(self.out.bias)
        self.register_buffer("mean_shape", torch.zeros(POINTS, 2))

    def forward(self, x):
        features = functional.silu(self.hidden(self.body(x - 0.5).flatten(1)))
        out = self.out(features).float()
        shape, spread = out[:, : POINTS * 2], out[:, POINTS * 2 : POINTS * 3]
        return self.mean_shape + shape.unflatten(1, (POINTS, 2)), spread - 4.0, out[:, -1]


class CloseupNet(nn.Module):
    """Points and their expected error in an upright crop of an eye or the mouth, see `closeups`.

    Input [B, 3, S, S] 0..1, S = `side`, a multiple of 32. Outputs: points [B, count, 2] in units of
    the crop's side from its middle; log of the expected distance error in the same unit [B, count].
    """

    def __init__(self, count, side, folded=False):
        super().__init__()
        self.count = count
        self.body = nn.Sequential(
            Conv(3, 24, stride=2, kernel=5, folded=folded),
            stage(24, 40, 1, folded),
            stage(40, 72, 2, folded),
            stage(72, 112, 2, folded),
            stage(112, 128, 1, folded),
        )
        self.hidden = nn.Linear(128 * (side // 32) ** 2, 256)
        self.out = nn.Linear(256, count * 3)
        nn.init.zeros_(self.out.weight)
        nn.init.zeros_(self.out.bias)
        self.register_buffer("mean_shape", torch.zeros(count, 2))

    def forward(self, crop):
        # Exposure says nothing about where points are; the colour of lips against skin does.
        middle = crop.mean((1, 2, 3), keepdim=True)
        spread = crop.std((1, 2, 3), keepdim=True)
        features = self.body((crop - middle) / (spread + 0.02))
        out = self.out(functional.silu(self.hidden(features.flatten(1)))).float()
        shape, log_error = out[:, : self.count * 2], out[:, self.count * 2 :]
        return self.mean_shape + shape.unflatten(1, (self.count, 2)), log_error - 4.0


def fold(network):
    """Merge batch normalisation into the convolutions before it.

    Args:
        network: one of these networks with trained statistics.

    Returns:
        dict of tensors that loads into the same network built with `folded=True`.
    """
    state = {}
    for name, module in network.named_modules():
        if isinstance(module, Conv):
            norm = module.norm
            gain = norm.weight / torch.sqrt(norm.running_var + norm.eps)
            state[f"{name}.conv.weight"] = module.conv.weight * gain[:, None, None, None]
            state[f"{name}.conv.bias"] = norm.bias - norm.running_mean * gain
    skipped = (".conv.", ".norm.")
    plain = network.state_dict()
    state.update({k: v for k, v in plain.items() if not any(part in k for part in skipped)})
    return {k: v.detach().float().contiguous() for k, v in state.items()}


def unfold(network, state):
    """The tensors of a folded network as those of a network with normalisation that changes nothing.

    The inverse of `fold` while the statistics are kept as they are (modules in `eval`).

    Args:
        network: one of these networks, not folded.
        state: tensors by name of the same network built with `folded=True`.

    Returns:
        dict of tensors that loads into `network`.
    """
    out = {name: torch.zeros_like(value) for name, value in network.state_dict().items()}
    for name, module in network.named_modules():
        if isinstance(module, Conv):
            out[f"{name}.norm.weight"] += (1 + module.norm.eps) ** 0.5
            out[f"{name}.norm.bias"] = state[f"{name}.conv.bias"]
            out[f"{name}.norm.running_var"] += 1
    return out | {name: value for name, value in state.items() if name in out}
