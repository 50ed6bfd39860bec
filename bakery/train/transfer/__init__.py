"""Training of the texture transfer (Olszewski 2017, sections 5 and 7).

A run folder holds options.json, stats.jsonl, samples/STEP.png (source, target at rest, direct delta, made,
truth of people held out) and checkpoint.safetensors. A run that was stopped goes on from its
checkpoint. People that are painted meanwhile join it.
"""

import json
import logging
import time
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import numpy as np
import torch
from safetensors.torch import load_file
from safetensors.torch import save as save_tensors

from bakery.detectors.blocks import fold
from bakery.errors import InputError, ModelError
from bakery.formats.files import write_bytes
from bakery.formats.image import write_image
from bakery.formats.mark import PAINTED
from bakery.generators.transfer import KIND, TransferNet, TransferNetOptions, compose, stacked
from bakery.preset import options_from
from bakery.settings import SEEDS, Settings, setting
from bakery.train import runs
from bakery.train.pagan import losses
from bakery.train.transfer.data import Performers, pair, tensors

log = logging.getLogger(__name__)
LOSS = (0, 1e4)  # range of the weight of a loss
CHECKPOINT = "checkpoint.safetensors"
FREE = (
    "steps", "adversarial", "adversarial_from", "structure", "detail", "log_every", "save_every",
    "look_every",
)  # fmt: skip


@dataclass(frozen=True)
class TransferOptions(Settings):
    """How the texture transfer is trained; the paper's values are in docs/log-transfer.md."""

    steps: int = setting(4000, "of training", 1, 10**7)
    batch: int = setting(6, "pairs of performers a step", 1, 4096)
    rate: float = setting(1e-3, "of learning, after a warm-up of 100 steps", 0, 1)
    decay_from: float = setting(0.5, "share of the steps after which it falls to zero", 0, 0.999)
    average: float = setting(0.995, "how much of the old stays in the weights that ship", 0, 1)
    pixel: float = setting(10.0, "weight of the L1 loss; mouth and eyes count ten times", *LOSS)
    detail: float = setting(5.0, "weight of the L1 loss of gradients", *LOSS)
    structure: float = setting(0.5, "weight of one minus the structural similarity", *LOSS)
    adversarial: float = setting(0.001, "weight of the judge's opinion, mu of the paper", *LOSS)
    adversarial_from: int = setting(-1, "step from which on there is a judge; -1: never", -1, 10**7)
    judge_rate: float = setting(2e-5, "of the judge's learning", 0, 1)
    judge_channels: int = setting(32, "of the judge's first layer", 1, 1024)
    oneself: float = setting(0.05, "share of samples in which one person plays himself", 0, 1)
    retoned: float = setting(0.8, "share of samples with other skin and light", 0, 1)
    tone: float = setting(0.7, "how far skin varies, over how much people do", 0, 10)
    light: float = setting(0.15, "spread of the log-gain of light", 0, 5)
    network: TransferNetOptions = field(default_factory=TransferNetOptions)
    held_out: int = setting(8, "every so-manieth person is kept for measuring; 0: none", 0, 10**6)
    log_every: int = setting(25, "steps", 1, 10**7)
    save_every: int = setting(100, "steps", 1, 10**7)
    look_every: int = setting(200, "steps; new people join, held-out ones are measured", 1, 10**7)
    seed: int = setting(0, "of all chance", 0, SEEDS)


def train(run, folders, options=TransferOptions()):
    """Train a transfer, or go on with it, on one thread.

    Args:
        run: folder of the run; made when missing.
        folders: of performers (`bakery synth performers`).
        options: TransferOptions. A run that goes on may change those in FREE only, and the folders.

    Yields:
        dict of figures every `log_every` steps.

    Raises:
        InputError: no performers, or the run was started with other options.
        ModelError: the loss is not finite.
    """
    run = Path(run)
    people = Performers(folders, options.held_out)
    (run / "samples").mkdir(parents=True, exist_ok=True)
    runs.keep_options(run, options, FREE)
    torch.set_num_threads(1)
    state = _State(options)
    step = state.load(run / CHECKPOINT) if (run / CHECKPOINT).exists() else 0
    started, total = time.process_time(), {}
    while step < options.steps:
        step += 1
        batch = people.batch(np.random.default_rng([options.seed, step]), options)
        for name, value in state.step(batch, step, run).items():
            total[name] = total.get(name, 0.0) + value / options.log_every
        last = step == options.steps
        if step % options.save_every == 0 or last:
            state.save(run / CHECKPOINT, step)
        if step % options.look_every == 0 or last:
            people.look()
            if people.held:
                total |= held_out(state.averaged, people, run / f"samples/{step:06d}.png")
        if step % options.log_every == 0 or last:
            seconds = (time.process_time() - started) / options.log_every
            figures = {
                "step": step,
                "people": len(people.people),
                "cpu_per_step": round(seconds, 3),
            }
            figures |= {name: round(value, 6) for name, value in total.items()}
            with (run / "stats.jsonl").open("a") as file:
                file.write(json.dumps(figures) + "\n")
            yield figures
            started, total = time.process_time(), {}


class _State:
    """The networks of a run, and one step of both."""

    def __init__(self, options):
        torch.manual_seed(options.seed)
        self.options = options
        self.network, self.averaged = (
            TransferNet(options.network).to(memory_format=torch.channels_last) for _ in range(2)
        )
        self.averaged.load_state_dict(self.network.state_dict())
        # The judge sees the paper's pair and the picture: patches of 70x70.
        self.judge = losses.PatchDiscriminator(6, options.judge_channels, kernel=4)
        self.adam = torch.optim.AdamW(self.network.parameters(), weight_decay=1e-4)
        self.judge_adam = torch.optim.AdamW(self.judge.parameters(), betas=(0.5, 0.999))
        self.modules = {"network": self.network, "averaged": self.averaged, "judge": self.judge}
        self.optimizers = {"adam": self.adam, "judge_adam": self.judge_adam}
        self.half = None

    def load(self, path):
        return runs.load_checkpoint(path, self.modules, self.optimizers)

    def save(self, path, step):
        runs.save_checkpoint(path, step, self.modules, self.optimizers)

    def _make(self, batch):
        inputs = self.options.network.inputs
        x = stacked(batch, inputs).contiguous(memory_format=torch.channels_last)
        with torch.autocast("cpu", torch.bfloat16, enabled=bool(self.half)):
            outputs = self.network(x)
        return compose(outputs, batch, inputs)

    def _work(self, batch):
        x = stacked(batch, self.options.network.inputs)
        network = TransferNet(self.options.network).to(memory_format=torch.channels_last)
        network(x.contiguous(memory_format=torch.channels_last)).float().mean().backward()

    def step(self, batch, step, run):
        """Train on one batch; returns the parts of the loss."""
        options = self.options
        if self.half is None:
            self.half = runs.bfloat16_pays(partial(self._work, batch))
            log.info("%s: %s", run, "bfloat16" if self.half else "float32")
        for group in self.adam.param_groups:
            group["lr"] = runs.rate_at(step, options)
        for group in self.judge_adam.param_groups:
            group["lr"] = options.judge_rate
        self.network.train()
        made, truth, weight = self._make(batch), batch["truth"], batch["weight"]
        parts = {
            "pixel": losses.pixel_loss(made, truth, weight),
            "detail": losses.detail_loss(made, truth, weight),
            "structure": losses.structure_loss(made, truth, weight),
        }
        judging = 0 <= options.adversarial_from < step
        if judging:
            pair_ = torch.cat([batch["source"], batch["target_neutral"]], 1)
            rest, face = batch["target_neutral"], (weight > 0).float()
            self.judge.requires_grad_(False)
            logits = self.judge(pair_, (made - rest) * face)
            counts = torch.nn.functional.adaptive_avg_pool2d(weight, logits.shape[-2:])
            parts["adversarial"] = losses.judged(logits, True, counts)
            self.judge.requires_grad_(True)
        loss = sum(getattr(options, name) * value for name, value in parts.items())
        if not torch.isfinite(loss):
            raise ModelError(
                f"{run}: the loss is not finite at step {step}; the last checkpoint is kept, start "
                "again with a lower rate"
            )
        self.adam.zero_grad(set_to_none=True)
        loss.backward()
        torch.nn.utils.clip_grad_norm_(self.network.parameters(), 5.0)
        self.adam.step()
        if judging:
            self.judge_adam.zero_grad(set_to_none=True)
            right = losses.judged(self.judge(pair_, (truth - rest) * face), True, counts)
            wrong = losses.judged(self.judge(pair_, (made.detach() - rest) * face), False, counts)
            parts["judge"] = (right + wrong) / 2
            parts["judge"].backward()
            self.judge_adam.step()
        runs.average(self.averaged, self.network, min(options.average, (1 + step) / (10 + step)))
        return {name: float(value.detach()) for name, value in parts.items()}


@torch.inference_mode()
def held_out(network, people, sheet, shown=6):
    """Mean absolute error over pairs of held-out people, made and by direct delta, and a sheet.

    With one person held out, that person is the target of all that is learned from.
    """
    network.eval()
    inputs, lines, errors = network.options.inputs, [], {"made": [], "delta": []}
    sources = people.held if len(people.held) > 1 else people.people
    expressions = len(people.held[0][0])
    for number in range(12):
        one, other = sources[number % len(sources)], people.held[(number + 1) % len(people.held)]
        batch = tensors([pair(one, other, (7 * number + 3) % expressions)])
        made = compose(network(stacked(batch, inputs)), batch, inputs)
        rest = batch["target_neutral"]
        delta = (rest + batch["source"] - batch["source_neutral"]).clamp(0, 1)
        counts = torch.from_numpy(people.weight > 0)[None, None] * batch["seen"]
        for name, picture in (("made", made), ("delta", delta)):
            errors[name].append(float(losses.pixel_loss(picture, batch["truth"], counts)))
        if number < shown:
            row = (batch["source"], rest, delta, made, batch["truth"])
            lines.append(torch.cat([part[0] for part in row], 2))
    picture = torch.cat(lines, 1).permute(1, 2, 0).numpy()
    write_image(sheet, picture, mark=PAINTED)
    return {f"held_{name}": float(np.mean(values)) for name, values in errors.items()}


def export(run, path):
    """Fold the averaged network of a run and write it in half precision.

    Returns:
        dict of figures: step, parameters, bytes.

    Raises:
        InputError: the folder holds no run.
    """
    run, path = Path(run), Path(path)
    try:
        table = json.loads((run / "options.json").read_text())
        stored = load_file(run / CHECKPOINT)
    except OSError as error:
        raise InputError(f"{run}: no run of `bakery train transfer` ({error})") from None
    options = options_from(TransferOptions, table, str(run)).network
    network, prefix = TransferNet(options), "averaged."
    network.load_state_dict(
        {k.removeprefix(prefix): v for k, v in stored.items() if k.startswith(prefix)}
    )
    weights = {name: value.half() for name, value in fold(network.eval()).items()}
    about = {"kind": KIND} | json.loads(json.dumps(vars(options)))
    write_bytes(path, save_tensors(weights, {"transfer": json.dumps(about, sort_keys=True)}))
    return {
        "step": int(stored["step"]),
        "parameters": sum(value.numel() for value in weights.values()),
        "bytes": path.stat().st_size,
    }
