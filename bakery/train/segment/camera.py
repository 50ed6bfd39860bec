"""What a camera and a file do to pictures [B, 3, S, S] 0..1, in torch on their device."""

import torch
from torch.nn import functional

from bakery.train.degrade import quantised
from bakery.train.segment.augment import chance, normal, uniform


def photograph(image: torch.Tensor) -> torch.Tensor:
    """A random chain of all of these."""
    count = len(image)
    image = torch.where(chance(image, 0.85, count), colored(image), image)
    image = torch.where(chance(image, 0.3, count), blurred(image), image)
    image = torch.where(chance(image, 0.25, count), shrunk(image), image)
    image = torch.where(chance(image, 0.4, count), noisy(image), image)
    image = torch.where(chance(image, 0.25, count), blocky(image), image)
    return image.clamp(0, 1)


def colored(image: torch.Tensor) -> torch.Tensor:
    """Exposure, white balance, gamma, contrast and saturation."""
    count = len(image)
    gain = torch.exp(0.18 * normal(image, count, 1, 1, 1) + 0.06 * normal(image, count, 3, 1, 1))
    gamma = torch.exp(0.25 * normal(image, count, 1, 1, 1))
    out = (image.clamp(min=1e-4) ** gamma) * gain
    out = (out - 0.5) * torch.exp(0.15 * normal(image, count, 1, 1, 1)) + 0.5
    grey = out.mean(1, keepdim=True)
    share = uniform(image, 0.5, 1.5, count, 1, 1, 1)
    share = torch.where(chance(image, 0.06, count), 0.0, share)
    return (grey + (out - grey) * share).clamp(0, 1)


def blurred(image: torch.Tensor) -> torch.Tensor:
    """Out of focus by up to 2 pixels, all alike."""
    sigma = float(torch.empty(1).uniform_(0.4, 2.0))
    taps = torch.arange(-5, 6, device=image.device, dtype=image.dtype)
    kernel = torch.exp(-0.5 * (taps / sigma) ** 2)
    kernel = (kernel / kernel.sum()).expand(3, 1, 1, -1)
    out = functional.conv2d(functional.pad(image, (5, 5, 5, 5), "reflect"), kernel, groups=3)
    return functional.conv2d(out, kernel.transpose(2, 3), groups=3)


def shrunk(image: torch.Tensor) -> torch.Tensor:
    """From a smaller picture."""
    side = int(torch.randint(64, 200, (1,)))
    small = functional.interpolate(image, (side, side), mode="bilinear", antialias=True)
    return functional.interpolate(small, image.shape[2:], mode="bilinear")


def noisy(image: torch.Tensor) -> torch.Tensor:
    """Sensor noise, in part the same in all channels."""
    count, _, height, width = image.shape
    strength = uniform(image, 0.0, 0.06, count, 1, 1, 1)
    grain = normal(image, count, 3, height, width) * 0.7 + normal(image, count, 1, height, width)
    return image + strength * grain


def blocky(image: torch.Tensor) -> torch.Tensor:
    """Blocks of 8 pixels quantised as JPEG does, without its colour planes."""
    k = torch.arange(8, device=image.device, dtype=image.dtype)
    step = uniform(image, 0.004, 0.03, len(image), 1, 1, 1, 1, 1)
    return quantised(image, (1 + k[None] + k[:, None]) * step)
