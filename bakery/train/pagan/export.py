"""The averaged weights of a run, or of several, as the file that ships."""

import json
from dataclasses import asdict
from pathlib import Path

import torch
from safetensors.torch import load_file
from safetensors.torch import save as save_tensors

from bakery.detectors.blocks import fold
from bakery.errors import InputError
from bakery.formats.files import write_bytes
from bakery.generators.pagan import KIND
from bakery.generators.unet import UNet
from bakery.preset import options_from
from bakery.train.pagan import PaganOptions


def export(runs, path):
    """Fold the averaged network of a run and write it in half precision.

    Of several runs that went on from one another the mean of their weights is taken: what they have
    in common is steadier from frame to frame than either (docs/log-pagan.md).

    Args:
        runs: folders of `bakery train pagan`.
        path: .safetensors to write.

    Returns:
        dict of figures: steps of each, parameters, bytes.

    Raises:
        InputError: a folder holds no run, or runs are of different networks.

    References:
        Izmailov, Podoprikhin, Garipov, Vetrov and Wilson, "Averaging weights leads to wider optima
        and better generalization", UAI 2018.
    """
    read = [_read(Path(run)) for run in runs]
    shape = read[0][0]
    if any(other != shape for other, _, _ in read):
        raise InputError("the runs are of different networks; give runs that share their network.*")
    mean = {
        name: sum(weights[name].double() for _, weights, _ in read).div(len(read)).to(first.dtype)
        for name, first in read[0][1].items()
    }
    network = UNet(shape)
    network.load_state_dict(mean)
    return {"steps": [step for _, _, step in read]} | write(network, path)


def _read(run):
    """NetworkOptions, averaged weights and step of a run."""
    try:
        options = options_from(
            PaganOptions, json.loads((run / "options.json").read_text()), str(run)
        )
        stored = load_file(run / "checkpoint.safetensors")
    except OSError as error:
        raise InputError(f"{run}: no run of `bakery train pagan` ({error})") from None
    prefix = "averaged."
    weights = {k.removeprefix(prefix): v for k, v in stored.items() if k.startswith(prefix)}
    return options.network, weights, int(stored["step"])


def write(network, path):
    """Write a trained UNet, folded and in half precision.

    Returns:
        dict of figures: parameters, bytes.

    Raises:
        InputError: its weights do not fit half precision.
    """
    path = Path(path)
    tensors = {name: value.half() for name, value in fold(network.eval()).items()}
    if not all(torch.isfinite(value).all() for value in tensors.values()):
        raise InputError(f"{path}: weights do not fit half precision; train on or take another run")
    # One entry only: the library writes several in an order that changes from run to run.
    table = {"kind": KIND} | asdict(network.options)
    write_bytes(path, save_tensors(tensors, {"generator": json.dumps(table, sort_keys=True)}))
    return {
        "parameters": sum(value.numel() for value in tensors.values()),
        "bytes": path.stat().st_size,
    }
