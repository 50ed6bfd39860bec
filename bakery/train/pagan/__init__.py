"""Training of the generator (paGAN secs. 4 and 7): one loop for a processor, a GPU or several.

A run folder holds options.json, stats.jsonl, samples/STEP.png (photo, deformed neutral, made, truth
of people that are held out) and checkpoint.safetensors. A run that was stopped goes on from its
checkpoint and sees the samples it would have seen. A loss that is not finite stops it.

Several GPUs: `torchrun --nproc-per-node N -m -- bakery train pagan ...`; each takes its share of a batch.
"""

import json
import logging
import os
import time
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import torch
from torch import distributed, nn
from torch.utils.data import DataLoader, Subset

from bakery.detectors.blocks import unfold
from bakery.errors import InputError, ModelError, UsageProblem
from bakery.formats.image import write_image
from bakery.formats.mark import MIXED
from bakery.generators import pagan
from bakery.generators.unet import INPUTS, NetworkOptions, UNet, interpret, network_input
from bakery.settings import SEEDS, Settings, setting
from bakery.train import runs
from bakery.train.pagan import losses
from bakery.train.pagan.data import NOMINAL, Cropping, Pairs, Samples, tensors

log = logging.getLogger(__name__)
LOSS = (0, 1e4)  # range of the weight of a loss
# What may change when a run goes on; so a run can begin without a discriminator and get one later.
FREE = (
    "steps", "shares", "adversarial", "adversarial_from", "judge_alone", "log_every", "save_every",
    "sheet_every", "workers", "threads", "memory", "cache",
)  # fmt: skip


@dataclass(frozen=True)
class PaganOptions(Settings):
    """How the generator is trained; losses as in paGAN."""

    steps: int = setting(20000, "of training", 1, 10**7)
    batch: int = setting(8, "crops a step", 1, 65536)
    rate: float = setting(1e-3, "of learning, after a warm-up of 100 steps", 0, 1)
    decay_from: float = setting(
        0.5, "share of the steps after which the rate falls to zero", 0, 0.999
    )
    weight_decay: float = setting(1e-4, "of Adam", 0, 1)
    average: float = setting(
        0.998, "how much of the old stays at each step in the weights that ship", 0, 1
    )
    pixel: float = setting(10.0, "weight of the L1 loss", *LOSS)
    identity: float = setting(
        0.15, "weight of the identity loss; needs features and crop.whole > 0", *LOSS
    )
    adversarial: float = setting(1.0, "weight of the adversarial loss", *LOSS)
    adversarial_from: int = setting(-1, "step from which on there is a judge; -1: never", -1, 10**7)
    judge_alone: int = setting(
        300, "steps that the judge learns before the generator hears of it", 0, 10**7
    )
    judge_channels: int = setting(32, "of the judge's first layer", 1, 1024)
    detail: float = setting(10.0, "weight of the L1 loss of gradients", *LOSS)
    structure: float = setting(0.0, "weight of one minus the structural similarity", *LOSS)
    alpha: float = setting(0.5, "weight of the mean alpha on skin", *LOSS)
    smooth: float = setting(0.5, "weight of the roughness of the ratio on skin", *LOSS)
    crop: Cropping = field(default_factory=Cropping)
    network: NetworkOptions = field(default_factory=NetworkOptions)
    shares: tuple[float, ...] = setting(
        (), "of the samples from each folder; empty: equal", 0, 1e6, count=(0, 1000)
    )
    held_out: int = setting(8, "every so-manieth subject is kept for measuring; 0: none", 0, 10**6)
    memory: int = setting(1500, "decoded pairs that are kept", 0, 2**20, unit="MiB")
    cache: str = setting("", "folder for decoded pairs, which processes share; empty: none")
    log_every: int = setting(50, "steps", 1, 10**7)
    save_every: int = setting(200, "steps", 1, 10**7)
    sheet_every: int = setting(1000, "steps", 1, 10**7)
    workers: int = setting(0, "processes that cut crops", 0, 256)
    threads: int = setting(0, "of torch; 0: as many as it likes", 0, 1024)
    seed: int = setting(0, "of all chance", 0, SEEDS)
    begin: str = setting(
        "", "weights as they ship to begin from; their normalisation stays as it is"
    )

    def __post_init__(self):
        super().__post_init__()
        if self.crop.size % 2 ** len(self.network.channels):
            raise UsageProblem(
                f"crop.size {self.crop.size}: must be a multiple of "
                f"{2 ** len(self.network.channels)} for {len(self.network.channels)} levels"
            )


def train(run, folders, options=PaganOptions(), features=None):
    """Train a generator, or go on with it.

    Args:
        run: folder of the run; made when missing.
        folders: of shards of pairs (`bakery synth pairs`, `bakery train pairs`).
        options: PaganOptions. A run that goes on may change those in FREE only, and the folders.
        features: identity features (`generators.identity.load_features`), a module from
            [B, 3, H, W] 0..1 to [B, n]; None: no such loss.

    Yields:
        dict of figures every `log_every` steps (of the first process)

    Raises:
        InputError: no pairs, or the run was started with other options.
        ModelError: the loss is not finite.
    """
    run = Path(run)
    rank, world = _join()
    if rank == 0:
        (run / "samples").mkdir(parents=True, exist_ok=True)
        runs.keep_options(run, options, FREE)
    state = _State(options, features)
    if options.threads:  # after weights to begin with, whose generator wants one
        torch.set_num_threads(options.threads)
    checkpoint = run / "checkpoint.safetensors"
    step = state.load(checkpoint) if checkpoint.exists() else 0
    pairs = Pairs(folders, options.crop, options.memory, options.held_out, options.cache or None)
    held = {Path(f).name: [person[0] for person in p] for f, p in zip(folders, pairs.held) if p}
    samples = Samples(pairs, options.seed, options.steps * options.batch * world, options.shares)
    start = step * options.batch * world
    loader = DataLoader(
        Subset(samples, range(start + rank, len(samples), world)),
        options.batch,
        num_workers=options.workers,
        worker_init_fn=runs.quiet_worker,
        multiprocessing_context="spawn" if options.workers else None,  # forks hang in OpenCV
        pin_memory=state.device.type == "cuda",
        drop_last=True,
    )
    log.info("%s: %s, %s", run, state.device, "bfloat16" if state.half else "float32")
    started, total = time.monotonic(), {}
    for batch in loader:
        step += 1
        state.set_rate(runs.rate_at(step, options))
        for name, value in state.step(batch, step, run).items():
            total[name] = total.get(name, 0.0) + value / options.log_every
        last = step == options.steps
        if rank == 0 and (step % options.save_every == 0 or last):
            state.save(checkpoint, step)
        if rank == 0 and held and (step % options.sheet_every == 0 or last):
            sheet = run / f"samples/{step:06d}.png"
            total |= held_out(state.averaged, pairs, held, options, sheet)
        if rank == 0 and (step % options.log_every == 0 or last):
            seconds = (time.monotonic() - started) / options.log_every
            figures = {"step": step, "seconds_per_step": round(seconds, 4)}
            figures |= {name: round(value, 6) for name, value in total.items()}
            with (run / "stats.jsonl").open("a") as file:
                file.write(json.dumps(figures) + "\n")
            yield figures
            started, total = time.monotonic(), {}


def _join():
    """Rank and number of processes; joins the others when started by torchrun."""
    world = int(os.environ.get("WORLD_SIZE", 1))
    if world > 1 and not distributed.is_initialized():
        distributed.init_process_group("nccl" if torch.cuda.is_available() else "gloo")
    return int(os.environ.get("RANK", 0)), world


def widened(network, options):
    """The tensors of a folded network for a larger one that says the same.

    New inputs count for nothing as yet; new channels take from all, but nothing that was there
    before takes from them.

    Args:
        network: UNet, folded.
        options: NetworkOptions of the larger: more inputs after those known, more channels a level.

    Raises:
        InputError: it is not larger, or another kind of network.
    """
    known = network.options
    if options.inputs[: len(known.inputs)] != known.inputs:
        raise InputError(
            f"begin: those weights look at {', '.join(known.inputs)}; network.inputs must begin with "
            "them"
        )
    grown = UNet(options, folded=True).state_dict()
    old = network.state_dict()
    alike = known.head == options.head and old.keys() == grown.keys()
    if not alike or any(
        few > many for name in old for few, many in zip(old[name].shape, grown[name].shape)
    ):
        raise InputError(
            f"begin: those weights are of channels {known.channels}, {known.blocks} blocks and head "
            f"{known.head}; give as many levels, at least as many channels, the same blocks and head"
        )
    for name, tensor in grown.items():
        tensor[: len(old[name])] = 0
        tensor[tuple(slice(size) for size in old[name].shape)] = old[name]
    return grown


class _State:
    """The networks of a run, where they live, and one step of both."""

    def __init__(self, options, features):
        torch.manual_seed(options.seed)
        self.options = options
        local = int(os.environ.get("LOCAL_RANK", 0))
        cuda = torch.cuda.is_available()
        self.device = torch.device(f"cuda:{local}" if cuda else "cpu")

        def place(module):
            return module.to(self.device, memory_format=torch.channels_last)

        self.network, self.averaged = (place(UNet(options.network)) for _ in range(2))
        if options.begin:
            begun = pagan.load(options.begin).network
            self.network.load_state_dict(unfold(self.network, widened(begun, options.network)))
        self.averaged.load_state_dict(self.network.state_dict())
        inputs = sum(INPUTS[name] for name in options.network.inputs)
        self.judge = place(losses.PatchDiscriminator(inputs, options.judge_channels))
        self.features = None if features is None else place(features.eval().requires_grad_(False))
        decay = options.weight_decay
        self.adam = torch.optim.AdamW(self.network.parameters(), weight_decay=decay)
        self.judge_adam = torch.optim.AdamW(self.judge.parameters(), betas=(0.5, 0.999))
        self.modules = {"network": self.network, "averaged": self.averaged, "judge": self.judge}
        self.optimizers = {"adam": self.adam, "judge_adam": self.judge_adam}
        self.half = cuda or runs.bfloat16_pays(self._work)
        self.shared = self.network, self.judge  # what the steps call
        if distributed.is_initialized():
            devices = [local] if cuda else None
            self.shared = tuple(
                nn.parallel.DistributedDataParallel(m, devices) for m in self.shared
            )

    def _work(self):
        """A small forward and backward pass that leaves no trace."""
        network = UNet(self.options.network).to(memory_format=torch.channels_last)
        inputs = sum(INPUTS[name] for name in self.options.network.inputs)
        x = torch.zeros(4, inputs, 128, 128).contiguous(memory_format=torch.channels_last)
        network(x).float().mean().backward()

    def load(self, path):
        return runs.load_checkpoint(path, self.modules, self.optimizers)

    def save(self, path, step):
        runs.save_checkpoint(path, step, self.modules, self.optimizers)

    def set_rate(self, rate):
        """The judge begins late, when the generator's rate has fallen; it learns at a steady one."""
        for optimizer, now in ((self.adam, rate), (self.judge_adam, 0.4 * self.options.rate)):
            for group in optimizer.param_groups:
                group["lr"] = now

    def _opinion(self, judge, conditions, picture, real, counts):
        with torch.autocast(self.device.type, torch.bfloat16, enabled=self.half):
            logits = judge(conditions, picture)
        return losses.judged(logits.float(), real, counts)

    def step(self, batch, step, run):
        """Train on one batch of byte tensors; returns the parts of the loss."""
        options = self.options
        batch = {name: part.to(self.device, non_blocking=True) for name, part in batch.items()}
        x = network_input(batch, options.network.inputs)
        x = x.contiguous(memory_format=torch.channels_last)
        target, deformed = batch["target"].float() / 255, batch["deformed"].float() / 255
        weight, skin = batch["weight"].float(), batch["skin"].float() / 255
        network, judge = self.shared
        network.train(not options.begin)  # weights that ship have lost their statistics
        with torch.autocast(self.device.type, torch.bfloat16, enabled=self.half):
            outputs = network(x)
        change = interpret(outputs, deformed)
        alpha, rough = losses.restraint(change, weight, skin)
        parts = {
            "pixel": losses.pixel_loss(change.picture, target, weight),
            "detail": losses.detail_loss(change.picture, target, weight),
            "alpha": alpha,
            "smooth": rough,
        }
        if options.structure:
            parts["structure"] = losses.structure_loss(change.picture, target, weight)
        whole = batch["whole"] > 0
        if self.features is not None and whole.any():
            # The features look at faces on black; a crop of a face has none.
            face = (weight > 0).float()
            seen = (picture * face for picture in (target, change.picture))
            parts["identity"] = losses.identity_loss(self.features, *(p[whole] for p in seen))
        judging = 0 <= options.adversarial_from < step
        heard = judging and step > options.adversarial_from + options.judge_alone
        if judging:
            counts = losses.patch_weight(weight)
            made, real = ((p - deformed) * (weight > 0) for p in (change.picture, target))
        if heard:
            self.judge.requires_grad_(False)  # no gradient of its own, nothing to share
            parts["adversarial"] = self._opinion(self.judge, x, made, True, counts)
            self.judge.requires_grad_(True)
        loss = sum(getattr(options, name) * value for name, value in parts.items())
        if not torch.isfinite(loss):
            raise ModelError(
                f"{run}: the loss is not finite at step {step}; the last checkpoint is kept, "
                "start again with a lower rate"
            )
        self.adam.zero_grad(set_to_none=True)
        loss.backward()
        torch.nn.utils.clip_grad_norm_(self.network.parameters(), 5.0)
        self.adam.step()
        if judging:
            self.judge_adam.zero_grad(set_to_none=True)
            right = self._opinion(judge, x, real, True, counts)
            wrong = self._opinion(judge, x, made.detach(), False, counts)
            parts["judge"] = (right + wrong) / 2
            parts["judge"].backward()
            self.judge_adam.step()
        runs.average(self.averaged, self.network, min(options.average, (1 + step) / (10 + step)))
        return {name: float(value.detach()) for name, value in parts.items()}


@torch.inference_mode()
def held_out(network, pairs, held, options, sheet, shown=3, most=8):
    """Figures over whole pairs of held-out people, and a sheet of some.

    Args:
        network: UNet.
        held: {name of a folder: [(shard, row, weight)]}.
        sheet: path of the PNG.
        shown, most: pairs of a folder that are drawn, and that are measured.

    Returns:
        dict, a folder each: PSNR in dB on the face, weighted as the loss is, of what is made and of
        the deformed neutral itself; the mean alpha on skin.
    """
    network.eval()
    device = next(network.parameters()).device
    figures, lines = {}, []
    for name, rows in held.items():
        errors, before, alphas = [], [], []
        for k, (shard, row, _) in enumerate(rows[:most]):
            batch = tensors(pairs.decoded(shard, row), NOMINAL)
            batch = {name: part[None].to(device) for name, part in batch.items()}
            deformed, target = batch["deformed"].float() / 255, batch["target"].float() / 255
            change = interpret(network(network_input(batch, options.network.inputs)), deformed)
            weight = batch["weight"].float()
            for picture, found in ((change.picture, errors), (deformed, before)):
                square = ((picture - target) ** 2 * weight).sum() / (3 * weight.sum()).clamp_min(1)
                found.append(float(square))
            alphas.append(float(losses.restraint(change, weight, batch["skin"] / 255)[0]))
            if k < shown:
                row = [batch["photo"].float() / 255, deformed, change.picture, target]
                lines.append(torch.cat([part[0] for part in row], 2))
        figures |= {
            f"{name}_psnr": float(-10 * np.log10(np.mean(errors))),
            f"{name}_before": float(-10 * np.log10(np.mean(before))),
            f"{name}_alpha": float(np.mean(alphas)),
        }
    picture = torch.cat(lines, 1).permute(1, 2, 0).cpu().numpy()
    write_image(sheet, picture, mark=MIXED)
    return figures
