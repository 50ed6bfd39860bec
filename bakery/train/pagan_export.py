"""The averaged weights of a run as the file that ships."""

import json
import os
from dataclasses import asdict
from pathlib import Path

import torch
from safetensors.torch import load_file, save_file

from bakery.detectors.blocks import fold
from bakery.errors import InputError
from bakery.generators.pagan import KIND
from bakery.generators.unet import UNet
from bakery.preset import options_from
from bakery.train.pagan import PaganOptions


def export(run, path):
    """Fold the averaged network of a run and write it in half precision.

    Args:
        run: folder of `bakery train pagan`.
        path: .safetensors to write.

    Returns:
        dict of figures: steps, parameters, bytes.

    Raises:
        InputError: the folder holds no run.
    """
    run = Path(run)
    try:
        options = options_from(
            PaganOptions, json.loads((run / "options.json").read_text()), str(run)
        )
        stored = load_file(run / "checkpoint.safetensors")
    except OSError as error:
        raise InputError(f"{run}: no run of `bakery train pagan` ({error})") from None
    network = UNet(options.network)
    prefix = "averaged."
    network.load_state_dict(
        {k.removeprefix(prefix): v for k, v in stored.items() if k.startswith(prefix)}
    )
    return {"steps": int(stored["step"])} | write(network, path)


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
    aside = path.with_suffix(".tmp")
    # One entry only: the library writes several in an order that changes from run to run.
    table = {"kind": KIND} | asdict(network.options)
    save_file(tensors, aside, {"generator": json.dumps(table, sort_keys=True)})
    os.replace(aside, path)
    return {
        "parameters": sum(value.numel() for value in tensors.values()),
        "bytes": path.stat().st_size,
    }
