"""Reads presets/expressions: key expressions, gaze directions, mouth poses."""

import json
import tomllib
from pathlib import Path

import numpy as np

from bakery.errors import InputError
from bakery.types import EXPRESSION_INDEX, EXPRESSIONS


def presets_folder():
    """Inside an installed package, or beside it in a checkout."""
    package = Path(__file__).resolve().parents[1]
    inside = package / "presets"
    return inside if inside.is_dir() else package.parent / "presets"


def weight_rows(tables, where):
    """Mappings of ARKit names to weights as [n, E] float32.

    Raises:
        InputError: a name that ARKit does not have, or a weight outside 0..1.
    """
    out = np.zeros((len(tables), len(EXPRESSIONS)), np.float32)
    for row, table in enumerate(tables):
        for name, weight in table.items():
            if name not in EXPRESSION_INDEX:
                raise InputError(
                    f"{where}: unknown shape {name!r}; needs an ARKit name, as jawOpen"
                )
            if not 0 <= weight <= 1:
                raise InputError(f"{where}: {name} is {weight}; needs a weight of 0 to 1")
            out[row, EXPRESSION_INDEX[name]] = weight
    return out


def read_keys(path):
    """Key expressions: names and weights [K, E]."""
    tables = tomllib.loads(Path(path).read_text(encoding="utf-8"))
    return tuple(tables), weight_rows(list(tables.values()), path)


def read_gaze(path):
    """Gaze directions [n, 2] degrees."""
    return np.array(tomllib.loads(Path(path).read_text(encoding="utf-8"))["directions"], float)


def read_mouths(path):
    """Mouth poses [M, E]."""
    return weight_rows(json.loads(Path(path).read_text(encoding="utf-8")), path)


def expression_weights(text: str) -> np.ndarray:
    """Weights [E] of named expressions: "laugh", "laugh=0.5" or several, as "laugh=0.5,wink".

    The names are those of presets/expressions/named.toml; several are added, up to 1.

    Raises:
        InputError: an unknown name, or a strength outside 0..1.
    """
    names, rows = read_keys(presets_folder() / "expressions" / "named.toml")
    out = np.zeros(len(EXPRESSIONS), np.float32)
    for item in filter(None, (part.strip() for part in text.split(","))):
        name, equals, strength = (part.strip() for part in item.partition("="))
        if name not in names:
            raise InputError(f"no expression '{name}'; known: {', '.join(names)}")
        try:
            share = float(strength) if equals else 1.0
        except ValueError:
            share = np.nan
        if not 0 <= share <= 1:
            raise InputError(f"expression '{item}'; give a strength of 0 to 1, as {name}=0.5")
        out += np.float32(share) * rows[names.index(name)]
    return np.minimum(out, 1)
