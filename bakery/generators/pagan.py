"""The trained generator of paGAN section 4, forward only.

One network paints everything: whole frames for the key expressions, crops for eyes and mouths. It
is fully convolutional and its normalisation is folded, so a crop agrees with the frame as far as the
crop has surroundings.
"""

import json
from copy import deepcopy
from pathlib import Path

import cv2
import numba
import numpy as np
import torch
from torch.nn import functional

from bakery.errors import ModelError
from bakery.formats.files import digest_file
from bakery.generators import expected_folds
from bakery.generators.base import Subject
from bakery.generators.channels import NONE, condition_channels, expression_channels
from bakery.generators.eyes import with_photographed_eyes
from bakery.generators.fold_maps import TINT, FoldMaps
from bakery.generators.interior import (
    EDGES,
    FRAME_SCALE,
    GAPS,
    RELIEF,
    interior_shade,
    teeth_relief,
    teeth_toned,
)
from bakery.generators.lids import with_lids
from bakery.generators.shade import BLUR, EYES, is_part
from bakery.generators.unet import NetworkOptions, UNet, byte_range, input_channels, parts_of
from bakery.geometry import camera as cameras
from bakery.geometry.fill import around
from bakery.heads.base import MOUTH
from bakery.landmarks import FACE
from bakery.paths import ASSETS
from bakery.types import Conditions, Generated

WEIGHTS = ASSETS / "generators" / "pagan.safetensors"
KIND = "bakery generator 1"  # says in a file's metadata what it is
# Lines that the rendered generator draws: smiles do not make them, and of brows that rise or frown the
# network has seen painted people alone, too few (2,000 steps leave a forehead nearly smooth).
BORROWED = ("forehead", "glabella")
NOMINAL = (
    FRAME_SCALE * 512
)  # pixels a mm of a frame of 512 pixels, at which the network was trained
ZOOMS = (0.87, 1.15)  # scales over NOMINAL that are taken as they are; training varied them by 12%
ROUNDED = 0.02  # of a side by which a picture that is resized anyway may be off to need no padding
# Pixels around eyes and mouth that are painted with them: who samples them blurs a little.
BESIDE = 8
PHOTO_RATIO = 0.78  # of the side of Subject.photo that the height of the landmarks takes


class PaganGenerator:
    """See the module; one instance serves any number of subjects."""

    name = "pagan"
    source_type = "compositeWithTrainedAlgorithmicMedia"

    def __init__(self, network, half=None, sha256=""):
        """Wrap a folded network.

        Args:
            network: UNet built with `folded=True`.
            half: compute in bfloat16; None: where the processor has the instructions. A timing
                could choose otherwise from run to run, and two bakes must give the same bytes.
            sha256: of the file that the weights came from.
        """
        # Pictures are painted side by side (bakery.parallel); one that is split between cores as
        # well takes 1.3 to 1.7 times the processor time.
        torch.set_num_threads(1)
        self.network, self.sha256 = network.eval(), sha256
        self._unit = 2 ** len(network.options.channels)
        self._folds = FoldMaps(BORROWED)
        half = torch.cpu._is_avx512_bf16_supported() if half is None else half
        # A copy, once: autocast rounds all weights again for each of 300 mouths.
        self._type = torch.bfloat16 if half else torch.float32
        rounded = deepcopy(network).to(self._type)
        _by_pixel(rounded.stem.conv)
        self._rounded = rounded.to(memory_format=torch.channels_last)
        zero, full = byte_range(network.options.inputs)
        self._zero, self._full = zero.repeat(4), full.repeat(4)
        self._meanings = _meanings() if half and network.options.head == "change" else None

    def get_ready(self, head):
        """See generators.base.Generator."""
        if "folds" in self.network.options.inputs:
            expected_folds.get_ready(head)

    def generate(
        self, subject: Subject, conditions: Conditions, interior_only: bool = False
    ) -> Generated:
        """Paint one target of a subject (generators.base.Generator).

        Raises:
            ValueError: the subject has no photo.
        """
        if subject.photo is None:
            raise ValueError("Subject.photo is missing; the network looks at the neutral photo")
        per_mm, window = cameras.pixels_per_mm(conditions.camera), np.s_[:, :]
        if interior_only:
            inside = is_part(conditions.part, *EYES, *MOUTH)
            if not inside.any():
                return _unchanged(conditions)
            window = around(inside, BLUR * max(RELIEF * per_mm, 0.6) + BESIDE)
        log_ratio, shade, color, alpha = self.share(subject, conditions, window)
        if not interior_only:
            skin = is_part(conditions.part, "skin")
            log_ratio += (self._folds.at(subject, conditions) * skin)[..., None] * TINT
        ratio = np.exp(log_ratio) * shade[..., None]
        if not interior_only:
            color, alpha = with_lids(subject, conditions, color, alpha)
        image = _laid(conditions.deformed_neutral[window] * ratio, color, alpha)
        if interior_only:
            return _unchanged(conditions, window, Generated(image, ratio, color, alpha))
        eyes, where = with_photographed_eyes(subject, conditions, image, per_mm)
        color, alpha = _laid(color, eyes, where), np.maximum(alpha, where)
        return Generated(_laid(image, eyes, where), ratio, color, alpha)

    def share(self, subject, conditions, window=np.s_[:, :]):
        """What the network says of a target, before folds, lids and eyes are laid over it.

        Args:
            window: slices (rows, columns) of the picture; h, w pixels.

        Returns:
            log-ratio [h, w, 3] of the skin, shade [h, w] of eyes and mouth, colour [h, w, 3], alpha [h, w].
        """
        per_mm = cameras.pixels_per_mm(conditions.camera)
        channels = condition_channels(subject.head, conditions)
        shade = interior_shade(channels, per_mm)
        expressed = expression_channels(subject, conditions, wanted=self.network.options.inputs)
        stack = input_channels(channels, aligned_photo(subject, conditions), shade, expressed)
        change = self.paint_scaled(stack, per_mm / NOMINAL)[window]
        part, shade, face = channels.part[window], shade[window], channels.face[window]
        face = face.astype(np.float32) / 255 * (part != NONE)
        relief = teeth_relief(part, shade, per_mm)
        color = change[..., 3:6] * np.exp(EDGES * relief)[..., None]
        alpha = change[..., 6] * face
        shaded = conditions.deformed_neutral[window] * shade[..., None]
        color = teeth_toned(color, alpha, shaded, part)
        return change[..., :3] * face[..., None], shade * np.exp(GAPS * relief), color, alpha

    def paint_scaled(self, channels, zoom):
        """`paint` at the scale that the network was trained at, the change resized.

        Args:
            zoom: how many times the training's scale the channels have.
        """
        height, width = channels["deformed"].shape[:2]
        if ZOOMS[0] < zoom < ZOOMS[1]:
            return self.paint(channels)
        size = (self._side(width / zoom), self._side(height / zoom))
        smooth = cv2.INTER_AREA if zoom > 1 else cv2.INTER_LINEAR
        small = {
            name: cv2.resize(channel, size, interpolation=smooth).reshape(size[1], size[0], -1)
            for name, channel in channels.items()
        }
        return cv2.resize(self.paint(small), (width, height), interpolation=cv2.INTER_LINEAR)

    def _side(self, wanted):
        """The side in pixels at which one of so many (not whole) is painted.

        A side is padded to a multiple of the network's coarsest pixel.
        """
        whole = max(round(wanted / self._unit), 1) * self._unit
        return whole if abs(whole / wanted - 1) < ROUNDED else max(round(wanted), 1)

    def paint(self, channels):
        """Run the network on channels [H, W, C] uint8 by name.

        Returns:
            [H, W, 7] float32: log-ratio, linear colour, alpha.
        """
        height, width = channels["deformed"].shape[:2]
        below, right = -height % self._unit, -width % self._unit
        stack = cv2.merge([channels[name] for name in self.network.options.inputs])
        stack = cv2.copyMakeBorder(stack, 0, below, 0, right, cv2.BORDER_CONSTANT)
        rows, columns, depth = stack.shape
        squares = stack.reshape(rows // 2, 2, columns // 2, 2, depth).transpose(0, 2, 1, 3, 4)
        squares = np.ascontiguousarray(squares).reshape(1, rows // 2, columns // 2, 4 * depth)
        with torch.inference_mode():
            x = torch.from_numpy(squares).float().sub_(self._zero).div_(self._full)
            squares = self._rounded.body(x.to(self._type).permute(0, 3, 1, 2))
            if self._meanings is None:
                parts = torch.cat(parts_of(functional.pixel_shuffle(squares, 2)), 1)[0]
                parts = parts.permute(1, 2, 0).contiguous().numpy()
            else:
                codes = squares.permute(0, 2, 3, 1)[0].contiguous().view(torch.uint16).numpy()
                parts = np.empty((rows, columns, len(self._meanings)), np.float32)
                _look_up(codes, self._meanings, parts)
        return np.ascontiguousarray(parts[:height, :width])


def _by_pixel(stem):
    """Sort the inputs of a network's first convolution by pixel of a square, not by channel.

    So a picture is cut into squares by copying whole pixels, in a tenth of `pixel_unshuffle`'s time.
    """
    weight = stem.weight.data
    stem.weight.data = weight.unflatten(1, (-1, 4)).transpose(1, 2).flatten(1, 2).contiguous()


def _meanings():
    """What `parts_of` makes of every bfloat16: [7, 65536] float32 by its bits.

    There are so few that looking them up takes a tenth of the time of tanh, sigmoid and power.
    """
    every = torch.arange(1 << 16, dtype=torch.int32).to(torch.uint16).view(torch.bfloat16)
    return torch.cat(parts_of(every.expand(1, 7, 1, -1)), 1)[0, :, 0].numpy().copy()


@numba.njit(cache=True, nogil=True)
def _look_up(codes, meanings, out):
    """`pixel_shuffle` of bits [h, w, 4 C], and what each means, into [2 h, 2 w, C]."""
    for y in range(codes.shape[0]):
        for x in range(codes.shape[1]):
            for c in range(out.shape[2]):
                for k in range(4):
                    out[2 * y + k // 2, 2 * x + k % 2, c] = meanings[c, codes[y, x, 4 * c + k]]


def _unchanged(conditions, window=None, made=None):
    """The deformed neutral as it is, but for what was `made` in a window (slices) of it."""
    image = conditions.deformed_neutral
    whole = Generated(
        image.copy(), np.ones_like(image), np.zeros_like(image), np.zeros(image.shape[:2], image.dtype)
    )  # fmt: skip
    if made is not None:
        for name in vars(made):
            getattr(whole, name)[window] = getattr(made, name)
    return whole


def _laid(under, over, alpha):
    """One picture [H, W, 3] over another, as far as alpha [H, W] says."""
    return under * (1 - alpha[..., None]) + over * alpha[..., None]


def aligned_photo(subject, conditions):
    """The neutral photo moved to where the target's head is: [H, W, 3] uint8.

    By the neutral shape, as painted pairs are framed: by the target's own, a jaw that opens would
    move the photo over the face, and shades of skin with it.
    """
    pixels = cameras.project(subject.head.landmarks(subject.neutral)[:FACE], conditions.camera)
    low, high = pixels.min(0), pixels.max(0)
    side = subject.photo.shape[0]
    scale = (high[1] - low[1]) / (PHOTO_RATIO * side)
    shift = (low + high) / 2 - scale * side / 2
    matrix = np.column_stack([np.eye(2) * scale, shift + 0.5 * scale - 0.5])
    size = (conditions.camera.width, conditions.camera.height)
    photo = subject.photo
    if scale < 0.8:  # what is made smaller is blurred first, or it aliases
        photo = cv2.GaussianBlur(photo, (0, 0), 0.5 * np.sqrt(1 / scale**2 - 1))
    return cv2.warpAffine(photo, matrix, size, flags=cv2.INTER_LINEAR)


def load(path=WEIGHTS, half=None):
    """The generator whose weights lie in a file.

    Args:
        path: .safetensors as `bakery train pagan-export` writes it.

    Raises:
        ModelError: missing, damaged, or weights of something else.
    """
    from safetensors import SafetensorError, safe_open

    path = Path(path)
    try:
        with safe_open(path, "pt") as file:
            about = file.metadata() or {}
            tensors = {name: file.get_tensor(name).float() for name in file.keys()}  # noqa: SIM118
    except (SafetensorError, OSError) as error:
        raise ModelError(
            f"{path}: no weights of a generator ({error}); install bakery again or train some with "
            "`bakery train pagan`"
        ) from None
    table = json.loads(about.get("generator", "{}"))
    if table.pop("kind", None) != KIND:
        raise ModelError(f"{path}: holds no generator; give a file that `bakery train` exported")
    table = {name: tuple(v) if isinstance(v, list) else v for name, v in table.items()}
    network = UNet(NetworkOptions(**table), folded=True)
    try:
        network.load_state_dict(tensors)
    except RuntimeError:
        raise ModelError(
            f"{path}: weights of another network; give a file that this version exported"
        ) from None
    return PaganGenerator(network, half, sha256=digest_file(path))
