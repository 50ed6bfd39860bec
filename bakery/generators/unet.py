"""The trained generator's network: a light residual U-Net (paGAN sec. 4, DESIGN.md).

It sees the stack of conditions and says how the deformed neutral changes: a log-shading ratio for
skin, and a colour with its alpha for what the photo never showed. The paper's plain picture is the
other head. Batch normalisation is folded when the weights are exported: statistics of a picture, as
instance normalisation takes them, would make crops differ from frames.
"""

from dataclasses import dataclass

import numpy as np
import torch
from torch import nn
from torch.nn import functional

from bakery.detectors.blocks import Conv, Residual
from bakery.generators import expected_folds, strain
from bakery.generators.channels import BLOT
from bakery.generators.shade import is_part
from bakery.geometry.encode import decode, encode
from bakery.heads.base import MOUTH
from bakery.settings import Settings, setting

# Groups of the input and their channels, in order; a network may be given fewer.
INPUTS = {
    "photo": 3, "normals": 3, "depth": 1, "gaze": 2, "mouth": 1, "deformed": 3,
    "strain": strain.CHANNELS, "folds": expected_folds.CHANNELS,
}  # fmt: skip
SIGNED = ("normals", "strain", "folds")  # 128 is nothing
HEADS = ("change", "plain")
RATIO_REACH = 1.5  # the log-ratio stays below it: folds of real skin keep within 1
ALPHA_BIAS = -3.0  # alpha begins at 0.05


@dataclass(frozen=True)
class NetworkOptions(Settings):
    """The shape of a network."""

    channels: tuple[int, ...] = setting(
        (24, 48, 96, 128, 160), "at 1/2, 1/4, ... of the picture's side", 1, 4096, count=(1, 8)
    )
    blocks: int = setting(1, "residual blocks a level, on the way down and on the way up", 0, 64)
    head: str = setting("change", "what is painted; plain: the paper's picture", choices=HEADS)
    inputs: tuple[str, ...] = setting(
        tuple(INPUTS), "what is seen", choices=tuple(INPUTS), count=(1, len(INPUTS))
    )


class ResidualUNet(nn.Module):
    """[B, inputs, H, W] to [B, outputs, H, W]; H and W multiples of 2 ** levels. All zeros at first."""

    def __init__(self, inputs, outputs, widths, blocks=1, folded=False):
        super().__init__()
        self.stem = Conv(4 * inputs, widths[0], folded=folded)
        self.down, self.up = nn.ModuleList(), nn.ModuleList()
        self.join = nn.ModuleList()
        for wide, deep in zip(widths, widths[1:]):
            self.down.append(_blocks(wide, blocks, folded))
            self.down.append(Conv(wide, deep, stride=2, folded=folded))
            self.join.append(Conv(deep, wide, kernel=1, active=False, folded=folded))
            self.up.append(_blocks(wide, blocks, folded))
        self.bottom = _blocks(widths[-1], 2 * blocks, folded)
        self.head = nn.Conv2d(widths[0], 4 * outputs, 3, padding=1)
        nn.init.zeros_(self.head.weight)
        nn.init.zeros_(self.head.bias)

    def forward(self, x):
        return functional.pixel_shuffle(self.body(functional.pixel_unshuffle(x, 2)), 2)

    def body(self, x):
        """From a picture to one [B, 4 C, H/2, W/2] whose squares of 2x2 pixels became channels."""
        x = self.stem(x)
        skips = []
        for blocks, narrower in zip(self.down[::2], self.down[1::2]):
            x = blocks(x)
            skips.append(x)
            x = narrower(x)
        x = self.bottom(x)
        for join, blocks, skip in zip(self.join[::-1], self.up[::-1], skips[::-1]):
            x = blocks(skip + functional.interpolate(join(x), scale_factor=2, mode="nearest"))
        return self.head(functional.silu(x))


class UNet(ResidualUNet):
    """The generator's: [B, C, H, W] to [B, 7 or 3, H, W]."""

    def __init__(self, options=NetworkOptions(), folded=False):
        outputs = 7 if options.head == "change" else 3
        inputs = sum(INPUTS[name] for name in options.inputs)
        super().__init__(inputs, outputs, options.channels, options.blocks, folded)
        self.options = options
        if options.head == "change":
            with torch.no_grad():
                self.head.bias[4 * 6 :] = ALPHA_BIAS


def _blocks(channels, count, folded):
    return nn.Sequential(*[Residual(channels, folded) for _ in range(count)])


@dataclass(frozen=True)
class Change:
    """What a network says, as tensors."""

    ratio: torch.Tensor  # [B, 3, H, W] log of the shading over the deformed neutral, linear light
    color: torch.Tensor  # [B, 3, H, W] linear
    alpha: torch.Tensor  # [B, 1, H, W] 0..1
    picture: torch.Tensor  # [B, 3, H, W] sRGB-encoded: all of it put together


def parts_of(outputs):
    """What the outputs of a network [B, 7 or 3, H, W] mean.

    Returns:
        ratio [B, 3, H, W], colour [B, 3, H, W] linear and alpha [B, 1, H, W], as in Change. A plain
        picture is a colour whose alpha is 1.
    """
    outputs = outputs.float()
    if outputs.shape[1] == 3:
        color = to_linear(torch.sigmoid(outputs))
        return torch.zeros_like(color), color, torch.ones_like(color[:, :1])
    ratio = RATIO_REACH * torch.tanh(outputs[:, :3] / RATIO_REACH)
    return ratio, to_linear(torch.sigmoid(outputs[:, 3:6])), torch.sigmoid(outputs[:, 6:])


def interpret(outputs, deformed):
    """The outputs of a network as a change of the deformed neutral.

    Args:
        outputs: [B, 7 or 3, H, W].
        deformed: [B, 3, H, W] sRGB-encoded 0..1.

    Returns:
        Change.
    """
    ratio, color, alpha = parts_of(outputs)
    if outputs.shape[1] == 3:
        return Change(ratio, color, alpha, torch.sigmoid(outputs.float()))
    made = to_linear(deformed) * torch.exp(ratio) * (1 - alpha) + color * alpha
    return Change(ratio, color, alpha, to_encoded(made))


def to_linear(encoded):
    """sRGB-encoded 0..1 to linear (IEC 61966-2-1), differentiable."""
    return torch.where(
        encoded <= 0.04045, encoded / 12.92, ((encoded.clamp_min(0.04) + 0.055) / 1.055) ** 2.4
    )


def to_encoded(linear):
    """Linear to sRGB-encoded, not above 1, differentiable."""
    linear = linear.clamp(0, 1)
    low = linear * 12.92
    return torch.where(
        linear <= 0.0031308, low, 1.055 * linear.clamp_min(0.003) ** (1 / 2.4) - 0.055
    )


def input_channels(channels, photo, shade, expressed):
    """The channels of INPUTS [H, W, C] uint8, by name.

    Where the target shows its mouth the photo is blotted out: lips that lie there in neutral, or teeth of a
    photo that smiled, would tell how bright teeth are, each in its own way (docs/log-pagan.md).

    Args:
        channels: bakery.generators.channels.Channels, or anything with the same fields.
        photo: [H, W, 3] uint8 sRGB: the subject in neutral, head only.
        shade: [H, W], of `interior.interior_shade`.
        expressed: of `channels.expression_channels`.
    """
    deformed = encode(decode(channels.deformed) * shade[..., None])
    mouth = is_part(channels.part, *MOUTH)
    blotted = photo.copy()  # by index: `np.where` takes 5 ms for this 0.2
    blotted.reshape(-1, 3)[np.flatnonzero(mouth)] = BLOT
    return {
        "photo": blotted,
        "normals": (channels.normals.astype(np.int16) + 128).astype(np.uint8),
        "depth": channels.depth[..., None],
        "gaze": channels.gaze,
        "mouth": mouth[..., None].astype(np.uint8) * 255,
        "deformed": deformed,
    } | expressed


def network_input(batch, inputs=tuple(INPUTS)):
    """The network's input [B, C, H, W] float32 from tensors of bytes [B, C, H, W] by name."""
    stacked = torch.cat([batch[name] for name in inputs], 1).float()
    zero, full = (one.to(stacked.device)[:, None, None] for one in byte_range(inputs))
    return (stacked - zero) / full


def byte_range(inputs=tuple(INPUTS)):
    """The bytes [C] that mean 0, and how much more means 1, of each channel of the input."""
    signed = [name in SIGNED for name in inputs for _ in range(INPUTS[name])]
    return tuple(
        torch.tensor([b if s else a for s in signed]) for a, b in ((0.0, 128.0), (255.0, 127.0))
    )
