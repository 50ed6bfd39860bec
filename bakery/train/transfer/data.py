"""Samples of the texture transfer: what one performer does, and another doing the same."""

import json
from pathlib import Path

import numpy as np
import torch

from bakery.errors import InputError
from bakery.geometry.color import to_encoded, to_linear
from bakery.heads.base import PARTS
from bakery.heads.file import load_head
from bakery.stages.texture.expression import PLACES, SKIN_HEIGHT, expression_atlas, feature_weight
from bakery.train.transfer import tones

TEXTURES = ("source", "source_neutral", "target_neutral", "truth")


class Performers:
    """The painted performers of some folders, all in memory: a person takes 13 MB.

    Every `held_out`-th is kept for measuring; 0 keeps none.
    """

    def __init__(self, folders, held_out=8):
        self.folders, self.held_out = [Path(folder) for folder in folders], held_out
        self._files, self.people = {}, []
        self.look()

    def look(self):
        """Read what was painted since."""
        from safetensors import safe_open

        paths = sorted(path for folder in self.folders for path in folder.glob("performer-*"))
        for path in paths:
            if path in self._files or path.suffix != ".safetensors":
                continue
            with safe_open(path, "numpy") as file:
                about = json.loads((file.metadata() or {}).get("performer", "{}"))
                arrays = file.get_tensor("textures"), file.get_tensor("seen")
            self._files[path] = (*arrays, about.get("head", ""))
        if len(self._files) < 2:
            raise InputError(
                f"{len(self._files)} performers in {', '.join(map(str, self.folders))}; at least 2 are "
                "needed; paint some with `bakery synth performers`"
            )
        heads = {head for _, _, head in self._files.values()}
        if len(heads) > 1:
            raise InputError(
                f"performers of the heads {', '.join(sorted(heads))}; give those of one"
            )
        self.head = load_head(heads.pop())
        people = [self._files[path][:2] for path in paths if path in self._files]
        every = self.held_out
        self.held = people[every - 1 :: every] if every else []
        held = {id(textures) for textures, _ in self.held}
        self.people = [person for person in people if id(person[0]) not in held]
        size = self.people[0][0].shape[1]
        self.weight = feature_weight(self.head, size)
        rows = expression_atlas(self.head, size)
        skin = rows.paint(rows.part == PARTS.index("skin"), False)
        rest = np.stack([to_linear(textures[0] / np.float32(255)) for textures, _ in self.people])
        seen = np.stack([mask[0] / np.float32(255) for _, mask in self.people])
        self.tones = tones.analyse(rest, seen, skin)

    def sample(self, rng, options):
        """One sample: textures [T, T, 3] and masks [T, T] float32 0..1 by name."""
        one, other = rng.choice(len(self.people), 2, replace=False)
        if rng.random() < options.oneself:
            other = one
        k = int(rng.integers(len(self.people[one][0])))
        sample = pair(self.people[one], self.people[other], k)
        if rng.random() < options.retoned:
            for names in (("source", "source_neutral"), ("target_neutral", "truth")):
                added = tones.shift(rng, self.tones, options.tone)
                gain = np.exp(
                    rng.normal() * options.light + rng.normal(size=3) * 0.3 * options.light
                )
                for name in names:
                    lit = (to_linear(sample[name]) + added) * gain.astype(np.float32)
                    sample[name] = to_encoded(np.clip(lit, 0, 1)).astype(np.float32)
        if rng.random() < 0.5:
            sample = {name: mirrored(texture) for name, texture in sample.items()}
        return sample | {"weight": self.weight * sample.pop("seen")}

    def batch(self, rng, options):
        """Samples as tensors [B, C, T, T] by name."""
        return tensors([self.sample(rng, options) for _ in range(options.batch)])


def pair(source, target, k):
    """Textures and masks by name of two performers in expression k, unaltered."""
    (acted, acted_seen), (shown, shown_seen) = source, target
    bytes_ = {
        "source": acted[k], "source_neutral": acted[0], "target_neutral": shown[0],
        "truth": shown[k], "source_seen": acted_seen[k], "target_seen": shown_seen[0],
        "seen": shown_seen[k],
    }  # fmt: skip
    return {name: picture / np.float32(255) for name, picture in bytes_.items()}


def tensors(samples):
    """Samples as one dict of tensors [B, C, T, T] float32."""
    out = {}
    for name in samples[0]:
        stack = np.stack([sample[name] for sample in samples])
        stack = stack[..., None] if stack.ndim == 3 else stack
        out[name] = torch.from_numpy(np.ascontiguousarray(stack.transpose(0, 3, 1, 2)))
    return out


def mirrored(texture):
    """An expression texture [T, T, ...] of the mirrored face: each chart turned in its place."""
    size = len(texture)
    out = texture.copy()
    rows = round(SKIN_HEIGHT * size)
    out[:rows] = texture[:rows, ::-1]
    places = {name: _texels(place, size) for name, place in PLACES.items()}
    other = {"eye_cap_left": "eye_cap_right", "eye_cap_right": "eye_cap_left"}
    for name, (down, across) in places.items():
        out[down, across] = texture[places[other.get(name, name)]][:, ::-1]
    return out


def _texels(place, size):
    left, top, width, height = place
    left, top = round(left * size), round(top * size)
    return slice(top, top + round(height * size)), slice(left, left + round(width * size))
