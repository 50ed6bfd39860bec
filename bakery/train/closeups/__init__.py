"""Training of the close-up networks on people whose points are known: painted ones and photographs.

A run folder holds options.json and the crops of each person (`closeup_crops`), so that a run that was
stopped while it painted goes on.
"""

import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from safetensors.torch import save_file

from bakery import landmarks as marks
from bakery.detectors.blocks import CloseupNet, fold
from bakery.detectors.closeups import SIDE
from bakery.errors import ModelError
from bakery.settings import SEEDS, Settings, setting
from bakery.synth import skins as skins_of_people
from bakery.synth.quick import make_stage
from bakery.train import runs
from bakery.train.closeups import crops as crops_of_people
from bakery.train.photos import read_photos

TEXELS = 512  # side of the quick painter's skins
RIMS = np.concatenate([marks.LIPS, *marks.EYES, marks.BROWS, [marks.LEFT_IRIS.start]])
RIM = 3.0  # what a point of these counts in the loss, over one of the skin around


@dataclass(frozen=True)
class CloseupOptions(Settings):
    """How the close-up networks are trained."""

    quick: int = setting(230, "people of the quick painter", 0, 100000)
    careful: int = setting(98, "people of the careful painter", 0, 100000)
    frames: int = setting(
        8, "painted of each by the quick painter, half as many by the careful one", 2, 1000
    )
    copies: int = setting(2, "cameras that look at each frame", 1, 100)
    photo_copies: int = setting(5, "cameras that look at each photograph", 1, 100)
    held: int = setting(16, "every so many people, one is measured and not learned from", 2, 100000)
    steps: int = setting(1600, "of training", 1, 10**7)
    batch: int = setting(64, "crops a step", 1, 65536)
    rate: float = setting(2e-3, "of learning", 0, 1)
    average: float = setting(
        0.995, "how much of the old stays at each step in the weights that ship", 0, 1
    )
    log_every: int = setting(100, "steps", 1, 10**7)
    seed: int = setting(0, "of all chance", 0, SEEDS)


def collect(run, head, skins, photos, dense, options, progress=None):
    """Paint all people and cut all crops that the run folder does not hold yet.

    Args:
        run: Path of the run's folder; made if missing.
        head: HeadModel.
        skins: folder of `bakery synth skins`, or None for painted skin alone.
        photos: folder of photographs, or None; dense: npz with their 478 points.
        options: CloseupOptions. A run that goes on may change what belongs to the training alone.
        progress: called with (step, done, total).

    Raises:
        InputError: skins or photographs are missing, or the run was started with other options.
    """
    run = Path(run)
    run.mkdir(parents=True, exist_ok=True)
    free = ("quick", "careful", "held", "steps", "batch", "rate", "average", "log_every")
    runs.keep_options(run, options, free)
    tones = skins_of_people.by_tone(skins_of_people.skins_of(skins, head)) if skins else []
    people = sitters(photos, dense) if photos else {}
    stage = make_stage(head, TEXELS)

    def pictures(kind, number, rng):
        if kind == "photo":
            return people[number]
        if kind == "quick":
            return crops_of_people.quick_frames(rng, stage, tones, options.frames)
        return crops_of_people.careful_frames(rng, head, options.frames // 2)

    counts = {"photo": len(people), "quick": options.quick, "careful": options.careful}
    wanted = [(n / count, n, kind) for kind, count in counts.items() for n in range(count)]
    for done, (_, number, kind) in enumerate(sorted(wanted)):  # kinds take turns
        if progress is not None:
            progress("paint", done, len(wanted))
        path = run / f"{kind}-{number:04d}.npz"
        if path.exists():
            continue
        rng = np.random.default_rng([options.seed, *kind.encode(), number])
        copies = options.photo_copies if kind == "photo" else options.copies
        table = crops_of_people.table_of(rng, pictures(kind, number, rng), copies)
        aside = path.with_suffix(".tmp.npz")
        np.savez(aside, **table)
        os.replace(aside, path)


def sitters(photos, dense):
    """The photographs of each person, {number: list of picture and points}; names are N_*.jpg."""
    found = {}
    for photo in read_photos(photos, dense):
        picture = np.ascontiguousarray(photo.image[..., ::-1])
        found.setdefault(photo.name.split("_")[0], []).append((picture, photo.points[:, :2]))
    return dict(enumerate(found.values()))


def read_crops(run, name, rows, options):
    """The crops of a run: learned from, and held out by kind of person.

    Args:
        name: "eye" or "mouth".
        rows: [crops, n] the points to learn, see `closeup_crops.rows_seen`.

    Returns:
        (crops [N, W, W] uint8, points [N, n, 2]) to learn from, and {kind: the same} to measure.
    """
    parts = {}
    for path in sorted(Path(run).glob("*-????.npz")):
        kind, number = path.stem.split("-")
        held = int(number) % options.held == options.held - 1
        with np.load(path) as table:
            crops, points = table[name + "s"], table[name + "_points"]
        which = np.arange(len(crops)) % len(rows)  # left and right eyes take turns
        part = crops, points[np.arange(len(crops))[:, None], rows[which]]
        parts.setdefault(kind if held else "", []).append(part)
    joined = {
        kind: tuple(np.concatenate(column) for column in zip(*some)) for kind, some in parts.items()
    }
    return joined.pop(""), joined


def train(crops, points, options, held=None, mirror=None, importance=None):
    """Train one network.

    Args:
        crops: [N, W, W] uint8; points: [N, n, 2], see `closeup_crops.crops_of`.
        held: {name: crops and points} that are measured and not learned from.
        mirror: [n] which point takes whose place in the mirror, or None.
        importance: [n] of each point in the loss, or None for all alike.

    Yields:
        dict of figures; the last one has "tensors", what ships.

    Raises:
        ModelError: the loss is not finite.
    """
    torch.manual_seed(options.seed)
    rng = np.random.default_rng(options.seed)
    count = points.shape[1]
    network, averaged = CloseupNet(count), CloseupNet(count)
    sample = torch.zeros(options.batch, SIDE, SIDE, dtype=torch.uint8)
    half = runs.bfloat16_pays(lambda: averaged(sample).sum().backward())
    network.mean_shape.copy_(torch.from_numpy(points.mean(0)))
    averaged.load_state_dict(network.state_dict())
    optimizer = torch.optim.AdamW(network.parameters(), weight_decay=1e-4)
    share = torch.ones(count) if importance is None else torch.from_numpy(importance).float()
    share = share / share.mean()
    test = {
        name: [torch.from_numpy(part) for part in crops_of_people.jittered(rng, *some)]
        for name, some in (held or {}).items()
    }
    for step in range(1, options.steps + 1):
        for group in optimizer.param_groups:
            fall = min(1.0, 2 * (options.steps - step + 1) / options.steps)
            group["lr"] = options.rate * min(1.0, step / 100) * fall
        chosen = rng.integers(len(crops), size=options.batch)
        batch, target = crops_of_people.jittered(rng, crops[chosen], points[chosen])
        if mirror is not None:
            flip = rng.random(len(batch)) < 0.5
            batch[flip] = batch[flip, :, ::-1]
            target[flip] = target[flip][:, mirror] * np.float32([-1, 1])
        network.train()
        with torch.autocast("cpu", torch.bfloat16, enabled=half):
            found = network(torch.from_numpy(batch))
        loss = ((found - torch.from_numpy(target)).norm(dim=-1) * share).mean()
        if not torch.isfinite(loss):
            raise ModelError(f"the loss is not finite at step {step}; give a lower rate")
        optimizer.zero_grad(set_to_none=True)
        loss.backward()
        torch.nn.utils.clip_grad_norm_(network.parameters(), 5.0)
        optimizer.step()
        runs.average(averaged, network, min(options.average, step / (10 + step)))
        if step % options.log_every == 0 or step == options.steps:
            averaged.eval()
            figures = {"step": step, "loss": round(loss.item(), 5)}
            with torch.inference_mode():
                for name, (seen, truth) in test.items():
                    miss = ((averaged(seen) - truth).norm(dim=-1) * share).mean()
                    figures["held_out_" + name] = round(float(miss), 5)
            yield figures
    yield {"tensors": fold(averaged.eval())}


def train_part(name, run, head, options):
    """`train` on the "eye" or the "mouth" crops of what `collect` wrote; tensors with their rows."""
    eyes, mouth = crops_of_people.rows_seen(head)
    rows = eyes if name == "eye" else mouth
    mirror = crops_of_people.mirrored_rows(head, mouth[0]) if name == "mouth" else None
    importance = np.where(np.isin(rows[0], RIMS), RIM, 1.0)
    (crops, points), held = read_crops(run, name, rows, options)
    for figures in train(crops, points, options, held, mirror, importance):
        if "tensors" in figures:
            figures["tensors"]["rows"] = torch.from_numpy(rows)
        yield figures


def export(eye, mouth, path):
    """Write what `train_part` gave for eyes and mouth into one file, half precision."""
    tensors = {}
    for name, part in (("eye", eye), ("mouth", mouth)):
        for key, value in part.items():
            tensors[f"{name}.{key}"] = value.half() if value.is_floating_point() else value
    aside = Path(path).with_suffix(".tmp")
    save_file(tensors, aside)
    os.replace(aside, path)
