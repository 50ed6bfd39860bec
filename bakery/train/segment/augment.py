"""Crops, backgrounds, things and shadows of the training batches, all in torch on the device."""

from dataclasses import dataclass, replace

import torch
from torch.nn import functional

from bakery import landmarks as marks
from bakery.detectors import portrait
from bakery.train.segment.bank import Pictures

FEATURES = (marks.OVAL, *marks.EYES, marks.BROW_LEFT, marks.BROW_RIGHT, marks.LIPS)
ERROR = 0.022  # of the eye distance: how far the detector puts a feature aside


@dataclass(frozen=True)
class Batch:
    """What a step learns from; S is `portrait.SIDE`."""

    image: torch.Tensor  # [B, 3, S, S] float 0..1
    label: torch.Tensor  # [B, S, S] int64
    shadow: torch.Tensor  # [B, S, S] int64 0, 1, UNSURE
    person: torch.Tensor  # [B, S, S] int64 0, 1, UNSURE
    points: torch.Tensor  # [B, 478, 2] pixels, as a detector would find them


def normal(like, *shape):
    """Normal numbers on the device of `like`."""
    return torch.randn(*shape, device=like.device)


def uniform(like, low, high, *shape):
    """Even numbers from `low` to `high` on the device of `like`."""
    return low + (high - low) * torch.rand(*shape, device=like.device)


def chance(like, share, count):
    """True [count, 1, 1, 1] with a probability."""
    return torch.rand(count, 1, 1, 1, device=like.device) < share


def found(points: torch.Tensor) -> torch.Tensor:
    """Points [B, 478, 2] as a detector would find them: features put aside and grown a little."""
    count = len(points)
    unit = (points[:, marks.LEFT_EYE_OUTER] - points[:, marks.RIGHT_EYE_OUTER]).norm(dim=-1)
    unit = unit[:, None, None]
    out = points + 0.006 * unit * normal(points, *points.shape)
    for rows in FEATURES:
        own = out[:, rows]
        middle = own.mean(1, keepdim=True)
        grown = 1 + 0.04 * normal(points, count, 1, 2)
        shift = ERROR * unit * normal(points, count, 1, 2)
        out[:, rows] = middle + (own - middle) * grown + shift
    return out


def crop_matrices(points: torch.Tensor, jitter: float = 1.0) -> torch.Tensor:
    """`portrait.crop_matrix` of points [B, 478, 2] as [B, 2, 3], off by `jitter` times the usual."""
    count = len(points)
    across = points[:, marks.LEFT_EYE_OUTER] - points[:, marks.RIGHT_EYE_OUTER]
    roll = torch.atan2(across[:, 1], across[:, 0])
    upright = points @ _turn(-roll).transpose(1, 2)
    low, high = upright.amin(1), upright.amax(1)
    size = (high - low).amax(1)
    middle = (low + high) / 2
    scale = portrait.SIDE / (size * portrait.MARGIN)
    scale = scale * torch.exp(0.09 * jitter * normal(points, count))
    extra = _turn(0.07 * jitter * normal(points, count))
    shift = portrait.SIDE * 0.025 * jitter * normal(points, count, 2)
    shift[:, 1] += portrait.UP * portrait.SIDE / portrait.MARGIN
    linear = extra @ _turn(-roll) * scale[:, None, None]
    moved = (extra @ middle[..., None])[..., 0] * scale[:, None]
    offset = portrait.SIDE / 2 + shift - moved
    return torch.cat([linear, offset[..., None]], 2)


def _turn(angle):
    c, s = torch.cos(angle), torch.sin(angle)
    return torch.stack([torch.stack([c, -s], -1), torch.stack([s, c], -1)], -2)


def cut(pictures: Pictures, backdrops: torch.Tensor, jitter: float = 1.0) -> Batch:
    """Crops as the network sees them, painted people before other backgrounds, half of them mirrored.

    Args:
        pictures: the batch's own, see `Pictures.rows`.
        backdrops: [B, 3, S, S] uint8, shown where `alpha` is below 255.
        jitter: of the frame; 0 for measuring.
    """
    side, points = portrait.SIDE, pictures.points
    matrix = crop_matrices(found(points) if jitter else points, jitter)
    linear = torch.linalg.inv_ex(matrix[:, :, :2])[0]  # `inv` waits for the device
    back = torch.cat([linear, -linear @ matrix[:, :, 2:]], 2)
    axis = torch.arange(side, device=points.device) + 0.5
    y, x = torch.meshgrid(axis, axis, indexing="ij")
    place = torch.stack([x, y, torch.ones_like(x)], -1).view(-1, 3)
    grid = (place @ back.transpose(1, 2)).view(-1, side, side, 2) * (2 / side) - 1
    soft = torch.cat([pictures.image, pictures.alpha[:, None]], 1).float() / 255
    soft = functional.grid_sample(soft, grid, "bilinear", "border", align_corners=False)
    hard = torch.stack([pictures.label, pictures.shadow, pictures.person], 1).float()
    hard = functional.grid_sample(hard, grid, "nearest", "border", align_corners=False)
    outside = (grid.abs() > 1).any(-1)[:, None]
    hard = hard.masked_fill(outside, portrait.UNSURE).long()
    image, alpha = soft[:, :3], soft[:, 3:]
    image = image * alpha + backdrops.float() / 255 * (1 - alpha)
    points = points @ matrix[:, :, :2].transpose(1, 2) + matrix[:, None, :, 2]
    label, shadow, person = hard.unbind(1)
    return Batch(image, label, shadow, person, found(points) if jitter else points)


def mirrored(batch: Batch) -> Batch:
    """Half of the batch mirrored. Points keep their numbers: outlines are the same from both ends."""
    which = torch.rand(len(batch.image), device=batch.image.device) < 0.5
    planes = {
        name: torch.where(which.view(-1, *[1] * (plane.ndim - 1)), plane.flip(-1), plane)
        for name in ("image", "label", "shadow", "person")
        for plane in [getattr(batch, name)]
    }
    other = batch.points * batch.points.new_tensor([-1, 1]) + batch.points.new_tensor(
        [portrait.SIDE, 0]
    )
    return Batch(**planes, points=torch.where(which[:, None, None], other, batch.points))


def skin_of(batch: Batch) -> torch.Tensor:
    """Mean colour [B, 3, 1, 1] of each picture's skin."""
    skin = (batch.label == portrait.SKIN)[:, None].float()
    return (batch.image * skin).sum((2, 3), keepdim=True) / (skin.sum((2, 3), keepdim=True) + 1)


def backdrops_for(pictures: Pictures, bank: torch.Tensor) -> torch.Tensor:
    """Backgrounds [B, 3, S, S] uint8 for pictures: mirrored, zoomed, some as plain as a studio's or
    of the colour of skin."""
    count = len(pictures)
    at = torch.randint(len(bank), (count,), device=bank.device)
    out = bank[at].float()
    zoom = uniform(out, 0.25, 1.0, count)
    theta = torch.zeros(count, 2, 3, device=out.device)
    theta[:, 0, 0] = zoom * torch.where(torch.rand_like(zoom) < 0.5, -1, 1)
    theta[:, 1, 1] = zoom
    theta[:, :, 2] = (1 - zoom)[:, None] * uniform(out, -1, 1, count, 2)
    grid = functional.affine_grid(theta, list(out.shape), align_corners=False)
    out = functional.grid_sample(out, grid, "bilinear", "reflection", align_corners=False)
    plain = torch.where(chance(out, 0.4, count), uniform(out, 0.0, 0.4, count, 1, 1, 1), 1.0)
    color = uniform(out, 0, 255, count, 3, 1, 1)
    own = (
        pictures.image[:, :, portrait.SIDE // 2 :: 8, portrait.SIDE // 3 :: 8]
        .float()
        .mean((2, 3), True)
    )
    color = torch.where(chance(out, 0.3, count), own, color)
    return (color + (out - color) * plain).clamp(0, 255).to(torch.uint8)


def with_things(batch: Batch, textures: torch.Tensor, share: float) -> Batch:
    """Bars and balls before the picture, of skin, of plain colour or textured: class "thing".

    Args:
        textures: [B, 3, S, S] uint8.
        share: of the pictures that get one.
    """
    image, side = batch.image, portrait.SIDE
    count = len(image)
    axis = torch.arange(side, device=image.device) + 0.5
    a, b = uniform(image, 0.1, 0.9, 2, count, 2) * side
    b = torch.where(torch.rand(count, 1, device=image.device) < 0.3, a + 1, b)
    radius = uniform(image, 0.02, 0.11, count, 1, 1) * side
    along = b - a
    px, py = axis[None, None, :] - a[:, :1, None], axis[None, :, None] - a[:, 1:, None]
    length = (along * along).sum(1)[:, None, None] + 1e-3
    t = ((px * along[:, :1, None] + py * along[:, 1:, None]) / length).clamp(0, 1)
    away = torch.hypot(px - t * along[:, :1, None], py - t * along[:, 1:, None])
    inside = (radius - away + 0.5).clamp(0, 1)[:, None] * chance(image, share, count)
    color = uniform(image, 0, 1, count, 3, 1, 1)
    color = torch.where(chance(image, 0.5, count), skin_of(batch), color)
    look = torch.where(chance(image, 0.3, count), textures.float() / 255, color)
    look = look * (1.05 - 0.5 * (away / radius).clamp(0, 1) ** 2)[:, None]
    out = image + (look - image) * inside
    covered = inside[:, 0] > 0.5
    return replace(
        batch,
        image=out,
        label=batch.label.masked_fill(covered, portrait.THING),
        shadow=batch.shadow.masked_fill(covered, 0),
        person=batch.person.masked_fill(covered, 1),
    )


def with_shadows(batch: Batch, share: float) -> Batch:
    """Hard shadows painted over the person: bars, halves and leaves, darker and a little bluer.

    Args:
        share: of the pictures that get one.
    """
    image, side = batch.image, portrait.SIDE
    count = len(image)
    axis = torch.arange(side, device=image.device) / side - 0.5
    angle = uniform(image, 0, torch.pi, count, 1, 1)
    u = torch.cos(angle) * axis[None, None, :] + torch.sin(angle) * axis[None, :, None]
    bars = torch.sin(u * uniform(image, 12, 60, count, 1, 1) + uniform(image, 0, 6, count, 1, 1))
    half = (u - uniform(image, -0.25, 0.25, count, 1, 1)) * 20
    cells = int(torch.randint(3, 9, (1,)))
    leaves = functional.interpolate(
        normal(image, count, 1, cells, cells), (side, side), mode="bicubic"
    )[:, 0]
    kind = torch.rand(count, 1, 1, device=image.device)
    field = torch.where(kind < 0.3, bars, torch.where(kind < 0.6, half, leaves - 0.3))
    hard = torch.exp(uniform(image, 1.0, 3.5, count, 1, 1))
    mask = torch.sigmoid(field * hard)[:, None]
    on = chance(image, share, count)
    body = (batch.person == 1)[:, None]
    dark = uniform(image, 0.22, 0.6, count, 1, 1, 1) * torch.exp(
        0.06 * normal(image, count, 3, 1, 1)
    )
    amount = mask * on * body
    out = image * (1 + (dark - 1) * amount)
    some = (amount[:, 0] > 0.15) & (batch.label != portrait.BACKGROUND)
    whole = amount[:, 0] > 0.75
    shaded = torch.where(whole, 1, portrait.UNSURE)
    free = torch.isin(
        batch.label,
        torch.tensor(
            [portrait.HAIR, portrait.BEARD, portrait.BROWS, portrait.UNSURE], device=image.device
        ),
    )
    shaded = shaded.masked_fill(free, portrait.UNSURE)
    return replace(batch, image=out, shadow=torch.where(some, shaded, batch.shadow))


def dressed(batch: Batch, textures: torch.Tensor, share: float, painted: int) -> Batch:
    """Painted clothes as jackets over shirts and ties, of any colour and texture, in their own light.

    Args:
        textures: [B, 3, S, S] uint8.
        share: of the painted pictures that change.
        painted: how many these are; the rest of the batch stays.
    """
    image, points = batch.image, batch.points
    count = len(image)
    cloth = (batch.label == portrait.CLOTH)[:, None].float()
    light = image.mean(1, keepdim=True)
    mean = (light * cloth).sum((2, 3), keepdim=True) / (cloth.sum((2, 3), keepdim=True) + 1)
    shade = (light / (mean + 0.03)).clamp(0.2, 2.2)
    unit = (points[:, marks.LEFT_EYE_OUTER] - points[:, marks.RIGHT_EYE_OUTER]).norm(dim=-1)
    axis = torch.arange(portrait.SIDE, device=image.device) + 0.5
    x = ((axis - points[:, 152, :1]) / unit[:, None])[:, None, None, :]
    y = ((axis - points[:, 152, 1:]) / unit[:, None])[:, None, :, None]
    open_at = uniform(image, 0.4, 1.0, count, 1, 1, 1)
    deep = uniform(image, 0.6, 3.0, count, 1, 1, 1) * chance(image, 0.7, count)
    shirt = x.abs() < open_at * (1 - y / deep.clamp(min=0.01))
    wide = uniform(image, 0.06, 0.2, count, 1, 1, 1) * chance(image, 0.6, count)
    tie = shirt & (x.abs() < wide)
    colors = uniform(image, 0.02, 1, 3, count, 3, 1, 1) ** 1.5
    pattern = textures.float() / 255
    strength = uniform(image, 0, 0.9, 3, count, 1, 1, 1) * (
        torch.rand(3, count, 1, 1, 1, device=image.device) < 0.4
    )
    jacket, linen, silk = (c + (pattern - c) * s for c, s in zip(colors, strength))
    linen = torch.where(chance(image, 0.4, count), linen * 0.2 + 0.75, linen)
    look = torch.where(tie, silk, torch.where(shirt, linen, jacket)) * shade
    on = cloth * chance(image, share, count)
    on[painted:] = 0
    return replace(batch, image=image + (look.clamp(0, 1) - image) * on)
