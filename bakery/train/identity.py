"""Training of the identity features (`bakery.generators.identity`) on the people of pairs.

Every subject of the shards is a class; the pictures are its neutral photo and its targets, black
outside the face. A large-margin cosine loss draws each person's pictures together.
"""

import json
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import cv2
import numpy as np
import torch
from safetensors.torch import save
from torch import nn
from torch.nn import functional

from bakery.detectors.blocks import fold
from bakery.errors import InputError
from bakery.formats.files import write_bytes
from bakery.generators.identity import FEATURES, SIZE, IdentityNet, features_of, verify
from bakery.settings import SEEDS, Settings, setting
from bakery.synth.pairs import Shard, shards_of
from bakery.train import runs

KEPT = 128  # pixels a side of the pictures in memory: room for crops of SIZE
HELD_OUT = 8  # every so-manieth subject of a folder is measured on, not learned from
CHECKPOINT = "checkpoint.safetensors"


@dataclass(frozen=True)
class IdentityOptions(Settings):
    """How to train."""

    steps: int = setting(1500, "of training", 1, 10**7)
    batch: int = setting(40, "samples a step", 2, 65536)
    # One cycle: up in a tenth of the steps, down to nothing.
    rate: float = setting(2e-3, "of Adam, at its highest", 0, 1)
    decay: float = setting(1e-3, "weight decay", 0, 1)
    # Wang et al., "CosFace", CVPR 2018, eq. 4: s and m.
    scale: float = setting(20.0, "of the cosines", 1e-3, 1000)
    margin: float = setting(0.2, "of the cosines", 0, 2)
    photos: float = setting(
        0.3, "share of samples from folders of photographs, if there are any", 0, 1
    )
    seed: int = setting(0, "of all chance", 0, SEEDS)


def pictures_of(folder):
    """The faces of a folder of shards.

    Returns:
        pictures [n, KEPT, KEPT, 3] uint8, black outside the face, and subjects [n].
    """
    pictures, subjects = [], []
    for path in shards_of(folder):
        shard, last = Shard(path), None
        for k in range(len(shard)):
            subject = int(shard.number("subject")[k])
            if subject != last:
                pictures.append(_face(shard.picture("photo", k), shard.picture("photo_face", k)))
                subjects.append(subject)
            last = subject
            pictures.append(_face(shard.picture("target", k), shard.picture("face", k)))
            subjects.append(subject)
    return np.stack(pictures), np.array(subjects)


def _face(picture, face):
    masked = (picture * (face[..., None] / 255.0)).astype(np.uint8)
    return cv2.resize(masked, (KEPT, KEPT), interpolation=cv2.INTER_AREA)


class People:
    """Labelled faces of several folders, split into those to learn from and those held out."""

    def __init__(self, folders, photos=()):
        self.pictures, self.rows, self.held = [], [], []
        self.real = []
        count = 0
        for folder in (*folders, *photos):
            pictures, subjects = pictures_of(folder)
            for number, subject in enumerate(np.unique(subjects)):
                rows = count + np.flatnonzero(subjects == subject)
                held = number % HELD_OUT == HELD_OUT - 1
                (self.held if held else self.rows).append(rows)
                if not held:
                    self.real.append(folder in photos)
            self.pictures.append(pictures)
            count += len(pictures)
        self.pictures = np.concatenate(self.pictures)
        self.real = np.array(self.real)
        if len(self.rows) < 2 or len(self.held) < 2:
            raise InputError(
                f"{len(self.rows) + len(self.held)} people in the shards; at least "
                f"{2 * HELD_OUT} are needed; paint more with `bakery synth pairs`"
            )

    def batch(self, rng, options):
        """Pictures [B, 3, SIZE, SIZE] float 0..1 and classes [B]."""
        chance = np.where(self.real, options.photos / max(self.real.sum(), 1), 0.0)
        painted = ~self.real
        rest = 1 - chance.sum()
        chance = chance + np.where(painted, rest / max(painted.sum(), 1), 0.0)
        classes = rng.choice(len(self.rows), options.batch, p=chance / chance.sum())
        pictures = np.stack([varied(rng, self.pictures[rng.choice(self.rows[c])]) for c in classes])
        return torch.from_numpy(pictures).permute(0, 3, 1, 2), torch.from_numpy(classes)


def varied(rng, picture):
    """A crop of a face [KEPT, KEPT, 3] uint8 as another camera might have it: [SIZE, SIZE, 3] 0..1."""
    angle, scale = rng.normal() * 4, SIZE / KEPT * np.exp(rng.normal() * 0.05)
    matrix = cv2.getRotationMatrix2D((KEPT / 2, KEPT / 2), angle, scale)
    matrix[:, 2] += (SIZE - KEPT) / 2 + rng.normal(size=2) * 2.0
    out = cv2.warpAffine(picture, matrix, (SIZE, SIZE), flags=cv2.INTER_AREA) / np.float32(255)
    if rng.random() < 0.5:
        out = out[:, ::-1]
    gain = np.exp(rng.normal(size=3) * 0.06 + rng.normal() * 0.15)
    out = (out * gain) ** np.exp(rng.normal() * 0.12)
    if rng.random() < 0.3:  # hair over the forehead, a hand: something that is no face
        y, x = rng.integers(0, SIZE, 2)
        h, w = rng.integers(10, 40, 2)
        out[y : y + h, x : x + w] = 0
    if rng.random() < 0.3:
        out = cv2.GaussianBlur(np.ascontiguousarray(out), (0, 0), rng.uniform(0.4, 1.4))
    out = out + rng.normal(size=out.shape) * rng.uniform(0, 0.02)
    return np.clip(out, 0, 1).astype(np.float32)


class Margin(nn.Module):
    """Large-margin cosine loss over the classes."""

    def __init__(self, classes, options):
        super().__init__()
        self.weight = nn.Parameter(torch.randn(classes, FEATURES) * 0.1)
        self.scale, self.margin = options.scale, options.margin

    def forward(self, features, classes):
        cosine = features @ functional.normalize(self.weight).T
        cosine = cosine - self.margin * functional.one_hot(classes, len(self.weight))
        return functional.cross_entropy(self.scale * cosine, classes)


def train(run, people, options=None):
    """Train, or go on with, a run.

    Args:
        run: Path of its folder.
        people: People.
        options: IdentityOptions.

    Yields:
        dict of figures, every 100 steps.

    Raises:
        InputError: the run was started with other options, or its loss is no number.
    """
    options = options or IdentityOptions()
    run.mkdir(parents=True, exist_ok=True)
    runs.keep_options(run, options)
    torch.manual_seed(options.seed)
    network, loss = IdentityNet(), Margin(len(people.rows), options)
    network.to(memory_format=torch.channels_last)
    parameters = [*network.parameters(), *loss.parameters()]
    optimizer = torch.optim.AdamW(parameters, options.rate, weight_decay=options.decay)
    modules, start = {"network": network, "loss": loss}, 0
    if (run / CHECKPOINT).exists():
        start = runs.load_checkpoint(run / CHECKPOINT, modules, {"adam": optimizer})
    total, half = [], None
    for step in range(start, options.steps):
        for group in optimizer.param_groups:
            group["lr"] = options.rate * _cycle((step + 1) / options.steps)
        pictures, classes = people.batch(np.random.default_rng([options.seed, step]), options)
        network.train()
        pictures = pictures.contiguous(memory_format=torch.channels_last)
        if half is None:
            half = runs.bfloat16_pays(partial(_work, network, pictures))
        with torch.autocast("cpu", torch.bfloat16, enabled=half):
            features = network(pictures)
        value = loss(features.float(), classes)
        if not torch.isfinite(value):
            raise InputError(f"{run}: the loss of step {step} is no number; lower the rate")
        optimizer.zero_grad()
        value.backward()
        optimizer.step()
        total.append(float(value.detach()))
        if (step + 1) % 100 == 0 or step + 1 == options.steps:
            figures = {"step": step + 1, "loss": float(np.mean(total)), **held_out(network, people)}
            total = []
            runs.save_checkpoint(run / CHECKPOINT, step + 1, modules, {"adam": optimizer})
            with open(run / "curve.jsonl", "a", encoding="utf-8") as file:
                file.write(json.dumps(figures) + "\n")
            yield figures


def _work(network, pictures):
    """A step's worth of computing, to time."""
    network(pictures).float().sum().backward()


def _cycle(share):
    return share / 0.1 if share < 0.1 else 0.5 + 0.5 * np.cos(np.pi * (share - 0.1) / 0.9)


def held_out(network, people):
    """AUC and equal error rate among the people that are not learned from."""
    rows = np.concatenate(people.held)
    who = np.concatenate([np.full(len(own), k) for k, own in enumerate(people.held)])
    found = verify(features_of(network.eval(), people.pictures[rows]), who)
    return {"auc": found.auc, "eer": found.equal_error}


def export(run, path):
    """Write the network of a run: batch normalisation folded, half precision.

    Returns:
        dict of figures: step, parameters, bytes.
    """
    network = IdentityNet()
    step = runs.load_checkpoint(Path(run) / CHECKPOINT, {"network": network}, {})
    tensors = {name: value.half().contiguous() for name, value in fold(network.eval()).items()}
    write_bytes(path, save(tensors))
    count = sum(value.numel() for value in tensors.values())
    return {"step": step, "parameters": count, "bytes": Path(path).stat().st_size}
