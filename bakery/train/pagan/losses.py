"""Losses of the generator (paGAN eq. 1) and what was added to them. Pure functions of tensors."""

import torch
from torch import nn
from torch.nn import functional

from bakery.geometry.color import LUMA
from bakery.train.pagan.data import UNIT

GAIN = 8.0  # of the changes that the discriminator sees


def pixel_loss(picture, target, weight):
    """Mean absolute difference of pictures [B, 3, H, W] 0..1, weighted by [B, 1, H, W]."""
    return ((picture - target).abs() * weight).sum() / (3 * weight.sum()).clamp_min(1)


def detail_loss(picture, target, weight, scales=3):
    """The same of their gradients, on a pyramid: edges, creases and teeth, not their place in tone.

    References:
        Mathieu, Couprie and LeCun, "Deep multi-scale video prediction beyond mean square error",
        ICLR 2016, eq. 6.
    """
    total = 0.0
    for _ in range(scales):
        difference = picture - target
        across = (difference[..., 1:] - difference[..., :-1]).abs()
        down = (difference[..., 1:, :] - difference[..., :-1, :]).abs()
        total = total + (across * torch.minimum(weight[..., 1:], weight[..., :-1])).sum() / (
            3 * weight.sum()
        ).clamp_min(1)
        total = total + (down * torch.minimum(weight[..., 1:, :], weight[..., :-1, :])).sum() / (
            3 * weight.sum()
        ).clamp_min(1)
        picture, target, weight = (functional.avg_pool2d(x, 2) for x in (picture, target, weight))
    return total / scales


def structure_loss(picture, target, weight):
    """One minus the mean structural similarity of the luma, weighted by [B, 1, H, W].

    References:
        Wang, Bovik, Sheikh and Simoncelli, IEEE TIP 13(4), 2004: 11x11 Gaussian of sigma 1.5,
        K1 = 0.01, K2 = 0.03, as `evaluate.metrics.ssim` has them.
    """
    luma = torch.tensor(LUMA, dtype=picture.dtype, device=picture.device)[:, None, None]
    x, y = ((p * luma).sum(1, keepdim=True) for p in (picture, target))
    taps = torch.exp(-0.5 * (torch.arange(-5, 6, device=x.device, dtype=x.dtype) / 1.5) ** 2)
    taps = taps / taps.sum()
    stack = torch.cat([x, y, x * x, y * y, x * y], 1)
    for kernel in (taps[:, None], taps[None, :]):
        side = (kernel.shape[0] // 2, kernel.shape[1] // 2)
        kernel = kernel.expand(5, 1, *kernel.shape)
        stack = functional.conv2d(stack, kernel, padding=side, groups=5)
    mx, my, xx, yy, xy = stack.split(1, 1)
    vx, vy, both = xx - mx * mx, yy - my * my, xy - mx * my
    alike = (2 * mx * my + 1e-4) * (2 * both + 9e-4)
    alike = alike / ((mx * mx + my * my + 1e-4) * (vx + vy + 9e-4))
    return ((1 - alike) * weight).sum() / weight.sum().clamp_min(1)


def restraint(change, weight, skin):
    """What a change costs: alpha, which hides what is there already, and a rough ratio.

    In eyes and mouth alpha costs a tenth: there it is needed, but teeth that stand in the wrong place
    by a little are better than none.
    """
    face = (weight > 0).float()
    count = face.sum().clamp_min(1)
    alpha = (change.alpha * face * (0.1 + 0.9 * skin)).sum() / count
    ratio = change.ratio
    rough = ((ratio[..., 1:] - ratio[..., :-1]).abs() * face[..., 1:]).sum() + (
        (ratio[..., 1:, :] - ratio[..., :-1, :]).abs() * face[..., 1:, :]
    ).sum()
    return alpha, rough / (3 * count)


class PatchDiscriminator(nn.Module):
    """Judges overlapping patches of (conditions, picture): PatchGAN.

    Spectral norm in place of batch norm keeps it from overwhelming a small generator. It also bounds
    by how much two pictures can be told apart: a made face differs from the true one by 2% of white,
    and the cross entropy stayed at log 2. So the judge sees what the picture has changed in the
    deformed neutral (which is among the conditions), enlarged by GAIN.

    References:
        Isola, Zhu, Zhou and Efros, "Image-to-image translation with conditional adversarial
        networks", CVPR 2017; Miyato et al., "Spectral normalization", ICLR 2018.
    """

    def __init__(self, inputs, channels=32, kernel=3):
        """`kernel` of the last two layers: with 3 a patch has 54x54 pixels, with 4 70x70."""
        super().__init__()
        spectral = nn.utils.parametrizations.spectral_norm
        widths = [inputs + 3, channels, 2 * channels, 4 * channels]
        layers = []
        for wide, deep in zip(widths, widths[1:]):
            layers += [spectral(nn.Conv2d(wide, deep, 4, 2, 1)), nn.LeakyReLU(0.2)]
        layers += [spectral(nn.Conv2d(widths[-1], 4 * channels, kernel, 1, 1)), nn.LeakyReLU(0.2)]
        self.layers = nn.Sequential(*layers, nn.Conv2d(4 * channels, 1, kernel, 1, 1))

    def forward(self, conditions, change):
        """Logits [B, 1, H/8, W/8] of conditions [B, C, H, W] and a change [B, 3, H, W]."""
        return self.layers(torch.cat([conditions, GAIN * change], 1))


def patch_weight(weight):
    """Weights of a discriminator's patches from those of pixels [B, 1, H, W], 0..255.

    Only mouth and eyes count, by how much more than skin their pixels do. Skin carries the photo's
    own pores; what its true picture adds to them is noise, and no one should learn to paint that.
    """
    return (functional.avg_pool2d(weight, 8) / UNIT - 1).clamp_min(0)


def judged(logits, real, weight):
    """Cross entropy of a discriminator's logits against "real" or "made", over patches of face."""
    target = torch.full_like(logits, float(real))
    each = functional.binary_cross_entropy_with_logits(logits, target, reduction="none")
    return (each * weight).sum() / weight.sum().clamp_min(1)


def identity_loss(features, truth, picture):
    """L1 distance of identity features of two batches of faces (paGAN eq. 2), mean over features.

    paGAN compares with the neutral photo; the true picture shows the same person and differs in
    nothing else, so that no expression is taken for a change of identity.
    """
    return (features(truth).detach() - features(picture)).abs().mean()
