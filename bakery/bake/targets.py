"""The expressions, gazes and mouths that are baked: those that ship, or those of a file."""

import re
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from bakery.errors import InputError
from bakery.formats import targets
from bakery.formats.files import digest, read_bytes
from bakery.preset import find
from bakery.settings import shown

NAME = re.compile(r"[A-Za-z][A-Za-z0-9_-]{0,39}")  # of a key expression: it names a part of an EXR
KEYS, GAZES, MOUTHS = 64, 100, 300  # at most
TURN = (45.0, 35.0)  # degrees of yaw and pitch that eyes are baked for, at most
LARGEST = 4 * 2**20  # bytes of a file


@dataclass(frozen=True)
class Targets:
    """The expressions, gazes and mouths that are baked."""

    key_names: tuple[str, ...]
    key_weights: np.ndarray  # [K, E]
    gaze: np.ndarray  # [G, 2] degrees
    mouths: np.ndarray  # [M, E]

    @property
    def digest(self) -> str:
        """SHA-256 over all of it."""
        arrays = (self.key_weights, self.gaze, self.mouths)
        parts = [" ".join(self.key_names).encode(), *(np.ascontiguousarray(a) for a in arrays)]
        return digest(b"".join(bytes(part) for part in parts))


def read_targets(path: Path | None = None) -> Targets:
    """The targets of presets/expressions, or with the tables of a TOML file in their place.

    Args:
        path: file with any of [keys.NAME] (shape = weight), [gaze] directions = [[yaw, pitch], ...]
            and [[mouths]] (shape = weight); a table that it lacks is the one that ships.

    Raises:
        InputError: the file cannot be used.
    """
    names, weights = targets.read_keys(find("expressions/keys.toml"))
    gaze = targets.read_gaze(find("expressions/gaze.toml"))
    mouths = targets.read_mouths(find("expressions/mouths.json"))
    if path is not None:
        table = _parsed(path)
        if "keys" in table:
            names = tuple(table["keys"])
            weights = targets.weight_rows(list(table["keys"].values()), f"{path}: keys")
        if "gaze" in table:
            gaze = np.array(table["gaze"]["directions"], float)
        if "mouths" in table:
            mouths = targets.weight_rows(table["mouths"], f"{path}: mouths")
    return Targets(names, weights, gaze, mouths)


def _parsed(path: Path) -> dict[str, Any]:
    """The tables of a file of expressions, each of the form that it must have."""
    try:
        table = tomllib.loads(read_bytes(path, LARGEST).decode("utf-8"))
    except (ValueError, RecursionError) as error:  # as well of too many digits, or brackets
        raise InputError(f"{path}: not valid TOML ({error}); mend the file") from None
    unknown = sorted(set(table) - {"keys", "gaze", "mouths"})
    if unknown or not table:
        raise InputError(
            f"{path}: {'unknown ' + ', '.join(unknown) if unknown else 'holds nothing'}; give "
            "[keys.NAME], [gaze] and [[mouths]]"
        )
    for name, most in (("keys", KEYS), ("mouths", MOUTHS)):
        given = table.get(name, {"x": {}} if name == "keys" else [{}])
        rows = list(given.values()) if isinstance(given, dict) else given
        kind = dict if name == "keys" else list
        if not isinstance(given, kind) or not 1 <= len(rows) <= most:
            raise InputError(f"{path}: {name} needs 1 to {most} tables of shapes")
        for row in rows:
            numbers = isinstance(row, dict) and all(type(v) in (int, float) for v in row.values())
            if not numbers:
                raise InputError(f"{path}: {name} holds {shown(row)}; give shape = weight")
    for key in table.get("keys", {}):
        if not NAME.fullmatch(key) or key == "neutral":
            raise InputError(
                f"{path}: key expression {key!r}; give a name of letters and digits, not neutral"
            )
    if "gaze" in table:
        _check_gaze(path, table["gaze"])
    return table


def _check_gaze(path: Path, table: Any) -> None:
    try:
        directions = np.array(table["directions"], float)
    except (TypeError, ValueError, KeyError, OverflowError):
        directions = np.zeros(0)
    if directions.ndim != 2 or directions.shape[1:] != (2,) or not len(directions) <= GAZES:
        raise InputError(f"{path}: gaze needs directions = [[yaw, pitch], ...], 1 to {GAZES}")
    if not (np.abs(directions) <= TURN).all():
        raise InputError(
            f"{path}: a gaze beyond {TURN[0]:g} degrees to a side or {TURN[1]:g} up or down; the "
            "iris would be hidden"
        )
