"""Settings: every value that a preset, `--set` or a caller can give is checked."""

import math
import tomllib
from dataclasses import dataclass, field, fields, is_dataclass, replace
from typing import get_args, get_origin

import pytest

from bakery import preset
from bakery.cli.options import SETTINGS, options_class
from bakery.errors import InputError, UsageProblem
from bakery.paths import PACKAGE
from bakery.settings import Settings, listing, setting, settings_of
from bakery.stages.texture import TextureOptions


@dataclass(frozen=True)
class Inner(Settings):
    rate: float = setting(0.5, "a rate", 0, 1, unit="Hz")
    views: tuple[float, ...] = setting((0.0,), "views", -60, 60, count=(1, 3))


@dataclass(frozen=True)
class Options(Settings):
    size: int = setting(3, "a size", 1, 300)
    kind: str = setting("plain", "a kind", choices=("plain", "striped"))
    on: bool = setting(True, "whether")
    inner: Inner = field(default_factory=Inner)


def nested(key, value):
    """The tables that hold one setting."""
    for step in reversed(key.split(".")):
        value = {step: value}
    return value


@pytest.mark.parametrize(
    "key, value, message",
    [
        ("size", 0, "size: 0; 1 to 300"),
        ("size", 301, "size: 301; 1 to 300"),
        ("size", 3.0, "size: 3.0; a whole number, 1 to 300"),
        ("size", True, "size: True; a whole number, 1 to 300"),
        ("size", "big", "size: 'big'; a whole number, 1 to 300"),
        ("kind", "stripped", "kind: 'stripped'; did you mean 'striped'. one of plain, striped"),
        ("on", 1, "on: 1; true or false"),
        ("inner.rate", math.nan, "inner.rate: nan; 0 to 1 Hz"),
        ("inner.rate", math.inf, "inner.rate: inf; 0 to 1 Hz"),
        ("inner.rate", [1], r"inner.rate: \[1\]; a number, 0 to 1 Hz"),
        ("inner.views", [], r"inner.views: \[\]; needs a list of 1 to 3 entries"),
        (
            "inner.views",
            [1, 2, 3, 4],
            r"inner.views: \[1, 2, 3, 4\]; needs a list of 1 to 3 entries",
        ),
        ("inner.views", 5.0, "inner.views: 5.0; needs a list of 1 to 3"),
        ("inner.views", [0, 500], r"inner.views\[1\]: 500; -60 to 60"),
        ("inner.views", ["a"], r"inner.views\[0\]: 'a'; a number, -60 to 60"),
        ("inner", 3, "inner: 3; needs a table"),
    ],
)
def test_values_that_are_not_allowed(key, value, message):
    with pytest.raises(UsageProblem, match=f"^test.{message}"):
        preset.options_from(Options, nested(key, value), "test")


def test_a_number_that_python_will_not_print():
    with pytest.raises(UsageProblem, match="test.size: a number too long to be shown; 1 to 300"):
        preset.options_from(Options, {"size": 16**5000}, "test")


def test_direct_construction_is_checked_too():
    with pytest.raises(UsageProblem, match="^Inner.rate: nan; 0 to 1 Hz"):
        Inner(rate=math.nan)
    with pytest.raises(UsageProblem, match="^TextureOptions.mouths: 0; 1 to 300"):
        replace(TextureOptions(), mouths=0)
    with pytest.raises(UsageProblem, match="^Options.inner: 3; needs a Inner"):
        Options(inner=3)
    assert Inner(rate=1).rate == 1


def numeric(kind):
    parts = get_args(kind) if get_origin(kind) else (kind,)
    return [part for part in parts if part in (int, float)]


@pytest.mark.parametrize("of", SETTINGS)
def test_every_number_has_a_range_and_every_setting_a_meaning(of):
    options = options_class(of)()
    assert isinstance(options, Settings)
    for key, kind, _, allowed in listing(options):
        assert allowed.about, f"{key}: say what it means"
        if numeric(kind):
            assert allowed.low is not None and allowed.high is not None, f"{key}: has no range"
            assert math.isfinite(allowed.low) and allowed.low < allowed.high < math.inf, key
        if get_origin(kind) is tuple:
            assert allowed.count is not None, f"{key}: say how many"


def numbers(of):
    """Every numeric setting of one root: (key, type, value, Allowed)."""
    return [entry for entry in listing(options_class(of)()) if numeric(entry[1])]


@pytest.mark.parametrize("of", SETTINGS)
def test_no_number_takes_what_lies_outside(of):
    for key, kind, value, allowed in numbers(of):
        for bad in (
            math.nan,
            math.inf,
            -math.inf,
            "a",
            None,
            True,
            allowed.low - 1,
            allowed.high + 1,
        ):
            given = [bad, *value[1:]] if get_origin(kind) else bad
            with pytest.raises(UsageProblem) as caught:
                preset.options_from(options_class(of), nested(key, given), "preset x")
            assert str(caught.value).startswith(f"preset x.{key}")
            assert len(str(caught.value)) < 300 and "\n" not in str(caught.value)


def test_nothing_is_made_from_settings_that_are_not_walked_over():
    """Whoever calls `options_from` for another dataclass adds it to SETTINGS."""
    reached = set()

    def reach(kind):
        reached.add(kind.__name__)
        for inner, _ in settings_of(kind).values():
            if is_dataclass(inner):
                reach(inner)

    for of in SETTINGS:
        reach(options_class(of))
    for path in PACKAGE.rglob("*.py"):
        for call in path.read_text(encoding="utf-8").split("options_from(")[1:]:
            name = call.strip().split(",")[0].split(".")[-1]
            if name.endswith("Options"):
                assert name in reached, f"{path}: {name}"
    assert {"BuildOptions", "Limits", "Weights", "WebOptions", "Cropping"} <= reached


def test_the_written_preset_is_read_back_the_same():
    for name in preset.names("builds"):
        made = preset.options_from(options_class("build"), preset.load("builds", name), name)
        text = preset.as_toml(made)
        assert preset.options_from(options_class("build"), tomllib.loads(text), "again") == made
    for key, _, _, allowed in listing(made):
        (line,) = [line for line in text.splitlines() if line.startswith(key.split(".")[-1] + " = ")
                   and allowed.about in line]  # fmt: skip
        assert allowed.range in line


def test_levels_of_the_fit_go_together():
    tables = preset.with_settings({}, ["fit.level_steps=[1, 2]"])
    with pytest.raises(UsageProblem, match="^x.fit: level_widths, level_steps and level_samples"):
        preset.options_from(options_class("build"), tables, "x")


def test_as_many_mouths_as_there_are():
    from bakery.bake.textures import read_targets

    mouths = settings_of(TextureOptions)["mouths"][1]
    assert mouths.high == len(read_targets().mouths)
    assert issubclass(UsageProblem, InputError)


def test_settings_of_other_dataclasses_are_read_by_type():
    @dataclass(frozen=True)
    class Plain:
        size: int = 3
        name: str | None = None

    assert preset.options_from(Plain, {"name": "a"}, "x") == Plain(3, "a")
    with pytest.raises(UsageProblem, match="x.name: 3; text"):
        preset.options_from(Plain, {"name": 3}, "x")
    assert len(fields(Plain)) == len(settings_of(Plain))
