"""What the detector's networks are trained to make small. Plain functions of torch tensors."""

import torch
from torch.nn import functional

from bakery.landmarks import LEFT_EYE_OUTER, RIGHT_EYE_OUTER


def point_errors(points, target):
    """Distance of each point from its target over the eye distance.

    Args:
        points, target: [B, 478, 2], any one unit.

    Returns:
        distances [B, 478] in outer-eye-corner distances, eye distance [B, 1] in the unit given
    """
    across = target[:, LEFT_EYE_OUTER] - target[:, RIGHT_EYE_OUTER]
    eyes = across.norm(dim=-1).clamp_min(0.05)[:, None]
    return torch.sqrt(((points - target) ** 2).sum(-1) + 1e-12) / eyes, eyes


def points_loss(output, target, present):
    """Loss of the points network.

    The points see their plain distance. The expected error is trained beside it as the scale b of
    an exponential distribution of that distance, -log p = distance / b + log b, which leaves the
    points alone: hidden points would otherwise be given up as soon as their scale grows.

    Args:
        output: points [B, 478, 2], log scale [B, 478], presence logit [B], of `PointsNet`.
        target: [B, 478, 2], present [B] 0 or 1.

    Returns:
        scalar loss, dict of its parts (floats)
    """
    points, log_scale, logit = output
    distances, eyes = point_errors(points, target)
    share = present / present.sum().clamp_min(1)
    near = (distances.mean(1) * share).sum()
    residual = (distances * eyes).detach()
    spread = residual * torch.exp(-log_scale) + log_scale
    spread = (spread.mean(1) * share).sum()
    face = functional.binary_cross_entropy_with_logits(logit, present)
    parts = {"distance": near.item(), "spread": spread.item(), "presence": face.item()}
    return 10 * near + 0.05 * spread + 0.2 * face, parts


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
    scales = torch.tensor([1.0, 1.0, 2.0, 2.0, 2.0])[None, :, None, None]
    place = (differences * scales).sum(1)
    place = (place * core).sum() / core.sum().clamp_min(1)
    return heat + place, {"heat": heat.item(), "place": place.item()}
