"""Presets: what they may say, and how a wrong word is answered."""

from dataclasses import dataclass, field

import pytest

from bakery import preset
from bakery.errors import UsageProblem


@dataclass(frozen=True)
class Inner:
    rate: float = 0.5
    views: tuple[float, ...] = (0.0,)


@dataclass(frozen=True)
class Options:
    size: int = 3
    name: str | None = None
    inner: Inner = field(default_factory=Inner)


def test_tables_become_options():
    made = preset.options_from(Options, {"size": 4, "inner": {"rate": 1, "views": [1.0]}}, "test")
    assert made == Options(4, None, Inner(1.0, (1.0,)))


@pytest.mark.parametrize(
    "table, message",
    [
        ({"sise": 3}, "test: no setting 'sise'; did you mean 'size'"),
        ({"colour": 3}, "test: no setting 'colour'; known: inner, name, size"),
        ({"rate": 3}, "test: no setting 'rate'; did you mean 'inner.rate'"),
        ({"size": "big"}, "test.size: 'big'; a whole number"),
        ({"size": True}, "test.size: True; a whole number"),
        ({"inner": 3}, "test.inner: 3; needs a table"),
        ({"inner": {"rate": "fast"}}, "test.inner.rate: 'fast'; a number"),
        ({"inner": {"rate": float("nan")}}, "test.inner.rate: nan; a finite number"),
    ],
)
def test_wrong_tables(table, message):
    with pytest.raises(UsageProblem, match=message):
        preset.options_from(Options, table, "test")


def test_settings_go_on_top():
    tables = preset.with_settings({"a": {"x": 1}}, ["a.x=2", "b.name=word", "c.d.e=[1, 2]"])
    assert tables == {"a": {"x": 2}, "b": {"name": "word"}, "c": {"d": {"e": [1, 2]}}}
    assert preset.with_settings({}, ["x=2"]) == {"x": 2}


@pytest.mark.parametrize(
    "setting, message",
    [
        ("size", "give KEY=VALUE"),
        ("=3", "give KEY=VALUE"),
        ("a.x.y=3", "--set a.x.y=3: x is no table but 1"),
    ],
)
def test_wrong_settings(setting, message):
    with pytest.raises(UsageProblem, match=message):
        preset.with_settings({"a": {"x": 1}}, [setting])


def test_every_shipped_preset_is_valid():
    from bakery.bake.options import BuildOptions

    assert {"default", "small"} <= set(preset.names("builds"))
    for name in preset.names("builds"):
        preset.options_from(BuildOptions, preset.load("builds", name), name)
    with pytest.raises(UsageProblem, match="no preset 'smal'; did you mean 'small'"):
        preset.load("builds", "smal")
    with pytest.raises(UsageProblem, match="known: default"):
        preset.load("builds", "x" * 300)


def test_broken_files(tmp_path):
    (tmp_path / "a.toml").write_text("= 3")
    with pytest.raises(UsageProblem, match="not valid TOML"):
        preset.load("builds", tmp_path / "a.toml")
    (tmp_path / "b.toml").write_text("a = " + "[" * 9000)
    (tmp_path / "c.toml").write_text("#" * (preset.LARGEST + 1))
    for name, message in (("b", "not valid TOML"), ("c", "no preset")):
        with pytest.raises(UsageProblem, match=message):
            preset.load("builds", tmp_path / f"{name}.toml")
    with pytest.raises(UsageProblem, match="x.texture.resolution: 100; 512 to 4096 texels"):
        from bakery.bake.options import BuildOptions

        preset.options_from(BuildOptions, {"texture": {"resolution": 100}}, "x")
