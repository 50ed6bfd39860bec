"""The segmentation network: classes of `portrait.CLASSES` and hard cast shadow in a portrait crop."""

from collections.abc import Sequence
from functools import cache
from pathlib import Path

import cv2
import numpy as np
import torch
from safetensors.torch import load_file
from torch import nn
from torch.nn import functional

from bakery import landmarks as marks
from bakery.detectors import portrait
from bakery.detectors.blocks import Conv, Residual, added, inference, stage
from bakery.errors import ModelError, lacks_memory

# Polygons of the points that the network is shown, a channel each.
OUTLINES: tuple[Sequence[np.ndarray], ...] = (
    (marks.OVAL,),
    marks.EYES,
    (marks.BROW_LEFT, marks.BROW_RIGHT),
    (marks.LIPS_OUTER, marks.LIPS_INNER),
)
WIDTHS = (16, 32, 48, 96, 128, 128)  # channels, from the whole picture to a 32nd of its side
BLOCKS = (1, 1, 2, 2, 1)  # residual blocks of each halving


class SegmentNet(nn.Module):
    """A small U-Net.

    Input [B, 3 + len(OUTLINES), S, S]: sRGB 0..1 and the `outlines` of the points, S a multiple of
    32 (`portrait.SIDE` when trained). Output: logits [B, len(CLASSES), S, S] of the classes and
    [B, S, S] of hard cast shadow.

    References:
        Ronneberger et al., "U-Net", MICCAI 2015.
    """

    def __init__(self, folded: bool = False):
        super().__init__()
        self.first = Conv(3 + len(OUTLINES), WIDTHS[0], folded=folded)
        pairs = list(zip(WIDTHS, WIDTHS[1:]))
        self.down = nn.ModuleList(
            stage(fine, coarse, blocks, folded) for (fine, coarse), blocks in zip(pairs, BLOCKS)
        )
        self.lift = nn.ModuleList(
            Conv(coarse, fine, kernel=1, active=False, folded=folded)
            for fine, coarse in reversed(pairs)
        )
        self.mix = nn.ModuleList(
            Conv(fine, fine, folded=folded) if fine <= WIDTHS[1] else Residual(fine, folded)
            for fine, _ in reversed(pairs)
            if fine != WIDTHS[4]
        )
        self.head = nn.Conv2d(WIDTHS[0], len(portrait.CLASSES) + 1, 1)

    def forward(self, x: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        x = self.first(x - 0.5)
        seen = []
        for down in self.down:
            seen.append(x)
            x = down(x)
        mixes = [nn.Identity(), *self.mix]
        for lift, mix, fine in zip(self.lift, mixes, reversed(seen)):
            x = added(functional.interpolate(lift(x), scale_factor=2, mode="nearest"), fine)
            x = mix(x)
        out = self.head(x)
        return out[:, :-1], out[:, -1]


def outlines(points: torch.Tensor, side: int = portrait.SIDE) -> torch.Tensor:
    """The polygons of the points as pictures.

    Args:
        points: [B, 478, 2] pixels of the crop.
        side: S, pixels of the crop.

    Returns:
        [B, len(OUTLINES), S, S] 0..1; half as fine as the crop, and the lips 0.5 around the mouth.
    """
    half = side // 2
    grid = torch.arange(half, device=points.device, dtype=points.dtype) + 0.5
    planes = []
    for rings in OUTLINES:
        inside = [
            _fill(points[:, torch.as_tensor(ring, device=points.device)] / 2, grid)
            for ring in rings
        ]
        planes.append(sum(inside) / 2 if rings[0] is marks.LIPS_OUTER else sum(inside).clamp(max=1))
    return functional.interpolate(
        torch.stack(planes, 1), size=(side, side), mode="bilinear", align_corners=False
    )


def _fill(ring, grid):
    """Even-odd inside [B, H, H] of polygons [B, n, 2]."""
    after = ring.roll(-1, 1)
    x, y = ring[..., :1], ring[..., 1:]
    x2, y2 = after[..., :1], after[..., 1:]
    crosses = (y > grid) != (y2 > grid)  # [B, n, rows]
    step = torch.where((y2 - y).abs() < 1e-6, torch.ones_like(y), y2 - y)
    at = torch.where(
        crosses, x + (grid - y) / step * (x2 - x), torch.full_like(crosses, -1e6, dtype=x.dtype)
    )
    # Every crossing turns what lies left of it inside out.
    place = torch.searchsorted(grid, at.contiguous()).transpose(1, 2)  # [B, rows, n]
    turns = torch.zeros(*place.shape[:2], len(grid) + 1, dtype=ring.dtype, device=ring.device)
    turns.scatter_add_(2, place, torch.ones_like(place, dtype=ring.dtype))
    left = turns[..., 1:].flip(2).cumsum(2).flip(2)  # [B, rows, columns]
    return left % 2


def load(path: Path) -> SegmentNet:
    """The network of a file that `train.segment.export` wrote, ready to be used.

    Raises:
        ModelError: the file is missing or holds something else.
    """
    network = SegmentNet(folded=True)
    try:
        network.load_state_dict({k: v.float() for k, v in load_file(path).items()})
    except Exception as error:  # safetensors and torch raise many kinds
        if lacks_memory(error):
            raise
        text = str(error).splitlines()[0]
        raise ModelError(
            f"{path}: no weights of the segmentation network ({text}); reinstall bakery, or go by "
            "colours: --set segment.method=colours"
        ) from None
    return network.eval().to(memory_format=torch.channels_last)


@cache
def shipped() -> SegmentNet:
    """The network with the weights that ship.

    Raises:
        ModelError: they are missing or damaged.
    """
    return load(portrait.WEIGHTS)


def segment(network: SegmentNet, image: np.ndarray, points: np.ndarray):
    """Label a photo.

    Args:
        network: from `load`.
        image: [H, W, 3] uint8 sRGB.
        points: [478, 2+] pixels.

    Returns:
        shares [15, S, S] float32 of the classes, shadow [S, S] float32 0..1, and the [2, 3] affine
        map from photo pixels to those of the crop.
    """
    matrix = portrait.crop_matrix(points)
    crop, placed = take(image, matrix), points[:, :2] @ matrix[:, :2].T + matrix[:, 2]
    with inference():
        picture = torch.from_numpy(crop).permute(2, 0, 1)[None].float() / 255
        shown = outlines(torch.from_numpy(np.ascontiguousarray(placed, np.float32))[None])
        stack = torch.cat([picture, shown], 1).contiguous(memory_format=torch.channels_last)
        # The mean with the mirrored crop is surer than either: log-segment.md has what it gains.
        logits, shadow = network(torch.cat([stack, stack.flip(3)]))
        shares, dark = (
            ((plane[0] + plane[1].flip(-1)) / 2).numpy()
            for plane in (logits.softmax(1), shadow.sigmoid())
        )
        return shares, dark, matrix


def take(image: np.ndarray, matrix: np.ndarray, side: int = portrait.SIDE, nearest: bool = False):
    """Resample a picture [H, W, ...] into a crop [side, side, ...], edges carried on outside.

    Args:
        matrix: [2, 3] from picture pixels to those of the crop.
        nearest: for labels.
    """
    scale = float(np.sqrt(abs(np.linalg.det(matrix[:, :2]))))
    if scale < 0.7 and not nearest:  # averaged where it shrinks much
        size = [max(1, round(n * scale * 1.2)) for n in image.shape[1::-1]]
        ratio = np.array(image.shape[1::-1]) / size
        image = cv2.resize(image, size, interpolation=cv2.INTER_AREA)
        matrix = np.column_stack([matrix[:, :2] * ratio, matrix[:, 2]])
    shifted = matrix.copy()
    shifted[:, 2] += matrix[:, :2].sum(1) * 0.5 - 0.5  # OpenCV puts pixel centres at integers
    flags = cv2.INTER_NEAREST if nearest else cv2.INTER_LINEAR
    return cv2.warpAffine(
        image, shifted, (side, side), flags=flags, borderMode=cv2.BORDER_REPLICATE
    )
