"""Training of the detector's two networks: one plain loop for both.

A run folder holds options.json, stats.jsonl (a line every `log_every` steps) and
checkpoint.safetensors. A run that was stopped goes on from its checkpoint and sees the samples it
would have seen. Loss that is not finite stops the run.
"""

import json
import logging
import os
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from safetensors.torch import load_file, save_file
from torch.utils.data import DataLoader, Subset

from bakery.detectors import frames
from bakery.detectors.blocks import FinderNet, PointsNet, fold
from bakery.errors import ModelError
from bakery.settings import SEEDS, Settings, setting
from bakery.train import dataset, runs
from bakery.train.backgrounds import Backgrounds
from bakery.train.detector.losses import finder_loss, point_errors, points_loss
from bakery.train.faces import Faces
from bakery.train.photos import read_photos, read_rendered

log = logging.getLogger(__name__)
NETWORKS = {"finder": FinderNet, "points": PointsNet}


@dataclass(frozen=True)
class DetectorOptions(Settings):
    """How one of the detector's networks is trained."""

    network: str = setting("points", "which", choices=tuple(NETWORKS))
    steps: int = setting(8000, "of training", 1, 10**7)
    batch: int = setting(32, "samples a step", 1, 65536)
    rate: float = setting(1.5e-3, "of learning, after a warm-up of 200 steps", 0, 1)
    decay_from: float = setting(
        0.5, "share of the steps after which the rate falls to zero", 0, 0.999
    )
    average: float = setting(
        0.998, "how much of the old stays at each step in the weights that ship", 0, 1
    )
    weight_decay: float = setting(1e-4, "of Adam", 0, 1)
    held_out: int = setting(0, "people at the end of the folder kept for measuring", 0, 10**6)
    background_count: int = setting(400, "procedural pictures", 0, 10**6)
    log_every: int = setting(50, "steps", 1, 10**7)
    save_every: int = setting(200, "steps", 1, 10**7)
    workers: int = setting(1, "processes that paint samples", 0, 256)
    seed: int = setting(0, "of all chance", 0, SEEDS)


def train(run, photos, dense, options=DetectorOptions(), rendered=(), backgrounds=()):
    """Train one network of the detector, or go on with it.

    Args:
        run: folder of the run; made when missing.
        photos: folder of photos.
        dense: npz with their points, see `photos.read_photos`.
        options: DetectorOptions. A run that goes on may change `steps`, nothing else.
        rendered: folders of painted pictures with points, see `photos.read_rendered`.
        backgrounds: folders of pictures without faces.

    Yields:
        dict of figures every `log_every` steps

    Raises:
        InputError: photos are missing, or the run was started with other options.
        ModelError: the loss is not finite.
    """
    run = Path(run)
    run.mkdir(parents=True, exist_ok=True)
    runs.keep_options(run, options)
    torch.manual_seed(options.seed)
    network = NETWORKS[options.network]().to(memory_format=torch.channels_last)
    averaged = NETWORKS[options.network]().to(memory_format=torch.channels_last)
    optimizer = torch.optim.AdamW(network.parameters(), weight_decay=options.weight_decay)
    people = read_photos(photos, dense)
    names = sorted({photo.name.split("_")[0] for photo in people})
    held = set(names[len(names) - options.held_out :])
    held_photos = [photo for photo in people if photo.name.split("_")[0] in held]
    people = [photo for photo in people if photo.name.split("_")[0] not in held]
    for folder in rendered:
        people += read_rendered(folder)
    faces = Faces(people, Backgrounds(backgrounds, options.background_count))
    if options.network == "points":
        network.mean_shape.copy_(torch.from_numpy(faces.mean_shape))
    averaged.load_state_dict(network.state_dict())
    checkpoint = run / "checkpoint.safetensors"
    modules, optimizers = {"network": network, "averaged": averaged}, {"adam": optimizer}
    step = runs.load_checkpoint(checkpoint, modules, optimizers) if checkpoint.exists() else 0
    kind = dataset.PointsSamples if options.network == "points" else dataset.FinderSamples
    samples = kind(faces, options.seed, options.steps * options.batch)
    todo = Subset(samples, range(step * options.batch, len(samples)))
    loader = DataLoader(
        todo,
        options.batch,
        num_workers=options.workers,
        worker_init_fn=runs.quiet_worker,
        multiprocessing_context="spawn" if options.workers else None,  # forks hang in OpenCV
        prefetch_factor=4 if options.workers else None,
    )
    half = _bfloat16_pays(network)
    log.info("%s: %s", run, "bfloat16" if half else "float32")
    started, total = time.monotonic(), {}
    for batch in loader:
        step += 1
        for group in optimizer.param_groups:
            group["lr"] = rate_at(step, options)
        loss, parts = _loss(network, batch, half)
        if not torch.isfinite(loss):
            raise ModelError(
                f"{run}: the loss is not finite at step {step}; the last checkpoint is kept, "
                "start again with a lower rate"
            )
        optimizer.zero_grad(set_to_none=True)
        loss.backward()
        torch.nn.utils.clip_grad_norm_(network.parameters(), 5.0)
        optimizer.step()
        runs.average(averaged, network, min(options.average, (1 + step) / (10 + step)))
        for name, value in parts.items():
            total[name] = total.get(name, 0.0) + value / options.log_every
        if step % options.save_every == 0 or step == options.steps:
            runs.save_checkpoint(checkpoint, step, modules, optimizers)
        if step % options.log_every == 0:
            seconds = (time.monotonic() - started) / options.log_every
            figures = {"step": step, "seconds_per_step": round(seconds, 4), **total}
            if held_photos and options.network == "points" and step % options.save_every == 0:
                figures["held_out"] = held_out_error(averaged, held_photos)
            with (run / "stats.jsonl").open("a") as file:
                file.write(json.dumps(figures) + "\n")
            yield figures
            started, total = time.monotonic(), {}


def rate_at(step, options):
    """Learning rate at a step: warm-up, plateau, linear fall to zero."""
    start = options.decay_from * options.steps
    fall = min(1.0, (options.steps - step + 1) / max(options.steps - start, 1))
    return options.rate * min(1.0, step / 200) * fall


def held_out_error(network, photos, seed=0):
    """Mean point distance / eye distance on upright crops that are a little off."""
    rng = np.random.default_rng(seed)
    network.eval()
    crops, targets = [], []
    for photo in photos:
        frame = frames.frame_of_points(photo.points)
        matrix = frames.crop_matrix(frame, dataset.CROP)
        matrix[:, 2] += rng.normal(0, 0.02 * dataset.CROP, 2)
        crop = frames.take_crop(photo.image, matrix, dataset.CROP)
        crops.append(np.ascontiguousarray(crop[..., ::-1].transpose(2, 0, 1)))
        targets.append(frames.apply_affine(matrix, photo.points[:, :2]) / dataset.CROP - 0.5)
    with torch.inference_mode():
        points = network(torch.from_numpy(np.stack(crops)).float() / 255)[0]
    target = torch.from_numpy(np.stack(targets)).float()
    return float(point_errors(points, target)[0].mean())


def export(finder_run, points_run, path):
    """Fold the averaged weights of two runs into one file, half precision.

    Args:
        finder_run, points_run: run folders of `train`.
        path: .safetensors to write.
    """
    tensors = {}
    for name, run in (("finder", finder_run), ("points", points_run)):
        network = NETWORKS[name]()
        stored = load_file(Path(run) / "checkpoint.safetensors")
        prefix = "averaged."
        network.load_state_dict(
            {k.removeprefix(prefix): v for k, v in stored.items() if k.startswith(prefix)}
        )
        for key, value in fold(network.eval()).items():
            tensors[f"{name}.{key}"] = value.half()
    aside = Path(path).with_suffix(".tmp")
    save_file(tensors, aside)
    os.replace(aside, path)


def _loss(network, batch, half):
    network.train()
    image = (batch[0].float() / 255).contiguous(memory_format=torch.channels_last)
    with torch.autocast("cpu", torch.bfloat16, enabled=half):
        output = network(image)
    if isinstance(network, PointsNet):
        return points_loss(output, batch[1], batch[2])
    return finder_loss(output, batch[1])


def _bfloat16_pays(network):
    """Whether a forward and backward pass takes less processor time in bfloat16 here."""
    size = dataset.CROP
    image = torch.rand(4, 3, size, size).contiguous(memory_format=torch.channels_last)
    state = {k: v.clone() for k, v in network.state_dict().items()}

    def work():
        output = network(image)
        output = output if isinstance(output, tuple) else (output,)
        sum(part.float().mean() for part in output).backward()

    pays = runs.bfloat16_pays(work)
    network.zero_grad(set_to_none=True)
    network.load_state_dict(state)
    return pays
