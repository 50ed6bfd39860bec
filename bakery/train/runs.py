"""What all trainings share: options that stay, weights that are averaged, checkpoints, precision."""

import json
import time
from dataclasses import asdict

import torch
from safetensors.torch import load_file
from safetensors.torch import save as save_tensors

from bakery.errors import InputError
from bakery.formats.files import write_bytes


def keep_options(run, options, free=("steps",)):
    """Write the options of a run to its folder, or see that they are the ones it started with.

    Args:
        run: Path of the run's folder.
        options: a dataclass.
        free: names of the options that may change when a run goes on.

    Raises:
        InputError: others changed.
    """
    path = run / "options.json"
    table = json.loads(json.dumps(asdict(options)))  # tuples become lists, as in the file
    if path.exists():
        before = json.loads(path.read_text())
        changed = [k for k in table if k not in free and before.get(k) != table[k]]
        if changed:
            raise InputError(
                f"{run}: was started with other {', '.join(changed)}; give the same or a new folder"
            )
    path.write_text(json.dumps(table, indent=2) + "\n")


def rate_at(step, options):
    """Learning rate at a step: warm-up, plateau, linear fall to zero."""
    start = options.decay_from * options.steps
    fall = min(1.0, (options.steps - step + 1) / max(options.steps - start, 1))
    return options.rate * min(1.0, step / 100) * fall


def average(averaged, network, keep):
    """Draw the averaged network's state towards the network's: `keep` of the old stays."""
    with torch.no_grad():
        for old, new in zip(averaged.state_dict().values(), network.state_dict().values()):
            if old.is_floating_point():
                old.lerp_(new, 1 - keep)
            else:
                old.copy_(new)


def save_checkpoint(path, step, modules, optimizers):
    """Write modules {name: Module} and Adam optimizers {name: Optimizer}, at once."""
    tensors = {"step": torch.tensor(step)}
    for name, module in modules.items():
        tensors |= {f"{name}.{k}": v.contiguous() for k, v in module.state_dict().items()}
    for name, optimizer in optimizers.items():
        for index, state in optimizer.state_dict()["state"].items():
            tensors |= {f"{name}.{index}.{k}": v.contiguous() for k, v in state.items()}
    write_bytes(path, save_tensors(tensors))


def load_checkpoint(path, modules, optimizers):
    """Read what `save_checkpoint` wrote, into the same modules and optimizers; returns its step."""
    tensors = load_file(path)
    for name, module in modules.items():
        module.load_state_dict(
            {k.removeprefix(f"{name}."): v for k, v in tensors.items() if k.startswith(f"{name}.")}
        )
    for name, optimizer in optimizers.items():
        state = {}
        for key, value in tensors.items():
            if key.startswith(f"{name}."):
                _, index, part = key.split(".")
                state.setdefault(int(index), {})[part] = value
        table = optimizer.state_dict()
        table["state"] = state
        optimizer.load_state_dict(table)
    return int(tensors["step"])


def bfloat16_pays(work):
    """Whether a piece of work takes less processor time in bfloat16 here.

    Wall time picked float32 by chance on a busy machine; processor time does not.

    Args:
        work: function without arguments, run under autocast twice each way.
    """
    seconds = {False: [], True: []}
    for half in (False, True) * 2:
        start = time.process_time()
        with torch.autocast("cpu", torch.bfloat16, enabled=half):
            work()
        seconds[half].append(time.process_time() - start)
    return min(seconds[True]) < min(seconds[False])


def quiet_worker(_):
    """One thread a process that makes samples, so that they do not crowd out the training."""
    import cv2

    cv2.setNumThreads(1)
    torch.set_num_threads(1)
