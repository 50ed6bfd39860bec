"""Presets: TOML tables into options."""

import itertools
import json
import os
import tomllib
from collections.abc import Iterable
from dataclasses import is_dataclass
from pathlib import Path
from typing import Any, TypeVar

from bakery.errors import InputError, UsageProblem, no_such
from bakery.paths import PACKAGE
from bakery.settings import NOUNS, coerced, listing, settings_of, shown

T = TypeVar("T")
FOLDERS = (PACKAGE / "presets", PACKAGE.parent / "presets")  # installed; beside the checkout
LARGEST = 2**20  # bytes of a preset


def find(name: str) -> Path:
    """A preset file such as "expressions/keys.toml".

    Raises:
        InputError: there is none.
    """
    for folder in FOLDERS:
        if (folder / name).is_file():
            return folder / name
    raise InputError(f"no preset {name}; install bakery again")


def names(kind: str) -> list[str]:
    """Names of the presets of one kind, such as "builds"."""
    return sorted({path.stem for folder in FOLDERS for path in (folder / kind).glob("*.toml")})


def about(kind, name):
    """What a preset says about itself in the first sentence of its file."""
    lines = find(f"{kind}/{name}.toml").read_text(encoding="utf-8").splitlines()
    comment = itertools.takewhile(lambda line: line.startswith("#"), lines)
    return " ".join(line.lstrip("# ") for line in comment).partition(". ")[0].removesuffix(".")


def load(kind: str, name_or_path: str | Path) -> dict[str, Any]:
    """The tables of a preset.

    Args:
        kind: folder of the presets, such as "builds".
        name_or_path: a preset's name, or a TOML file.

    Raises:
        UsageProblem: no such preset, or not valid TOML.
        InputError: the file cannot be read.
    """
    if str(name_or_path) in names(kind):
        path = find(f"{kind}/{name_or_path}.toml")
    else:
        path = Path(name_or_path)
        if not os.path.isfile(path):  # false too for a name that no system would take
            raise no_such("no preset", name_or_path, names(kind), "or give a TOML file")
    try:
        with open(path, "rb") as file:
            text = file.read(LARGEST + 1)
        if len(text) > LARGEST:
            raise UsageProblem(f"{path}: above {LARGEST} bytes, so no preset; give another file")
        return tomllib.loads(text.decode("utf-8"))
    except (ValueError, RecursionError) as error:
        raise UsageProblem(f"{path}: not valid TOML ({error}); mend the file") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}); check the file") from None


def with_settings(tables: dict[str, Any], settings: Iterable[str]) -> dict[str, Any]:
    """The tables with settings such as "texture.mouths=100" on top; values are TOML.

    Raises:
        UsageProblem: a setting of another form.
    """
    tables = dict(tables)
    for setting in settings:
        path, equals, text = setting.partition("=")
        if not (equals and path.strip()):
            raise UsageProblem(f"--set {setting}: give KEY=VALUE, as texture.mouths=100")
        try:
            value = tomllib.loads(f"value = {text}")["value"]
        except (ValueError, RecursionError):
            value = text.strip()
        inner = tables
        *above, last = path.strip().split(".")
        for step in above:
            if not isinstance(inner.get(step, {}), dict):
                raise UsageProblem(f"--set {setting}: {step} is no table but {shown(inner[step])}")
            inner[step] = dict(inner.get(step, {}))
            inner = inner[step]
        inner[last] = value
    return tables


def options_from(kind: type[T], table: Any, where: str) -> T:
    """Build the options dataclass `kind` from a table.

    Args:
        where: how messages call the table.

    Raises:
        UsageProblem: an unknown key, or a value that its setting does not allow.
    """
    if not isinstance(table, dict):
        raise UsageProblem(f"{where}: {shown(table)}; needs a table")
    known = settings_of(kind)
    if unknown := sorted(set(table) - set(known)):
        inside = [key for key, *_ in listing(kind()) if key.endswith(f".{unknown[0]}")]
        if inside:
            raise UsageProblem(f"{where}: no setting '{unknown[0]}'; did you mean '{inside[0]}'?")
        raise no_such(f"{where}: no setting", unknown[0], sorted(known))
    made = {}
    for key, value in table.items():
        inner, allowed = known[key]
        place = f"{where}.{key}"
        if is_dataclass(inner):
            made[key] = options_from(inner, value, place)
        else:
            made[key] = coerced(inner, allowed, value, place)
    try:
        return kind(**made)
    except UsageProblem as error:  # settings that do not go together
        raise UsageProblem(f"{where}: {error}") from None


def as_toml(options):
    """Options as the TOML of a preset, each setting with its range and meaning behind it."""
    tables = {}
    for key, kind, value, allowed in listing(options):
        table, _, name = key.rpartition(".")
        noun = NOUNS.get(kind, "") if not allowed.choices else ""
        note = "; ".join(filter(None, [allowed.range or noun, allowed.about]))
        tables.setdefault(table, []).append(f"{name} = {_toml(value)}  # {note}")
    whole = [table.split(".")[0] for table in tables]  # a table stands before those inside it
    order = sorted(tables, key=lambda table: (table != "", whole.index(table.split(".")[0]), table))
    return "\n\n".join("\n".join([f"[{table}]"] * bool(table) + tables[table]) for table in order)


def _toml(value):
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return json.dumps(value)
    return f"[{', '.join(map(_toml, value))}]" if isinstance(value, tuple) else repr(value)
