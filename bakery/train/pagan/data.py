"""Training samples of the generator: crops of pairs, balanced over subjects, deterministic."""

import hashlib
from collections import OrderedDict
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import torch
from torch.utils.data import Dataset

from bakery.formats.files import write_bytes
from bakery.generators.interior import FRAME_SCALE, interior_shade
from bakery.generators.unet import input_channels
from bakery.heads.base import PARTS
from bakery.landmarks import EYES, LIPS, LIPS_OUTER
from bakery.settings import Settings, setting
from bakery.synth.pairs import Shard, shards_of

UNIT = 16  # of the weight channel: what a pixel of plain skin counts
NOMINAL = 512  # pixels a side of a frame, whatever size its pair was painted at
INTERIOR = 0.1  # of the skin: where the loss counts on less, a pair shows eyes and mouth only
NEAR = 0.02  # of a frame: so near its middle a mouth or an eye counts, if it does at all
SCALES = 0.12  # a crop's window is up to so much larger or smaller than the crop


@dataclass(frozen=True)
class Cropping(Settings):
    """What part of a pair a sample shows, and what counts in it."""

    size: int = setting(256, "side of a crop; a frame has 512", 16, 512, unit="pixels")
    mouth: float = setting(0.35, "share of crops around the mouth", 0, 1)
    eyes: float = setting(0.15, "share around an eye; the rest lies anywhere on the face", 0, 1)
    mouth_weight: float = setting(
        4.0, "of a pixel inside the outer lips, over one of plain skin", 0, 1000
    )
    eye_weight: float = setting(2.0, "of a pixel of an eye, over one of plain skin", 0, 1000)
    whole: float = setting(0.0, "share of samples that show the whole frame, made smaller", 0, 1)
    # Resampled crops lack the finest detail of frames.
    exact: float = setting(0.0, "share of crops that are cut at whole pixels", 0, 1)
    color: float = setting(0.25, "spread of the log-gain of light and skin tone", 0, 5)


class Pairs:
    """All pairs of some folders of shards, decoded as they are asked for.

    Args:
        folders: of shards.
        memory: MiB of decoded pairs that are kept.
        held_out: every so-manieth subject is kept for measuring; 0 keeps none.
        cache: folder for decoded pairs, 6 MB each at 512 pixels, which processes share; None: none.
    """

    def __init__(self, folders, cropping=Cropping(), memory=1500, held_out=8, cache=None):
        self.cropping, self.memory = cropping, memory
        self.cache = Path(cache) if cache else None
        # A folder's people, a person's pairs: [folder][person][(shard, row, weight)].
        self.train, self.held = [], []
        for shards in ([Shard(path) for path in shards_of(folder)] for folder in folders):
            people = {}
            for shard in shards:
                rows = zip(shard.number("subject").tolist(), shard.number("expression"))
                for row, (subject, expression) in enumerate(rows):
                    # Neutral on neutral teaches restraint; one sample in four or so is enough.
                    weight = 0.25 + min(1.0, float(expression.sum()) / 2)
                    people.setdefault(subject, []).append((shard, row, weight))
            ordered = [people[subject] for subject in sorted(people)]
            held = ordered[held_out - 1 :: held_out] if held_out else []
            self.held.append(held)
            self.train.append([person for person in ordered if person not in held])
        self._kept, self._bytes = OrderedDict(), 0

    def decoded(self, shard, row):
        """The channels of a pair by name, uint8 [S, S, C], and its landmarks."""
        key = (shard.path, row)
        if key in self._kept:
            self._kept.move_to_end(key)
            return self._kept[key]
        layers = self._cached(shard, row) if self.cache else self._decode(shard[row])
        self._kept[key] = layers
        self._bytes += sum(layer.nbytes for layer in layers.values())
        while self._bytes > self.memory * 2**20 and len(self._kept) > 1:
            _, old = self._kept.popitem(last=False)
            self._bytes -= sum(layer.nbytes for layer in old.values())
        return layers

    def _cached(self, shard, row):
        from safetensors.numpy import load_file, save

        written = Path(shard.path).stat()
        told = (str(shard.path), row, written.st_mtime_ns, written.st_size, self.cropping)
        path = self.cache / f"{hashlib.sha256(repr(told).encode()).hexdigest()[:24]}.safetensors"
        if not path.exists():
            layers = self._decode(shard[row])
            arrays = {name: np.ascontiguousarray(part) for name, part in layers.items()}
            write_bytes(path, save(arrays), sync=False)
        return load_file(path)

    def _decode(self, pair):
        skin = (pair.part == PARTS.index("skin")).astype(np.uint8) * 255
        lips = _polygon(pair.landmarks[LIPS_OUTER], pair.part.shape)
        eyes = np.maximum(*(_polygon(pair.landmarks[ring], pair.part.shape) for ring in EYES))
        weight = 1 + (self.cropping.mouth_weight - 1) * lips + (self.cropping.eye_weight - 1) * eyes
        weight = np.clip(UNIT * weight * (pair.face / 255), 0, 255)
        per_mm = FRAME_SCALE * pair.part.shape[0]
        shade = interior_shade(pair, per_mm)
        expressed = {"strain": pair.strain, "folds": pair.folds}
        return input_channels(pair, pair.photo, shade, expressed) | {
            "target": pair.target,
            "weight": np.round(weight).astype(np.uint8)[..., None],
            "skin": skin[..., None],
            "landmarks": pair.landmarks,
        }


def _polygon(points, shape):
    """Inside of a ring of points [n, 2], softened over 3% of the picture: float32 0..1."""
    mask = np.zeros(shape, np.float32)
    cv2.fillPoly(mask, [np.round(points * 16).astype(np.int32)], 1.0, shift=4)
    reach = max(3, int(0.012 * shape[0])) | 1
    mask = cv2.dilate(mask, np.ones((reach, reach)))
    return cv2.GaussianBlur(mask, (0, 0), 0.006 * shape[0] + 0.5)


class Samples(Dataset):
    """Crops for training: sample k of a seed is always the same."""

    def __init__(self, pairs, seed, count, shares=()):
        self.pairs, self.seed, self.count = pairs, seed, count
        shares = np.array(shares or [1.0] * len(pairs.train), float)
        self.shares = shares / shares.sum()

    def __len__(self):
        return self.count

    def __getitem__(self, k):
        rng = np.random.default_rng([self.seed, k])
        people = self.pairs.train[rng.choice(len(self.shares), p=self.shares)]
        person = people[rng.integers(len(people))]
        weights = np.array([weight for _, _, weight in person])
        shard, row, _ = person[rng.choice(len(person), p=weights / weights.sum())]
        layers = self.pairs.decoded(shard, row)
        window = self._window(rng, layers)
        flip, tone = rng.random() < 0.5, _tone(rng, self.pairs.cropping.color)
        sample = tensors(layers, self.pairs.cropping.size, window, flip, tone)
        whole = window == (0.0, 0.0, float(layers["target"].shape[0]))
        return sample | {"whole": torch.tensor(whole, dtype=torch.uint8)}

    def _window(self, rng, layers):
        """Left, top and side of the square that is cut out, pixels."""
        cropping, side = self.pairs.cropping, layers["target"].shape[0]
        counts = layers["weight"][..., 0] > 0
        # Pairs of eyes and mouths alone have no face to recognise.
        face = counts[layers["skin"][..., 0] > 0].mean() > INTERIOR
        if cropping.whole and rng.random() < cropping.whole and face:
            return 0.0, 0.0, float(side)
        points = layers["landmarks"]
        exact = cropping.exact and rng.random() < cropping.exact
        scale = 1.0 if exact else np.exp(rng.uniform(-SCALES, SCALES))
        window = cropping.size * side / NOMINAL * scale
        kind = rng.random()
        center, spread = None, 0.0
        if kind < cropping.mouth:
            center, spread = points[LIPS].mean(0), 0.12
        elif kind < cropping.mouth + cropping.eyes:
            center, spread = points[EYES[rng.integers(2)]].mean(0), 0.15
        if center is None or not _holds(counts, center):
            where = np.flatnonzero(counts)
            place = rng.choice(where) if len(where) else counts.size // 2
            center = np.array([place % side, place // side], float)
            spread = 0.0 if face else 0.12
        center = center + rng.normal(0, 1, 2) * spread * window
        left, top = np.clip(center - window / 2, 0, max(side - window, 0))
        if exact:
            left, top = np.floor([left, top])
        return float(left), float(top), float(window)


def _holds(counts, center):
    """Whether the loss counts near a point (x, y) of a mask [S, S]."""
    reach = NEAR * counts.shape[0]
    low, high = np.maximum((np.floor(center - reach), np.ceil(center + reach)), 0).astype(int)
    return counts[low[1] : high[1], low[0] : high[0]].any()


def _tone(rng, spread):
    """One look-up table [256, 3] for photo, deformed neutral and target alike: light and skin tone."""
    gain = np.exp(rng.normal(0, spread) + rng.normal(0, 0.3 * spread, 3))
    gamma = np.exp(rng.normal(0, 0.5 * spread))
    value = np.linspace(0, 1, 256)[:, None]
    return np.round(np.clip(gain * value**gamma, 0, 1) * 255).astype(np.uint8)


GROUPS = (("photo",), ("normals",), ("depth", "gaze", "mouth"), ("strain", "folds"), ("deformed",), ("target",), ("weight", "skin"))  # fmt: skip
TONED = ("photo", "deformed", "target")


def tensors(layers, size, window=None, flip=False, tone=None):
    """Channels as tensors of bytes, cut and changed.

    Args:
        layers: of `Pairs.decoded`.
        size: pixels a side of the crop.
        window: left, top, side of what is cut out; None for all of it.
        flip: mirror left and right.
        tone: [256, 3] uint8 look-up table of colours.

    Returns:
        dict of uint8 tensors [C, size, size].
    """
    side = layers["target"].shape[0]
    left, top, width = window or (0.0, 0.0, float(side))
    scale = size / width
    matrix = np.array([[scale, 0, -left * scale], [0, scale, -top * scale]])
    matrix[:, 2] += 0.5 * scale - 0.5  # pixel centres lie at +0.5
    exact = scale == 1 and left == int(left) and top == int(top)
    out = {}
    for group in GROUPS:
        picture = np.concatenate([layers[name] for name in group], -1)
        if exact:
            picture = picture[int(top) : int(top) + size, int(left) : int(left) + size]
        else:
            flags = cv2.INTER_LINEAR if scale > 0.8 else cv2.INTER_AREA
            picture = (
                cv2.resize(picture, (size, size), interpolation=flags)
                if window is None
                else cv2.warpAffine(picture, matrix, (size, size), flags=cv2.INTER_LINEAR)
            )
        if flip:
            picture = picture[:, ::-1]
            if group == ("normals",):
                picture = picture.copy()
                picture[..., 0] = np.where(
                    picture[..., 0] == 0, 0, 256 - picture[..., 0].astype(int)
                )
        first = 0
        for name in group:
            channels = layers[name].shape[-1]
            part = picture.reshape(size, size, -1)[..., first : first + channels]
            first += channels
            if tone is not None and name in TONED:
                part = cv2.LUT(np.ascontiguousarray(part), tone[None])
            out[name] = torch.from_numpy(np.ascontiguousarray(part.transpose(2, 0, 1)))
    return out
