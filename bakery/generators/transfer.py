"""Expression transfer in texture space (Olszewski 2017, section 5), forward only.

What a performer's frame does to the performer's own resting texture is carried over to the resting
texture of somebody else. The paper's network sees (U_source, N_target) and paints U_target anew. Ours also
sees N_source (which change is expression, which is person?) and says how each texel is made of three
pictures: the target's own, changed by a log-ratio of which the performer's is a part; the
performer's, recoloured, which mouths and eyes need; and a colour of its own.
"""

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch

from bakery.check import check_array
from bakery.detectors.blocks import inference
from bakery.errors import ModelError
from bakery.formats.files import digest_file
from bakery.generators.unet import ResidualUNet
from bakery.paths import ASSETS
from bakery.settings import Settings, setting

WEIGHTS = ASSETS / "generators" / "transfer.safetensors"
KIND = "bakery texture transfer 1"  # says in a file's metadata what it is
# Groups of the input and their channels, in order; a network may be given fewer.
INPUTS = {
    "source": 3, "source_neutral": 3, "target_neutral": 3, "source_seen": 1, "target_seen": 1,
    "place": 2,
}  # fmt: skip
OUTPUTS = 12  # log-ratio 3, share of the performer's 1, recolouring 3, colour 3, two logits
REACH = 1.5  # log-ratios stay below it
FLOOR = 0.03  # of encoded values in ratios
START = (-1.0, -3.0, -3.0)  # logits: the performer's ratio, his picture, a colour of its own


@dataclass(frozen=True)
class TransferNetOptions(Settings):
    """The shape of a network."""

    channels: tuple[int, ...] = setting(
        (16, 32, 64, 96, 128), "at 1/2, 1/4, ... of the texture's side", 1, 4096, count=(1, 8)
    )
    blocks: int = setting(1, "residual blocks a level, on the way down and on the way up", 0, 64)
    inputs: tuple[str, ...] = setting(
        tuple(INPUTS), "what is seen; the paper's is source and target_neutral",
        choices=tuple(INPUTS), count=(1, len(INPUTS)),
    )  # fmt: skip


class TransferNet(ResidualUNet):
    """[B, C, T, T] to [B, OUTPUTS, T, T], see `compose`."""

    def __init__(self, options=TransferNetOptions(), folded=False):
        inputs = sum(INPUTS[name] for name in options.inputs)
        super().__init__(inputs, OUTPUTS, options.channels, options.blocks, folded)
        self.options = options
        with torch.no_grad():
            for channel, value in zip((3, 10, 11), START):
                self.head.bias[4 * channel : 4 * channel + 4] = value


def stacked(batch, inputs):
    """The network's input [B, C, T, T] from textures and masks [B, C, T, T] 0..1 by name."""
    source = batch["source"]
    height, width = source.shape[-2:]
    y = torch.linspace(-1, 1, height, device=source.device).view(1, 1, -1, 1)
    x = torch.linspace(-1, 1, width, device=source.device).view(1, 1, 1, -1)
    place = torch.cat([x.expand(1, 1, height, width), y.expand(1, 1, height, width)], 1)
    batch = batch | {"place": place.expand(len(source), -1, -1, -1)}
    return torch.cat([batch[name] for name in inputs], 1)


def compose(outputs, batch, inputs=tuple(INPUTS)):
    """The texture [B, 3, T, T] 0..1 that outputs of a network mean.

    Args:
        outputs: [B, OUTPUTS, T, T].
        batch: textures by name, as for `stacked`.
        inputs: of the network; without the performer's neutral his ratio is not known.
    """
    outputs = outputs.float()
    ratio = REACH * torch.tanh(outputs[:, :3] / REACH)
    if "source_neutral" in inputs:
        carried = torch.log((batch["source"] + FLOOR) / (batch["source_neutral"] + FLOOR))
        ratio = ratio + torch.sigmoid(outputs[:, 3:4]) * carried.clamp(-REACH, REACH)
    own = (batch["target_neutral"] + FLOOR) * torch.exp(ratio) - FLOOR
    recolored = REACH * torch.tanh(outputs[:, 4:7] / REACH)
    performed = (batch["source"] + FLOOR) * torch.exp(recolored) - FLOOR
    logits = torch.cat([torch.zeros_like(outputs[:, :1]), outputs[:, 10:12]], 1)
    share = torch.softmax(logits, 1)
    painted = torch.sigmoid(outputs[:, 7:10])
    return (
        share[:, :1] * own.clamp(0, 1)
        + share[:, 1:2] * performed.clamp(0, 1)
        + share[:, 2:] * painted
    )


class TextureTransfer:
    """A trained network; see the module. One instance serves any number of people."""

    def __init__(self, network, sha256=""):
        """
        Args:
            network: TransferNet built with `folded=True`.
            sha256: of the file that the weights came from.
        """
        self.network, self.sha256 = network.eval(), sha256
        self._unit = 2 ** len(network.options.channels)

    def __call__(
        self,
        source: np.ndarray,
        source_neutral: np.ndarray,
        target_neutral: np.ndarray,
        source_seen: np.ndarray | None = None,
        target_seen: np.ndarray | None = None,
    ) -> np.ndarray:
        """The target's texture with the expression of the source.

        Args:
            source, source_neutral, target_neutral: [T, T, 3] sRGB-encoded 0..1, expression textures of
                `stages.texture.expression`; T a multiple of 32, 256 as in training.
            source_seen, target_seen: [T, T] 0..1; None: all is seen.

        Returns:
            [T, T, 3] float32 sRGB-encoded 0..1.

        Raises:
            ValueError: textures that do not go together.
        """
        named = {
            "source": source, "source_neutral": source_neutral, "target_neutral": target_neutral,
        }  # fmt: skip
        size = np.shape(source)[0]
        for name, texture in named.items():
            check_array(f"TextureTransfer {name}", texture, (size, size, 3), low=0, high=1)
        if size % self._unit:
            raise ValueError(f"textures of {size} texels; give a multiple of {self._unit}")
        whole = np.ones((size, size), np.float32)
        named |= {
            "source_seen": whole if source_seen is None else source_seen,
            "target_seen": whole if target_seen is None else target_seen,
        }
        batch = {name: _tensor(texture) for name, texture in named.items()}
        with inference():
            x = stacked(batch, self.network.options.inputs)
            made = compose(self.network(x), batch, self.network.options.inputs)
        return np.ascontiguousarray(made[0].permute(1, 2, 0).numpy())


def _tensor(texture):
    array = np.asarray(texture, np.float32)
    array = array[..., None] if array.ndim == 2 else array
    return torch.from_numpy(np.ascontiguousarray(array.transpose(2, 0, 1)))[None]


def load(path=WEIGHTS):
    """The transfer whose weights lie in a file.

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
            f"{path}: no weights of a texture transfer ({error}); train some with `bakery "
            "train transfer`"
        ) from None
    table = json.loads(about.get("transfer", "{}"))
    if table.pop("kind", None) != KIND:
        raise ModelError(
            f"{path}: holds no texture transfer; give what `train transfer-export` wrote"
        )
    table = {name: tuple(v) if isinstance(v, list) else v for name, v in table.items()}
    network = TransferNet(TransferNetOptions(**table), folded=True)
    try:
        network.load_state_dict(tensors)
    except RuntimeError:
        raise ModelError(
            f"{path}: weights of another network; give a file that this version exported"
        ) from None
    return TextureTransfer(network, sha256=digest_file(path))
