"""Training of the segmentation network on painted portraits and on real ones.

All pictures lie in the memory of the device, and batches are made there. A run folder holds
options.json, stats.jsonl and checkpoint.safetensors; a run that was stopped goes on from it.
"""

import json
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import torch
from safetensors.torch import load_file
from safetensors.torch import save as save_tensors

from bakery.detectors import portrait, segmenter
from bakery.detectors.blocks import fold
from bakery.detectors.segmenter import SegmentNet, outlines
from bakery.errors import InputError, ModelError
from bakery.formats.files import write_bytes
from bakery.settings import SEEDS, Settings, setting
from bakery.train import runs
from bakery.train.segment import augment, bank, camera, losses
from bakery.train.segment.beginning import begin

CHECKPOINT = "checkpoint.safetensors"
STATS = "stats.jsonl"


@dataclass(frozen=True)
class SegmentTraining(Settings):
    """How the segmentation network is trained."""

    steps: int = setting(20000, "of training", 1, 10**7)
    batch: int = setting(64, "pictures a step", 2, 4096)
    real: float = setting(0.25, "share of real portraits in a batch", 0, 0.9)
    rate: float = setting(3e-3, "of learning, after a warm-up of 200 steps", 0, 1)
    average: float = setting(
        0.999, "how much of the old stays at each step in the weights that ship", 0, 1
    )
    weight_decay: float = setting(1e-3, "of Adam", 0, 1)
    person: float = setting(0.5, "weight of the person's outline", 0, 100)
    shadow: float = setting(0.5, "weight of the cast shadow", 0, 100)
    dice: float = setting(0.5, "weight of the overlap of each class", 0, 100)
    mirror: float = setting(0.0, "weight of mirror images that should agree", 0, 100)
    things: float = setting(0.15, "share of pictures with a thing drawn before them", 0, 1)
    shadows: float = setting(0.2, "share of pictures with a shadow drawn over them", 0, 1)
    clothes: float = setting(0.5, "share of painted pictures with other clothes", 0, 1)
    held: int = setting(64, "painted pictures kept for measuring", 1, 10**6)
    backdrops: int = setting(400, "procedural backgrounds", 1, 10**6)
    log_every: int = setting(100, "steps", 1, 10**7)
    measure_every: int = setting(1000, "steps", 1, 10**7)
    begin: str = setting(
        "", "weights as they ship to begin from; their normalisation is measured anew"
    )
    seed: int = setting(0, "of all chance", 0, SEEDS)


@dataclass(frozen=True)
class Sources:
    """Where the pictures are."""

    bank: Path  # folder of `bakery synth portraits`
    real: Path | None = None  # npz of `bakery train portraits`
    teacher: Path | None = None  # weights that label real pictures where nobody knew


def train(
    run: Path,
    sources: Sources,
    options: SegmentTraining | None = None,
    device: str = "cpu",
    minutes: float | None = None,
    save_every: float = 60.0,
) -> Iterator[dict]:
    """Train the segmentation network, or go on with it.

    Args:
        run: folder of the run; made when missing.
        options: a run that goes on may change `steps`, nothing else.
        device: "cpu" or "cuda".
        minutes: of all calls together after which the run ends; the rate falls to zero by then.
        save_every: seconds between checkpoints.

    Yields:
        dict of figures every `log_every` steps.

    Raises:
        InputError: pictures are missing, the device is, or the run was started with other options.
        ModelError: the loss is not finite.
    """
    options = options or SegmentTraining()
    if device == "cuda" and not torch.cuda.is_available():
        raise InputError("no CUDA device here; use --device cpu")
    run = Path(run)
    run.mkdir(parents=True, exist_ok=True)
    runs.keep_options(run, options)
    stats = run / STATS
    spent = _last(stats).get("seconds", 0.0)
    pictures = Data(sources, options, device)
    torch.backends.cudnn.benchmark = True  # all batches have one shape
    torch.manual_seed(options.seed)
    network, averaged = (SegmentNet().to(device, memory_format=torch.channels_last) for _ in "ab")
    checkpoint = run / CHECKPOINT
    if options.begin and not checkpoint.exists():
        begin(network, Path(options.begin), _stack(pictures.batch()))
    averaged.load_state_dict(network.state_dict())
    averaged.eval()
    optimizer = torch.optim.AdamW(
        network.parameters(), weight_decay=options.weight_decay, fused=device == "cuda"
    )
    modules, optimizers = {"network": network, "averaged": averaged}, {"adam": optimizer}
    step = runs.load_checkpoint(checkpoint, modules, optimizers) if checkpoint.exists() else 0
    weight = losses.weights(device)
    started = saved = time.monotonic()
    total: dict = {}

    def clock():
        return spent + time.monotonic() - started

    while step < options.steps and not (minutes and clock() >= 60 * minutes):
        step += 1
        done = max((step - 1) / options.steps, clock() / (60 * minutes) if minutes else 0)
        for group in optimizer.param_groups:
            group["lr"] = rate_at(step, done, options)
        torch.manual_seed(options.seed * 1_000_003 + step)
        parts = _step(network, averaged, optimizer, pictures.batch(), weight, options, device)
        runs.average(averaged, network, min(options.average, (1 + step) / (10 + step)))
        for name, value in parts.items():
            total[name] = total.get(name, 0) + value / options.log_every
        if step % options.log_every == 0:
            figures = {"step": step, "seconds": round(clock(), 2), "pictures": pictures.refresh()}
            figures |= {name: round(float(value), 5) for name, value in total.items()}
            if not all(value == value and abs(value) < 1e6 for value in figures.values()):
                raise ModelError(
                    f"{run}: the loss is not finite at step {step}; the last checkpoint is kept, "
                    "start again with a lower rate"
                )
            if step % options.measure_every == 0:
                figures["held_iou"] = pictures.measure(averaged)
            with stats.open("a") as file:
                file.write(json.dumps(figures) + "\n")
            yield figures
            total = {}
        if time.monotonic() - saved > save_every:
            runs.save_checkpoint(checkpoint, step, modules, optimizers)
            saved = time.monotonic()
    runs.save_checkpoint(checkpoint, step, modules, optimizers)


def _last(stats):
    """The figures that a run ended with."""
    lines = stats.read_text().splitlines() if stats.exists() else []
    return json.loads(lines[-1]) if lines else {}


def rate_at(step: int, done: float, options: SegmentTraining) -> float:
    """Learning rate: warm-up, plateau, linear fall to zero over the second half of the run.

    Args:
        done: share of the run that is over.
    """
    return options.rate * min(1.0, step / 200) * min(1.0, max(2 * (1 - done), 0.0))


def _stack(batch):
    """What the network is shown of a batch [B, 3 + outlines, S, S]."""
    stack = torch.cat([batch.image, outlines(batch.points)], 1)
    return stack.contiguous(memory_format=torch.channels_last)


def _step(network, averaged, optimizer, batch, weight, options, device):
    """One step; the parts of the loss as tensors, so that nothing waits for the device."""
    network.train()
    stack = _stack(batch)
    with torch.autocast(device, torch.bfloat16, enabled=device == "cuda"):
        logits, shadow = network(stack)
    parts = losses.loss_of(logits, shadow, batch, weight)
    loss = parts["cross"] + options.dice * parts["dice"]
    loss = loss + options.person * parts["person"] + options.shadow * parts["shadow"]
    if options.mirror:
        with torch.no_grad(), torch.autocast(device, torch.bfloat16, enabled=device == "cuda"):
            other = averaged(stack.flip(-1))[0].flip(-1).float()
        parts["mirror"] = losses.agreement(logits, other, batch)
        loss = loss + options.mirror * parts["mirror"]
    optimizer.zero_grad(set_to_none=True)
    loss.backward()
    torch.nn.utils.clip_grad_norm_(network.parameters(), 5.0)
    optimizer.step()
    return {name: value.detach() for name, value in parts.items()}


class Data:
    """The pictures of a run on its device."""

    def __init__(self, sources: Sources, options: SegmentTraining, device: str):
        self.seen: set[Path] = set()
        everyone = bank.painted(sources.bank, device, self.seen)
        held = min(options.held, len(everyone) // 2)
        self.painted = everyone.rows(slice(0, len(everyone) - held))
        self.held = everyone.rows(slice(len(everyone) - held, None))
        if not len(self.painted):
            raise InputError(f"{sources.bank}: needs at least 2 pictures; paint more")
        self.real = (
            bank.photographed(sources.real, device, sources.teacher) if sources.real else None
        )
        self.backdrops = bank.backgrounds(options.backdrops, options.seed, device)
        self.options, self.sources, self.device = options, sources, device

    def refresh(self) -> int:
        """Read what was painted since; returns how many painted pictures there are."""
        try:
            self.painted = self.painted + bank.painted(self.sources.bank, self.device, self.seen)
        except InputError:
            pass  # nothing new
        return len(self.painted)

    def _drawn(self, pictures, count):
        at = torch.randint(len(pictures), (count,), device=pictures.image.device)
        return pictures.rows(at)

    def batch(self) -> augment.Batch:
        """A batch by the torch seed of the step."""
        options = self.options
        real = round(options.batch * options.real) if self.real is not None else 0
        some = self._drawn(self.painted, options.batch - real)
        if real:
            photos = self._drawn(self.real, real)
            fields = zip(*(vars(part).values() for part in (some, photos)))
            some = bank.Pictures(*(torch.cat(pair) for pair in fields))
        batch = augment.cut(some, augment.backdrops_for(some, self.backdrops))
        textures = augment.backdrops_for(some, self.backdrops)
        whole = len(batch.image) - real  # real people keep their clothes
        batch = augment.dressed(batch, textures, options.clothes, whole)
        batch = augment.mirrored(batch)
        batch = augment.with_things(batch, textures.flip(0), options.things)
        batch = augment.with_shadows(batch, options.shadows)
        return replace(batch, image=camera.photograph(batch.image))

    @torch.inference_mode()
    def measure(self, network: SegmentNet) -> float:
        """Mean IoU of the classes on the painted pictures held back."""
        classes = len(portrait.CLASSES)
        counts = torch.zeros(classes * classes, device=self.held.image.device)
        for start in range(0, len(self.held), 16):
            some = self.held.rows(slice(start, start + 16))
            at = (torch.arange(len(some), device=counts.device) + start) % len(self.backdrops)
            batch = augment.cut(some, self.backdrops[at], 0.0)
            answer = network(_stack(batch))[0].argmax(1)
            known = batch.label != portrait.UNSURE
            pair = batch.label[known] * classes + answer[known]
            counts += torch.bincount(pair, minlength=classes * classes)
        table = counts.view(classes, classes)
        both, either = table.diag(), table.sum(0) + table.sum(1) - table.diag()
        there = table.sum(1) > 0
        return round(float((both[there] / either[there]).mean()), 4)


def export(run: Path, path: Path, other: Path | None = None) -> None:
    """Write the averaged weights of a run, folded and in half precision.

    Args:
        other: weights written so of the run that this one began with; the mean of both is written.

    Raises:
        InputError: the run has no checkpoint.
        ModelError: the other weights are missing or damaged.
    """
    checkpoint = Path(run) / CHECKPOINT
    if not checkpoint.exists():
        raise InputError(f"{run}: has no {CHECKPOINT}; train first")
    network = SegmentNet()
    prefix = "averaged."
    stored = load_file(checkpoint)
    network.load_state_dict(
        {k.removeprefix(prefix): v for k, v in stored.items() if k.startswith(prefix)}
    )
    tensors = fold(network.eval())
    if other is not None:
        begun = segmenter.load(Path(other)).state_dict()
        tensors = {name: (value + begun[name]) / 2 for name, value in tensors.items()}
    tensors = {name: value.half() for name, value in tensors.items()}
    write_bytes(path, save_tensors(tensors))
