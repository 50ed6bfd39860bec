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
