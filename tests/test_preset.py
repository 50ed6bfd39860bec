"""Presets: what they may say, and how a wrong word is answered."""

from dataclasses import dataclass, field

import pytest

from bakery import preset
from bakery.errors import InputError


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
        ({"sise": 3}, "unknown sise; known: inner, name, size"),
        ({"size": "big"}, "test.size: 'big', needs int"),
        ({"size": True}, "needs int"),
        ({"inner": 3}, "needs a table"),
        ({"inner": {"rate": "fast"}}, "test.inner.rate: 'fast', needs float"),
    ],
)
def test_wrong_tables(table, message):
    with pytest.raises(InputError, match=message):
        preset.options_from(Options, table, "test")


def test_settings_go_on_top():
    tables = preset.with_settings({"a": {"x": 1}}, ["a.x=2", "b.name=word", "c.d.e=[1, 2]"])
    assert tables == {"a": {"x": 2}, "b": {"name": "word"}, "c": {"d": {"e": [1, 2]}}}
    with pytest.raises(InputError, match="table.key=value"):
        preset.with_settings({}, ["size"])


def test_every_shipped_preset_is_valid():
    from bakery.bake.options import BuildOptions

    assert {"default", "small"} <= set(preset.names("builds"))
    for name in preset.names("builds"):
        preset.options_from(BuildOptions, preset.load("builds", name), name)
    with pytest.raises(InputError, match="known: default"):
        preset.load("builds", "nothing")


def test_broken_files(tmp_path):
    (tmp_path / "a.toml").write_text("= 3")
    with pytest.raises(InputError, match="not valid TOML"):
        preset.load("builds", tmp_path / "a.toml")
    with pytest.raises(InputError, match="resolution 100"):
        from bakery.bake.options import BuildOptions

        preset.options_from(BuildOptions, {"texture": {"resolution": 100}}, "x")
