"""Training of the detector's networks: one loop for all four, on any device.

A run folder holds options.json, stats.jsonl (a line every `log_every` steps) and
checkpoint.safetensors. A run that was stopped goes on from its checkpoint. Loss that is not finite
stops the run. Pictures come from a bank (`bank`), which may still grow meanwhile.
"""

import json
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from safetensors.torch import load_file
from safetensors.torch import save as save_tensors
from torch import nn

from bakery import landmarks as marks
from bakery.detectors import frames
from bakery.detectors.blocks import CloseupNet, FinderNet, PointsNet, fold
from bakery.detectors.closeups import SIDES
from bakery.errors import InputError, ModelError
from bakery.formats.files import write_bytes
from bakery.settings import SEEDS, Settings, setting
from bakery.train import runs
from bakery.train.detector import bank, batches
from bakery.train.detector.losses import LipRows, finder_loss, points_loss
from bakery.train.faces import mirror_order

NETWORKS = ("finder", "points", "eye", "mouth")
# What a rim counts over other points of a close-up: lids, irises, brows and lips carry a face.
RIMS = np.concatenate([marks.LIPS, *marks.EYES, marks.BROWS, [marks.LEFT_IRIS.start]])
RIM = 2.0
CROPS = 128  # of a batch that is looked at, not learned from


@dataclass(frozen=True)
class DetectorOptions(Settings):
    """How one of the detector's networks is trained."""

    network: str = setting("points", "which", choices=NETWORKS)
    minutes: float = setting(60.0, "of training in all; the rate falls to zero with them", 0, 10**6)
    batch: int = setting(256, "pictures a step", 1, 65536)
    rate: float = setting(2e-3, "of learning, after a warm-up of 300 steps", 0, 1)
    decay_from: float = setting(
        0.3, "share of the time after which the rate falls to zero", 0, 0.999
    )
    average: float = setting(
        0.999, "how much of the old stays at each step in the weights that ship", 0, 1
    )
    weight_decay: float = setting(1e-2, "of Adam", 0, 1)
    log_every: int = setting(200, "steps", 1, 10**7)
    save_every: int = setting(60, "seconds", 1, 10**7)
    seed: int = setting(0, "of all chance", 0, SEEDS)


class Trained:
    """A network while it is trained, its average, and what it learns from."""

    def __init__(self, options, head, device, start=None):
        self.options, self.device = options, device
        name = options.network
        if name == "finder":
            make, self.batches = FinderNet, batches.SceneBatches()
            self.rows = None
        elif name == "points":
            make = PointsNet
            self.batches = batches.PointsBatches(mirror_order(head.landmarks(head.mean)[None]))
            self.rows = np.arange(frames.POINTS)
        else:
            self.batches = batches.CloseupBatches(name, head)
            self.rows = self.batches.rows[0].numpy()
            make = lambda: CloseupNet(len(self.rows), SIDES[name])  # noqa: E731
        self.seen = (
            None
            if self.rows is None
            else torch.as_tensor(self.batches.rows if name in SIDES else self.rows)
        )
        self.network = make().to(device, memory_format=torch.channels_last)
        self.averaged = make().to(device, memory_format=torch.channels_last)
        # What the head model takes for a point lies a little off from what photographs' points
        # mean by it; the difference is learned beside the network and does not ship.
        self.offset = nn.Parameter(torch.zeros(0 if self.rows is None else len(self.rows), 2))
        self.offset.data = self.offset.data.to(device)
        self.lips = LipRows.among(self.rows) if name in ("points", "mouth") else None
        self.importance = None
        if name in ("eye", "mouth"):
            weight = torch.as_tensor(np.where(np.isin(self.rows, RIMS), RIM, 1.0)).float()
            self.importance = (weight / weight.mean()).to(device)
        parameters = [
            {"params": self.network.parameters(), "weight_decay": options.weight_decay},
            {"params": [self.offset], "weight_decay": 0.0},
        ]
        self.optimizer = torch.optim.AdamW(parameters)

    def prepare(self, source, rng):
        """Set the mean shape from a first batch, before anything is learned."""
        if self.rows is None:
            return
        total = torch.zeros(len(self.rows), 2, device=self.device)
        for _ in range(8):
            _, target, present, _ = self.batches.make(source, CROPS, rng)
            total += (target * present[:, None, None]).sum(0) / present.sum() / 8
        self.network.mean_shape.copy_(total)
        self.averaged.load_state_dict(self.network.state_dict())

    def loss(self, source, rng):
        """One batch: scalar loss, dict of its parts."""
        made = self.batches.make(source, self.options.batch, rng)
        image = made[0].contiguous(memory_format=torch.channels_last)
        with torch.autocast(self.device.type, torch.bfloat16):
            output = self.network(image)
        if self.rows is None:
            return finder_loss(output, made[1])
        _, target, present, painted = made
        points = output[0] + self.offset * painted[:, None, None]
        return points_loss((points, *output[1:]), target, present, self.importance, self.lips)

    def measure(self, held):
        """What the averaged network makes of held-out photographs, degraded alike each time.

        Returns:
            dict: mean distance of points, and what is wrong about lips, sides of the crop.
        """
        rng = torch.Generator(self.device).manual_seed(1)
        self.averaged.eval()
        found = {}
        with torch.inference_mode():
            for _ in range(4):
                image, target, present, _ = self.batches.make(held, CROPS, rng)
                parts = points_loss(self.averaged(image), target, present, None, self.lips)[1]
                for name in parts.keys() & {"distance", "lips"}:
                    found[f"held_{name}"] = found.get(f"held_{name}", 0.0) + float(parts[name]) / 4
        return {name: round(value, 6) for name, value in found.items()}

    def modules(self):
        """What a checkpoint holds."""
        extra = nn.Module()
        extra.offset = self.offset
        if self.rows is not None:
            extra.register_buffer("rows", self.seen)
        return {"network": self.network, "averaged": self.averaged, "extra": extra}


def train(run, folder, head, options=DetectorOptions(), device="cpu"):
    """Train one network of the detector, or go on with it.

    Args:
        run: folder of the run; made when missing.
        folder: of a bank, see `bank.paint_bank`; it may grow while this runs.
        head: HeadModel, for what lies in the crops of eyes and mouth.
        options: DetectorOptions. A run that goes on may change `minutes`, nothing else.
        device: "cpu" or "cuda".

    Yields:
        dict of figures every `log_every` steps

    Raises:
        InputError: the bank is empty, or the run was started with other options.
        ModelError: the loss is not finite.
    """
    run, folder, device = Path(run), Path(folder), torch.device(device)
    run.mkdir(parents=True, exist_ok=True)
    runs.keep_options(run, options, free=("minutes",))
    torch.manual_seed(options.seed)
    kinds = ("scene",) if options.network == "finder" else ("photo", "quick", "careful")
    source = batches.Bank(folder, kinds, device)
    room = {kind: bank.planned(folder, kind) for kind in kinds}
    if not source.refresh(room):
        raise InputError(f"{folder}: no pictures; paint some with `bakery train bank`")
    state = Trained(options, head, device)
    rng = torch.Generator(device).manual_seed(options.seed)
    _, photos = bank.split_photos(folder, bank.planned(folder, "held"))
    held = batches.Photos(*bank.held_bases(photos), device) if photos else None
    checkpoint, step, spent = run / "checkpoint.safetensors", 0, 0.0
    optimizers = {"adam": state.optimizer}
    if checkpoint.exists():
        step = runs.load_checkpoint(checkpoint, state.modules(), optimizers)
        spent = json.loads((run / "progress.json").read_text())["seconds"]
        rng.manual_seed(options.seed + step)
    else:
        state.prepare(source, rng)
    began, saved = time.monotonic() - spent, time.monotonic()
    total, limit = {}, options.minutes * 60
    while (seconds := time.monotonic() - began) < limit:
        step += 1
        for group in state.optimizer.param_groups:
            group["lr"] = rate_at(step, seconds / limit, options)
        state.network.train()
        loss, parts = state.loss(source, rng)
        state.optimizer.zero_grad(set_to_none=True)
        loss.backward()
        nn.utils.clip_grad_norm_(state.network.parameters(), 1.0)
        state.optimizer.step()
        runs.average(state.averaged, state.network, min(options.average, (1 + step) / (10 + step)))
        for name, value in {"loss": loss.detach(), **parts}.items():
            total[name] = total.get(name, 0.0) + value / options.log_every
        if step % options.log_every == 0:
            figures = {name: round(float(value), 6) for name, value in total.items()}
            if not np.isfinite(figures["loss"]):
                raise ModelError(
                    f"{run}: the loss is not finite at step {step}; the last checkpoint is kept, "
                    "start again with a lower rate"
                )
            figures = {
                "step": step, "seconds": round(seconds, 1), "pictures": source.refresh(room)
            } | figures  # fmt: skip
            if held and state.rows is not None and step % (10 * options.log_every) == 0:
                figures |= state.measure(held)
            with (run / "stats.jsonl").open("a") as file:
                file.write(json.dumps(figures) + "\n")
            yield figures
            total = {}
        if time.monotonic() - saved > options.save_every:
            save(run, step, time.monotonic() - began, state)
            saved = time.monotonic()
    save(run, step, limit, state)


def save(run, step, seconds, state):
    """Write the checkpoint of a run, and how long it has trained."""
    runs.save_checkpoint(
        run / "checkpoint.safetensors", step, state.modules(), {"adam": state.optimizer}
    )
    (run / "progress.json").write_text(json.dumps({"step": step, "seconds": round(seconds, 1)}))


def rate_at(step, share, options):
    """Learning rate at a step: warm-up, plateau, fall to zero along a cosine.

    Args:
        share: of the time that is over, 0..1.
    """
    over = max(share - options.decay_from, 0) / (1 - options.decay_from)
    return options.rate * min(1.0, step / 300) * 0.5 * (1 + np.cos(np.pi * min(over, 1.0)))


def export(runs_by_name, path):
    """Fold the averaged weights of runs into one file, half precision.

    Args:
        runs_by_name: network -> run folder of `train`; of eye and mouth, or of finder and points.
        path: .safetensors to write.

    Raises:
        InputError: a run has no checkpoint.
    """
    tensors = {}
    for name, run in runs_by_name.items():
        checkpoint = Path(run) / "checkpoint.safetensors"
        if not checkpoint.exists():
            raise InputError(f"{run}: has no {checkpoint.name}; train first")
        stored = load_file(checkpoint)
        prefix = "averaged."
        state = {k.removeprefix(prefix): v for k, v in stored.items() if k.startswith(prefix)}
        network = _network(name, state)
        network.load_state_dict(state)
        for key, value in fold(network.eval()).items():
            tensors[f"{name}.{key}"] = value.half()
        if name in SIDES:
            tensors[f"{name}.rows"] = stored["extra.rows"]
    write_bytes(path, save_tensors(tensors))


def _network(name, state):
    if name in ("finder", "points"):
        return {"finder": FinderNet, "points": PointsNet}[name]()
    return CloseupNet(len(state["mean_shape"]), SIDES[name])
