"""What the detector's networks are trained to make small. Plain functions of torch tensors."""

from dataclasses import dataclass

import torch
from torch.nn import functional

from bakery.landmarks import (
    LIPS_INNER_LOWER,
    LIPS_INNER_UPPER,
    MOUTH_CORNERS,
)

LIPS = 0.5  # weight of what is wrong about the lips
TOUCH = 0.02  # of the mouth's width: lips that are nearer touch
CONTACT = 2.0  # what an opening counts where lips touch


def points_loss(output, target, present, importance=None, lips=None):
    """Loss of the points network and of the close-ups.

    The points see their plain distance. The expected error is trained beside it as the scale b of
    an exponential distribution of that distance, -log p = distance / b + log b, which leaves the
    points alone: hidden points would otherwise be given up as soon as their scale grows.

    Args:
        output: points [B, n, 2], log scale [B, n], and of `PointsNet` presence logit [B].
        target: [B, n, 2], present [B] 0 or 1.
        importance: [n] what each point counts, 1 on average; None: all alike.
        lips: `LipRows`, or None where there are none.

    Returns:
        scalar loss, dict of its parts (detached scalars)
    """
    points, log_scale = output[:2]
    distances = torch.sqrt(((points - target) ** 2).sum(-1) + 1e-12)
    share = present / present.sum().clamp_min(1)
    weighted = distances if importance is None else distances * importance
    near = (weighted.mean(1) * share).sum()
    spread = distances.detach() * torch.exp(-log_scale) + log_scale
    spread = (spread.mean(1) * share).sum()
    parts = {"distance": near, "spread": spread}
    loss = near + 0.002 * spread
    if lips is not None:
        parts["lips"] = (lip_errors(points, target, lips) * share).sum()
        loss = loss + LIPS * parts["lips"]
    if len(output) == 3:
        face = functional.binary_cross_entropy_with_logits(output[2], present)
        parts["presence"] = face
        loss = loss + 0.02 * face
    return loss, {name: value.detach() for name, value in parts.items()}


@dataclass(frozen=True)
class LipRows:
    """Where the lips' rims stand among the points of a network."""

    upper: tuple[int, ...]  # inner rim, corner to corner
    lower: tuple[int, ...]
    corners: tuple[int, int]

    @classmethod
    def among(cls, rows):
        """rows: [n] which of the 478 the network gives."""
        place = {int(row): i for i, row in enumerate(rows)}

        def find(wanted):
            return tuple(place[int(row)] for row in wanted)

        return cls(find(LIPS_INNER_UPPER[1:-1]), find(LIPS_INNER_LOWER[1:-1]), find(MOUTH_CORNERS))


def lip_errors(points, target, lips):
    """What points say wrongly about opening, contact and width of the mouth [B], crop sides.

    Distances of single points hide it: two rims a percent off in opposite directions part shut
    lips by two. The opening is compared column by column, with its sign; where lips touch (less
    than `TOUCH` of the mouth's width) the error counts `CONTACT` times.

    Args:
        points, target: [B, n, 2].
    """

    def parts(shape):
        corners = shape[:, lips.corners[1]] - shape[:, lips.corners[0]]
        width = corners.norm(dim=-1).clamp_min(1e-3)
        along = corners / width[:, None]
        down = torch.stack([-along[:, 1], along[:, 0]], -1)
        gap = ((shape[:, list(lips.lower)] - shape[:, list(lips.upper)]) * down[:, None]).sum(-1)
        return gap, width

    gap, width = parts(points)
    true_gap, true_width = parts(target)
    touching = true_gap < TOUCH * true_width[:, None]
    weight = torch.where(touching, CONTACT, 1.0)
    opening = ((gap - true_gap).abs() * weight).mean(1)
    return opening + 0.5 * (width - true_width).abs()


def finder_loss(output, target):
    """Loss of the finder: focal loss of the score, L1 of position, size and roll.

    Args:
        output: [B, 6, G, G] of `FinderNet`.
        target: [B, 8, G, G] of `dataset.finder_target`.

    Returns:
        scalar loss, dict of its parts (floats)

    References:
        Law and Deng, "CornerNet: Detecting Objects as Paired Keypoints", ECCV 2018, eq. 1.
    """
    output = output.float()
    logit, truth, weight = output[:, 0], target[:, 0], target[:, 7]
    score = torch.sigmoid(logit)
    peak = (truth > 0.99).float()
    found = -functional.logsigmoid(logit) * (1 - score) ** 2 * peak
    empty = -functional.logsigmoid(-logit) * score**2 * (1 - truth) ** 4 * (1 - peak)
    count = peak.sum().clamp_min(1)
    heat = ((found + empty) * weight).sum() / count
    core = target[:, 6]
    differences = (output[:, 1:6] - target[:, 1:6]).abs()
    scales = torch.tensor([1.0, 1.0, 2.0, 2.0, 2.0], device=output.device)[None, :, None, None]
    place = (differences * scales).sum(1)
    place = (place * core).sum() / core.sum().clamp_min(1)
    return heat + place, {"heat": heat.detach(), "place": place.detach()}
