"""Presets: TOML tables into options."""

import tomllib
import types
import typing
from dataclasses import fields, is_dataclass
from pathlib import Path

from bakery.errors import InputError
from bakery.paths import PACKAGE

FOLDERS = (PACKAGE / "presets", PACKAGE.parent / "presets")  # installed; beside the checkout


def find(name):
    """A preset file such as "expressions/keys.toml".

    Raises:
        InputError: there is none.
    """
    for folder in FOLDERS:
        if (folder / name).is_file():
            return folder / name
    raise InputError(f"no preset {name}; install bakery again")


def names(kind):
    """Names of the presets of one kind, such as "builds"."""
    return sorted({path.stem for folder in FOLDERS for path in (folder / kind).glob("*.toml")})


def load(kind, name_or_path):
    """The tables of a preset.

    Args:
        kind: folder of the presets, such as "builds".
        name_or_path: a preset's name, or a TOML file.

    Raises:
        InputError: no such preset, or not valid TOML.
    """
    if str(name_or_path) in names(kind):
        path = find(f"{kind}/{name_or_path}.toml")
    else:
        path = Path(name_or_path)
    try:
        return tomllib.loads(path.read_bytes().decode("utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: not valid TOML ({error}); mend the file") from None
    except OSError:
        raise InputError(
            f"no preset '{name_or_path}'; known: {', '.join(names(kind))}; or give a TOML file"
        ) from None


def with_settings(tables, settings):
    """The tables with `table.key=value` settings on top; values are TOML.

    Raises:
        InputError: a setting of another form.
    """
    tables = {
        name: dict(table) if isinstance(table, dict) else table for name, table in tables.items()
    }
    for setting in settings:
        path, equals, text = setting.partition("=")
        table, _, key = path.strip().partition(".")
        if not (equals and table and key):
            raise InputError(f"--set {setting}: give it as table.key=value")
        try:
            value = tomllib.loads(f"value = {text}")["value"]
        except tomllib.TOMLDecodeError:
            value = text.strip()
        inner = tables.setdefault(table, {})
        *above, last = key.split(".")
        for step in above:
            inner[step] = dict(inner.get(step, {}))
            inner = inner[step]
        inner[last] = value
    return tables


def options_from(kind, table, where):
    """Build the options dataclass `kind` from a table; unknown keys and wrong types are errors.

    Args:
        where: how messages call the table.
    """
    if not isinstance(table, dict):
        raise InputError(f"{where}: {table!r}, needs a table")
    known = {field.name: field for field in fields(kind)}
    if unknown := sorted(set(table) - set(known)):
        raise InputError(
            f"{where}: unknown {', '.join(unknown)}; known: {', '.join(sorted(known))}"
        )
    hints = typing.get_type_hints(kind)
    try:
        return kind(
            **{key: _value(hints[key], value, f"{where}.{key}") for key, value in table.items()}
        )
    except ValueError as error:
        raise InputError(f"{where}: {error}") from None


def _value(kind, value, where):
    if is_dataclass(kind):
        return options_from(kind, value, where)
    allowed = [typing.get_origin(part) or part for part in _alternatives(kind)]
    if float in allowed and isinstance(value, int) and not isinstance(value, bool):
        value = float(value)
    if tuple in allowed and isinstance(value, list):
        value = tuple(value)
    if type(value) not in allowed:
        wanted = " or ".join(getattr(part, "__name__", str(part)) for part in allowed)
        raise InputError(f"{where}: {value!r}, needs {wanted}")
    return value


def _alternatives(kind):
    return typing.get_args(kind) if isinstance(kind, types.UnionType) else (kind,)
