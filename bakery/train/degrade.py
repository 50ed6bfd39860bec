"""What happens to a picture between the face and the file, for whole batches on any device.

Things before the face, light, lens, sensor, codec. All functions take and return float tensors [B, 3, S, S] 0..1 and draw
from the generator of the device that the pictures are on.
"""

import math

import torch
from torch.nn import functional

GROUPS = 8  # parts of a batch; lens, size and codec are drawn once a part
SMALLEST = 0.18  # of its size that a picture is recorded at
LUMA = (0.30, 0.59, 0.11)


def photograph(x, rng, most=1.0):
    """A random chain of all of these, from a fifth as often as written here to `most` times."""
    groups = min(GROUPS, len(x))
    drawn = _uniform(rng, x, (groups,), 0.2 * most, most)
    amounts = drawn.repeat_interleave(-(-len(x) // groups))[: len(x), None, None, None]
    x = occluded(x, rng, 0.15 * amounts)
    x = lit(x, rng, 0.5 * amounts)
    x = toned(x, rng, 0.85 * amounts)
    x = mixed_colours(x, rng, 0.4 * amounts)
    parts = []
    for part, amount in zip(x.chunk(groups), drawn.tolist()):
        if _one(rng) < 0.35 * amount:
            part = blurred(part, rng)
        scale = 1.0
        if _one(rng) < 0.6 * amount:
            scale = math.exp(math.log(SMALLEST) * _one(rng) ** 1.7)
        parts.append(recorded(part, rng, scale, amount))
    return torch.cat(parts).clamp_(0, 1)


def occluded(x, rng, chance):
    """Patches before the face: soft ellipses and boxes that show another picture, or one tone."""
    count, _, height, width = x.shape
    for _ in range(2):
        centre = _uniform(rng, x, (count, 2), -1, 1)
        size = _uniform(rng, x, (count, 2), 0.08, 0.6)
        angle = _uniform(rng, x, (count,), 0, math.pi)
        sharp = _uniform(rng, x, (count, 1, 1), 4, 40)
        power = _uniform(rng, x, (count, 1, 1), 2, 8)
        grid = _grid(x, height, width) - centre[:, None, None]
        c, s = angle.cos()[:, None, None], angle.sin()[:, None, None]
        u = (grid[..., 0] * c + grid[..., 1] * s) / size[:, 0, None, None]
        v = (grid[..., 1] * c - grid[..., 0] * s) / size[:, 1, None, None]
        radius = (u.abs() ** power + v.abs() ** power) ** (1 / power)
        matte = torch.sigmoid((1 - radius) * sharp) * _happens(rng, x, count, chance)[..., 0]
        other = x.roll(1, 0).flip(2)
        plain = _uniform(rng, x, (count, 3, 1, 1), 0, 1)
        plain = plain * (0.7 + 0.6 * _field(rng, x, 6))
        texture = torch.where(_happens(rng, x, count, 0.5) > 0, other, plain)
        x = x + (texture - x) * matte[:, None]
    return x


def lit(x, rng, chance):
    """Uneven light: a smooth field brightens and darkens parts of the picture."""
    cells = int(torch.randint(2, 6, (1,), generator=rng, device=x.device))
    white = torch.randn(len(x), 1, cells, cells, generator=rng, device=x.device)
    lamps = torch.randn(len(x), 3, cells, cells, generator=rng, device=x.device)
    field = white + 0.4 * lamps * _happens(rng, x, len(x), 0.3)
    field = functional.interpolate(field, x.shape[2:], mode="bicubic", align_corners=False)
    amount = _uniform(rng, x, (len(x), 1, 1, 1), 0.05, 0.5) * _happens(rng, x, len(x), chance)
    return x * torch.exp(amount * field)


def toned(x, rng, chance):
    """Exposure, contrast, gamma and white balance."""
    on = _happens(rng, x, len(x), chance)

    def normal(sigma, channels=1):
        drawn = torch.randn(len(x), channels, 1, 1, generator=rng, device=x.device)
        return drawn * sigma * on

    x = x.clamp(1e-4, None) ** torch.exp(normal(0.3))
    x = x * torch.exp(normal(0.22)) * torch.exp(normal(0.07, 3))
    return (x - 0.5) * torch.exp(normal(0.2)) + 0.5 + normal(0.05)


def mixed_colours(x, rng, chance):
    """Grey, pale or gaudy colours."""
    on = _happens(rng, x, len(x), chance)
    share = _uniform(rng, x, (len(x), 1, 1, 1), 0.0, 1.8)
    share = share * (1 - _happens(rng, x, len(x), 0.25))
    weights = torch.tensor(LUMA, device=x.device)[None, :, None, None]
    grey = (x * weights).sum(1, keepdim=True)
    return torch.where(on > 0, grey + (x - grey) * share, x)


def blurred(x, rng):
    """Out of focus, or shaken along a line."""
    size = x.shape[-1]
    reach = 6
    at = torch.arange(-reach, reach + 1, device=x.device, dtype=x.dtype)
    if _one(rng) < 0.6:
        sigma = (0.4 + 2.4 * _one(rng)) * size / 128
        kernel = torch.exp(-0.5 * (at / sigma) ** 2)
        kernel = kernel[:, None] * kernel[None]
    else:
        angle, length = math.pi * _one(rng), 1 + 4 * _one(rng)
        along = at[None] * math.cos(angle) + at[:, None] * math.sin(angle)
        beside = at[:, None] * math.cos(angle) - at[None] * math.sin(angle)
        kernel = torch.exp(-0.5 * (beside / 0.6) ** 2) * torch.sigmoid(4 * (length - along.abs()))
    kernel = (kernel / kernel.sum()).expand(3, 1, -1, -1)
    padded = functional.pad(x, (reach,) * 4, mode="replicate")
    return functional.conv2d(padded, kernel, groups=3)


def recorded(x, rng, scale, amount):
    """Taken at a share of the size, with sensor noise, and coded in blocks; then enlarged again."""
    size = x.shape[2:]
    if scale < 0.97:
        small = [max(round(n * scale), 12) for n in size]
        x = functional.interpolate(x, small, mode="bilinear", antialias=True, align_corners=False)
    sigma = _uniform(rng, x, (len(x), 1, 1, 1), 1, 18) / 255
    sigma = sigma * _happens(rng, x, len(x), 0.4 * amount)
    noise = torch.randn(x.shape, generator=rng, device=x.device)
    grey = torch.randn(len(x), 1, *x.shape[2:], generator=rng, device=x.device)
    x = x + sigma * torch.where(_happens(rng, x, len(x), 0.5) > 0, noise, grey)
    if _one(rng) < 0.4 * amount:
        x = coded(x.clamp(0, 1), math.exp(math.log(0.008) + _one(rng) * math.log(15)))
    if x.shape[2:] != size:
        mode = "bilinear" if _one(rng) < 0.6 else "bicubic"
        x = functional.interpolate(x, size, mode=mode, align_corners=False)
    return x


def coded(x, step):
    """Blocks of 8x8 pixels with coarse cosines, as JPEG and video have them.

    Args:
        step: of the coarseness at the lowest frequency, 0..1; ten times as much at the highest.
    """
    k = torch.arange(8, device=x.device, dtype=x.dtype)
    return quantised(x, step * (1 + 9 * (k[:, None] + k[None]) / 14))


def quantised(x, coarse):
    """The cosines of blocks of 8x8 pixels rounded to multiples of `coarse` [..., 8, 8].

    Leading axes of `coarse` are those of [B, channels, rows, columns] of blocks.
    """
    count, channels, height, width = x.shape
    padded = functional.pad(x, (0, -width % 8, 0, -height % 8), mode="replicate")
    rows, columns = padded.shape[2] // 8, padded.shape[3] // 8
    blocks = padded.reshape(count, channels, rows, 8, columns, 8).transpose(3, 4)
    k = torch.arange(8, device=x.device, dtype=x.dtype)
    basis = torch.cos(math.pi * (2 * k[None] + 1) * k[:, None] / 16) * 0.5
    basis[0] *= math.sqrt(0.5)
    cosines = torch.round(basis @ blocks @ basis.T / coarse) * coarse
    blocks = (basis.T @ cosines @ basis).transpose(3, 4)
    return blocks.reshape(padded.shape)[..., :height, :width]


def _one(rng):
    return float(torch.rand((), generator=rng, device=rng.device))


def _uniform(rng, x, shape, low, high):
    return low + (high - low) * torch.rand(shape, generator=rng, device=x.device)


def _happens(rng, x, count, chance):
    drawn = torch.rand(count, 1, 1, 1, generator=rng, device=x.device)
    return (drawn < chance).to(x.dtype)


def _field(rng, x, cells):
    drawn = torch.randn(len(x), 1, cells, cells, generator=rng, device=x.device)
    field = functional.interpolate(drawn, x.shape[2:], mode="bicubic", align_corners=False)
    return torch.sigmoid(field)


def _grid(x, height, width):
    rows = torch.linspace(-1, 1, height, device=x.device)
    columns = torch.linspace(-1, 1, width, device=x.device)
    return torch.stack(torch.meshgrid(rows, columns, indexing="ij")[::-1], -1)[None]
