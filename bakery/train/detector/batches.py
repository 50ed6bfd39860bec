"""Batches for the detector's networks, cut from a bank on the device that trains.

Places in a picture or crop are in sides from its middle, x to the right, y down.
"""

import zipfile

import numpy as np
import torch
from torch.nn import functional

from bakery import landmarks as marks
from bakery.detectors import closeups, frames
from bakery.detectors.blocks import PointsNet
from bakery.train import degrade
from bakery.train.detector import bank
from bakery.train.faces import mirror_order

WEIGHTS = {"photo": 0.7, "quick": 0.2, "careful": 0.1}  # shares of a batch
INSIDE = 0.95  # of a close-up in which points of the mean head are looked for


class Bank:
    """The shards of a bank that exist by now, in the memory of a device."""

    def __init__(self, folder, kinds, device):
        self.folder, self.device = folder, device
        self.arrays = {kind: {} for kind in kinds}  # kind -> array name -> tensor
        self.filled = dict.fromkeys(kinds, 0)
        self.seen = set()

    def refresh(self, room):
        """Read shards that were not read yet.

        Args:
            room: kind -> pictures that there will be at most.

        Returns:
            how many pictures there are.
        """
        for kind, arrays in self.arrays.items():
            for path in sorted(self.folder.glob(f"{kind}-*.npz")):
                if path in self.seen:
                    continue
                self.seen.add(path)
                try:
                    with np.load(path) as file:
                        found = {name: file[name] for name in file.files}
                except (zipfile.BadZipFile, ValueError, OSError):
                    continue
                start = self.filled[kind]
                for name, value in found.items():
                    if name not in arrays:
                        shape = (room[kind] + bank.SHARD[kind], *value.shape[1:])
                        kept = torch.from_numpy(value[:0]).dtype
                        arrays[name] = torch.empty(shape, dtype=kept, device=self.device)
                    arrays[name][start : start + len(value)] = torch.from_numpy(value)
                self.filled[kind] = start + len(value)
        return sum(self.filled.values())

    def draw(self, count, rng, present_only=False):
        """Random pictures of the kinds by `WEIGHTS`.

        Returns:
            pictures [B, S, S, 3] uint8, points [B, 478, 2], present [B] float, painted [B] float.
        """
        shares = {k: WEIGHTS[k] for k, n in self.filled.items() if n and k in WEIGHTS}
        total, parts, left = sum(shares.values()), [], count
        for position, (kind, share) in enumerate(shares.items()):
            some = left if position == len(shares) - 1 else round(count * share / total)
            left -= some
            arrays = self.arrays[kind]
            rows = self._rows(arrays, kind, some, rng, present_only)
            painted = torch.full((some,), float(kind != "photo"), device=self.device)
            present = arrays["present"][rows].float()
            parts.append((arrays["pictures"][rows], arrays["points"][rows], present, painted))
        return tuple(torch.cat(part) for part in zip(*parts))

    def _rows(self, arrays, kind, count, rng, present_only):
        limit = self.filled[kind]
        choice = torch.nonzero(arrays["present"][:limit])[:, 0] if present_only else None
        limit = len(choice) if present_only else limit
        rows = torch.randint(limit, (count,), generator=rng, device=self.device)
        return choice[rows] if present_only else rows


class Photos:
    """Held-out photographs, drawn from as from a `Bank`."""

    def __init__(self, pictures, points, device):
        """pictures: [n, S, S, 3] uint8, points [n, 478, 2], as `bank.held_bases` gives them."""
        self.pictures = torch.from_numpy(pictures).to(device)
        self.points = torch.from_numpy(points).to(device)

    def draw(self, count, rng, present_only=False):
        """See `Bank.draw`; all are photographs of a face."""
        device = self.pictures.device
        rows = torch.randint(len(self.pictures), (count,), generator=rng, device=device)
        ones = torch.ones(count, device=device)
        return self.pictures[rows], self.points[rows], ones, torch.zeros_like(ones)


def transform(angle, scale, shift, mirrored=None):
    """Affine maps [B, 2, 3] from crop to picture: turned, `scale` times as large, moved.

    Args:
        angle [B] radians, scale [B], shift [B, 2]; mirrored [B] bool.
    """
    c, s = torch.cos(angle) * scale, torch.sin(angle) * scale
    sign = 1 - 2 * mirrored.float() if mirrored is not None else torch.ones_like(c)
    linear = torch.stack([torch.stack([c * sign, -s], -1), torch.stack([s * sign, c], -1)], -2)
    return torch.cat([linear, shift[..., None]], -1)


def into(maps, points):
    """Points [B, n, 2] of pictures in the crops of `transform`."""
    inverse = torch.linalg.inv(maps[:, :, :2])
    return (points - maps[:, None, :, 2]) @ inverse.transpose(1, 2)


def cut(pictures, maps, side):
    """Crops [B, 3, side, side] float 0..1 of pictures [B, S, S, 3] uint8, grey outside."""
    planes = pictures.permute(0, 3, 1, 2).float().sub_(frames.PADDING)
    theta = maps.clone()
    theta[:, :, 2] *= 2  # places are sides from the middle; the sampler's square is 2 wide
    grid = functional.affine_grid(theta, (len(maps), 3, side, side), align_corners=False)
    found = functional.grid_sample(planes, grid, align_corners=False)
    return (found + frames.PADDING) / 255


class PointsBatches:
    """Crops of whole faces as the finder or a first look frames them."""

    def __init__(self, order):
        """order: [478] which point takes whose place in the mirror."""
        self.order = torch.as_tensor(order)

    def make(self, source, count, rng):
        """image [B, 3, 128, 128], target [B, 478, 2], present [B], painted [B]."""
        pictures, points, present, painted = source.draw(count, rng)
        device = pictures.device

        def normal(*shape):
            return torch.randn(count, *shape, generator=rng, device=device)

        def chance(share):
            return torch.rand(count, generator=rng, device=device) < share

        near = torch.where(chance(0.4), 1.0, 0.3)  # first and second look
        angle = normal() * near * np.radians(9)
        angle += chance(0.15) * (torch.rand(count, generator=rng, device=device) - 0.5) * 1.2
        scale = torch.exp(normal() * 0.12 * near) * frames.CROP_MARGIN / bank.MARGIN
        shift = normal(2) * 0.06 * near[:, None] * scale[:, None]
        wrong = chance(0.06)  # at another place or size: not the face that this crop is about
        far = torch.where(chance(0.5), 0.35, 2.6)
        scale = torch.where(wrong, scale * far, scale)
        angle = torch.where(wrong, normal() * 2, angle)
        away = functional.normalize(normal(2), dim=1) * 0.5
        shift = torch.where((wrong & (far < 1))[:, None], away, shift)
        mirrored = chance(0.5)
        maps = transform(angle, scale, shift, mirrored)
        image = degrade.photograph(cut(pictures, maps, PointsNet.crop_size), rng)
        order = self.order.to(device)
        target = into(maps, points)
        target = torch.where(mirrored[:, None, None], target[:, order], target)
        return image, target, present * (~wrong), painted


class CloseupBatches:
    """Crops of eyes or mouth as the points network's answer frames them."""

    def __init__(self, name, head):
        """name: "eye" or "mouth"."""
        self.name = name
        self.side = closeups.SIDES[name]
        eyes, mouth = rows_seen(head)
        self.rows = torch.as_tensor(eyes if name == "eye" else mouth)
        self.mirror = mirrored_rows(head, mouth[0]) if name == "mouth" else None

    def make(self, source, count, rng):
        """image [B, 3, S, S], target [B, n, 2], present [B] of ones, painted [B]."""
        pictures, points, present, painted = source.draw(count, rng, present_only=True)
        device = pictures.device

        def normal(*shape):
            return torch.randn(count, *shape, generator=rng, device=device)

        rows = self.rows.to(device)
        across = points[:, marks.LEFT_EYE_OUTER] - points[:, marks.RIGHT_EYE_OUTER]
        roll = torch.atan2(across[:, 1], across[:, 0])
        if self.name == "mouth":
            middle = points[:, marks.LIPS_OUTER].mean(1)
            size = closeups.MOUTH_SPAN * across.norm(dim=1)
            mirrored = torch.rand(count, generator=rng, device=device) < 0.5
            own = points[:, rows[0]]
        else:
            right = torch.rand(count, generator=rng, device=device) < 0.5
            ends = torch.tensor(closeups.CORNERS, device=device)[right.long()]  # [B, 2]
            outer, inner = (points[torch.arange(count, device=device), e] for e in ends.T)
            size = closeups.EYE_SPAN * (outer - inner).norm(dim=1)
            up = torch.stack([torch.sin(roll), -torch.cos(roll)], 1)
            middle = (outer + inner) / 2 + up * (closeups.EYE_LIFT / closeups.EYE_SPAN * size)[
                :, None
            ]
            mirrored = right
            seen = points.clone()
            for iris in (marks.LEFT_IRIS, marks.RIGHT_IRIS):
                seen[:, iris] = points[:, iris].mean(1, keepdim=True)
            own = torch.gather(seen, 1, rows[right.long()][..., None].expand(-1, -1, 2))
        tail = torch.where(torch.rand(count, generator=rng, device=device) < 0.15, 2.5, 1.0)
        angle = roll + normal() * 0.06
        scale = size * torch.exp(normal() * 0.06)
        shift = middle + normal(2) * 0.03 * (tail * size)[:, None]
        maps = transform(angle, scale, shift, mirrored)
        image = degrade.photograph(cut(pictures, maps, self.side), rng)
        target = into(maps, own)
        if self.mirror is not None:
            turned = target[:, torch.as_tensor(self.mirror, device=device)]
            target = torch.where(mirrored[:, None, None], turned, target)
        return image, target, present, painted


class SceneBatches:
    """Small pictures with any number of faces, for the finder."""

    def make(self, source, count, rng):
        """image [B, 3, 192, 192], target [B, 8, 24, 24]."""
        arrays = source.arrays["scene"]
        limit = source.filled["scene"]
        rows = torch.randint(limit, (count,), generator=rng, device=source.device)
        image = arrays["pictures"][rows].permute(0, 3, 1, 2).float() / 255
        return degrade.photograph(image, rng), arrays["targets"][rows].float()


def rows_seen(head):
    """The points that lie in the crops of the mean head: eyes [2, n] (left, right), mouth [1, m].

    The right eye's are the counterparts of the left's.
    """
    points = head.landmarks(head.mean)
    order = mirror_order(points[None])
    flat = points[:, :2] * [1, -1]

    def within(frame):
        return np.abs(flat - frame.center).max(1) < 0.5 * INSIDE * frame.size

    skin = np.arange(len(flat)) < marks.FACE
    mouth = within(closeups.mouth_frame(flat)) & skin
    left = np.append(
        np.flatnonzero(within(closeups.eye_frames(flat)[0]) & skin), marks.LEFT_IRIS.start
    )
    right = np.append(order[left[:-1]], marks.RIGHT_IRIS.start)
    return np.stack([left, right]), np.flatnonzero(mouth & mouth[order])[None]


def mirrored_rows(head, rows):
    """Which of the points in `rows` [n] takes whose place in the mirror [n]."""
    order = mirror_order(head.landmarks(head.mean)[None])
    place = {int(row): number for number, row in enumerate(rows)}
    return np.array([place[int(order[row])] for row in rows])
