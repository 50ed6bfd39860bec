"""Settings: options dataclasses that say beside each value what it may be.

    @dataclass(frozen=True)
    class TextureOptions(Settings):
        mouths: int = setting(300, "mouth textures", 1, 300)

Presets, `--set` and direct construction are checked by the same function, and the same words
describe the setting to people (`bakery presets show`).
"""

import math
import types
import typing
from dataclasses import dataclass, field, fields, is_dataclass
from functools import cache
from numbers import Integral, Real

from bakery.errors import UsageProblem, nearest

Value = typing.TypeVar("Value")
KEY = "setting"  # of a field's metadata
SEEDS = 2**32 - 1  # the largest seed
NOUNS = {float: "a number", int: "a whole number", bool: "true or false", str: "text"}


@dataclass(frozen=True)
class Allowed:
    """What a setting may be."""

    about: str = ""  # what it means
    low: float | None = None  # inclusive
    high: float | None = None  # inclusive
    unit: str = ""
    choices: tuple[str, ...] = ()  # of texts; empty: any
    count: tuple[int, int] | None = None  # least and most entries of a list

    @property
    def range(self) -> str:
        """Such as "1 to 300 texels"; empty if there is none."""
        if self.choices:
            return f"one of {', '.join(self.choices)}"
        if self.low is None:
            return ""
        ends = [f"{x:g}" if isinstance(x, float) else f"{x}" for x in (self.low, self.high)]
        return " ".join(filter(None, [" to ".join(ends), self.unit]))


def setting(
    default: Value,
    about: str,
    low: float | None = None,
    high: float | None = None,
    *,
    unit: str = "",
    choices: tuple[str, ...] = (),
    count: tuple[int, int] | None = None,
) -> Value:
    """A dataclass field; see `Allowed` for the arguments."""
    allowed = Allowed(about, low, high, unit, choices, count)
    return field(default=default, metadata={KEY: allowed})


class Settings:
    """Base of options dataclasses: refuses values that their fields do not allow."""

    def __post_init__(self) -> None:
        """
        Raises:
            UsageProblem: a value of the wrong type, out of its range or not finite.
        """
        for name, (kind, allowed) in settings_of(type(self)).items():
            coerced(kind, allowed, getattr(self, name), f"{type(self).__name__}.{name}")


@cache
def settings_of(kind):
    """The fields of an options dataclass: {name: (type, Allowed)}."""
    hints = typing.get_type_hints(kind)
    return {
        each.name: (hints[each.name], each.metadata.get(KEY, Allowed())) for each in fields(kind)
    }


def coerced(kind, allowed, value, where):
    """A value as its field wants it: lists become tuples, whole numbers floats.

    Args:
        kind: the field's type: bool, int, float, str, tuple[type, ...], a dataclass; or several.
        where: how the message calls it.

    Raises:
        UsageProblem: a wrong type, out of range, not finite, too few or too many.
    """
    if is_dataclass(kind):
        if not isinstance(value, kind):
            raise UsageProblem(f"{where}: {shown(value)}; needs a {kind.__name__}")
        return value
    kinds = typing.get_args(kind) if isinstance(kind, types.UnionType) else (kind,)
    if value is None and type(None) in kinds:
        return None
    (kind,) = (each for each in kinds if each is not type(None))
    if typing.get_origin(kind) is not tuple:
        return _single(kind, allowed, value, where)
    entry = typing.get_args(kind)[0]
    low, high = allowed.count or (0, math.inf)
    if not isinstance(value, list | tuple) or not low <= len(value) <= high:
        many = f" of {low} to {high} entries" if allowed.count else ""
        raise UsageProblem(
            f"{where}: {shown(value)}; needs a list{many}, each {wanted(entry, allowed)}"
        )
    return tuple(_single(entry, allowed, v, f"{where}[{k}]") for k, v in enumerate(value))


def _single(kind, allowed, value, where):
    """A bool, number or text, checked."""
    good = {
        bool: isinstance(value, bool),
        int: isinstance(value, Integral) and not isinstance(value, bool),
        float: isinstance(value, Real) and not isinstance(value, bool),
        str: isinstance(value, str),
    }[kind]
    if not good:
        raise UsageProblem(f"{where}: {shown(value)}; {wanted(kind, allowed)}")
    if allowed.choices and value not in allowed.choices:
        near = nearest(value, allowed.choices)
        guess = f"did you mean '{near}'? " if near else ""
        raise UsageProblem(f"{where}: {shown(value)}; {guess}{allowed.range}")
    if kind in (int, float):
        # Not `value < low`: nothing is true of a value that is not a number.
        if allowed.low is not None and not allowed.low <= value <= allowed.high:
            raise UsageProblem(f"{where}: {shown(value)}; {allowed.range}")
        if not math.isfinite(value):
            raise UsageProblem(f"{where}: {shown(value)}; a finite number")
    return float(value) if kind is float else value


def wanted(kind, allowed):
    """Such as "a whole number, 1 to 300"."""
    return ", ".join(filter(None, [NOUNS[kind], allowed.range]))


def shown(value: object) -> str:
    """A value in a message, not too long."""
    try:
        text = repr(value)
    except ValueError:  # Python prints no whole number of more than 4300 digits
        return "a number too long to be shown"
    return text if len(text) <= 60 else f"{text[:60]}..."


def listing(options, prefix=""):
    """Every setting of options and of those inside them, in order.

    Yields:
        key as "bundle.web.side", type, value, Allowed.
    """
    for name, (kind, allowed) in settings_of(type(options)).items():
        value = getattr(options, name)
        if is_dataclass(kind):
            yield from listing(value, f"{prefix}{name}.")
        else:
            yield f"{prefix}{name}", kind, value, allowed
