"""The image-to-image U-Net that paGAN builds on, to be compared with: its size and its time.

References:
    Isola, Zhu, Zhou and Efros, "Image-to-image translation with conditional adversarial networks",
    CVPR 2017, appendix: eight levels of 4x4 convolutions, 64 to 512 channels.
"""

import os
import time

import torch
from torch import nn

from bakery.generators.unet import INPUTS

WIDTHS = (64, 128, 256, 512, 512, 512, 512, 512)


class PlainUNet(nn.Module):
    """[B, inputs, H, W] to a picture [B, 3, H, W] in -1..1; sides multiples of 256."""

    def __init__(self, inputs, widths=WIDTHS):
        super().__init__()
        self.down, self.up = nn.ModuleList(), nn.ModuleList()
        for level, (wide, deep) in enumerate(zip((inputs, *widths), widths)):
            norm = nn.BatchNorm2d(deep) if 0 < level < len(widths) - 1 else nn.Identity()
            before = nn.LeakyReLU(0.2) if level else nn.Identity()
            self.down.append(nn.Sequential(before, nn.Conv2d(wide, deep, 4, 2, 1), norm))
        for level in reversed(range(len(widths))):
            deep = widths[level] * (1 if level == len(widths) - 1 else 2)
            wide = widths[level - 1] if level else 3
            norm = nn.BatchNorm2d(wide) if level else nn.Tanh()
            self.up.append(nn.Sequential(nn.ReLU(), nn.ConvTranspose2d(deep, wide, 4, 2, 1), norm))

    def forward(self, x):
        seen = []
        for layer in self.down:
            x = layer(x)
            seen.append(x)
        seen.pop()
        for layer in self.up:
            x = layer(x)
            if seen:
                x = torch.cat([x, seen.pop()], 1)
        return x


def seconds_of_plain_unet(size, count, tried=3):
    """Seconds for `count` pictures of a size (height, width) one by one: the median of a few, times.

    On all cores, in torch's default layout and precision, as published code runs it.
    """
    inputs = sum(INPUTS.values())
    network = PlainUNet(inputs).eval()
    x = torch.zeros(1, inputs, *size)
    taken = []
    before = torch.get_num_threads()
    torch.set_num_threads(os.cpu_count() or 1)
    with torch.inference_mode():
        network(x)
        for _ in range(tried):
            start = time.perf_counter()
            network(x)
            taken.append(time.perf_counter() - start)
    torch.set_num_threads(before)
    return sorted(taken)[tried // 2] * count
