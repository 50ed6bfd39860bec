"""Options and their texts by rule: whatever is asked becomes valid options or one line of error."""

import math
import tomllib

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as some

from bakery import preset
from bakery.bake.options import BuildOptions
from bakery.errors import BakeryError
from bakery.formats.targets import expression_weights, parse_weights, weight_rows
from bakery.motion.retarget import parse_gain
from bakery.settings import listing
from bakery.types import EXPRESSIONS

SETTINGS = {key: (kind, value, allowed) for key, kind, value, allowed in listing(BuildOptions())}
TEXT = some.text(max_size=12)
NUMBERS = some.integers() | some.floats() | some.integers(-5, 5000) | some.floats(-1, 2)
VALUES = some.recursive(
    some.booleans() | NUMBERS | TEXT | some.dates(),
    lambda inner: some.lists(inner, max_size=4) | some.dictionaries(TEXT, inner, max_size=3),
    max_leaves=6,
)


def options_of(tables):
    """BuildOptions, or None with a short message; the command line makes one line of any."""
    try:
        return preset.options_from(BuildOptions, tables, "preset test")
    except BakeryError as error:
        assert 0 < len(str(error)) < 500
        return None


def nested(key, value):
    for step in reversed(key.split(".")):
        value = {step: value}
    return value


@given(some.sampled_from(sorted(SETTINGS)), VALUES)
def test_any_value_of_any_option(key, value):
    made = options_of(nested(key, value))
    if made is not None:
        found = {name: got for name, _, got, _ in listing(made)}
        kind, _, allowed = SETTINGS[key]
        entries = found[key] if isinstance(found[key], tuple) else (found[key],)
        for entry in entries:
            assert not isinstance(entry, float) or math.isfinite(entry)
            if allowed.low is not None:
                assert allowed.low <= entry <= allowed.high
        others = {name: got for name, _, got, _ in listing(BuildOptions()) if name != key}
        assert {name: found[name] for name in others} == others


@pytest.mark.parametrize("key", sorted(SETTINGS))
def test_what_an_option_is_may_be_given(key):
    """Each default as a preset, and the ends of its range; no number beyond them, no nan."""
    kind, value, allowed = SETTINGS[key]
    listed = list(value) if isinstance(value, tuple) else value
    assert options_of(nested(key, listed)) == BuildOptions()
    if allowed.low is not None and not isinstance(value, tuple):
        below, above = (
            np.nextafter(end, way) if kind is float else end + int(math.copysign(1, way))
            for end, way in ((allowed.low, -math.inf), (allowed.high, math.inf))
        )
        assert options_of(nested(key, below if kind is int else float(below))) is None
        assert options_of(nested(key, above if kind is int else float(above))) is None
    if kind is float:
        for wrong in (math.nan, math.inf, -math.inf):
            assert options_of(nested(key, wrong)) is None


@given(
    some.dictionaries(TEXT | some.sampled_from(["texture", "fit", "bundle"]), VALUES, max_size=3)
)
def test_any_tables(tables):
    options_of(tables)


@given(
    some.text(max_size=30) | some.builds("{}={}".format, some.sampled_from(sorted(SETTINGS)), TEXT)
)
def test_any_setting_on_the_command_line(text):
    try:
        tables = preset.with_settings({"texture": {"mouths": 3}}, [text])
    except BakeryError as error:
        assert "\n" not in str(error).replace(text, "")
    else:
        options_of(tables)


@given(some.binary(max_size=80) | some.text("[]={}.\"'abc01 \n#", max_size=60).map(str.encode))
def test_any_file_is_a_preset_or_an_error(tmp_path_factory, data):
    path = tmp_path_factory.getbasetemp() / "any.toml"
    path.write_bytes(data)
    try:
        assert isinstance(preset.load("builds", path), dict)
    except BakeryError as error:
        assert "\n" not in str(error)


@given(some.lists(some.tuples(some.sampled_from(sorted(SETTINGS)), NUMBERS), max_size=4))
def test_valid_options_survive_their_own_toml(pairs):
    """`bakery presets show` prints what `--preset` reads back the same."""
    tables = {}
    for key, value in pairs:
        made = options_of(nested(key, value))
        if made is not None:
            tables = preset.with_settings(tables, [f"{key}={value!r}"])
    made = options_of(tables)
    assert made is not None
    back = preset.options_from(BuildOptions, tomllib.loads(preset.as_toml(made)), "again")
    assert back == made


# --- weights and gains ---


@given(some.dictionaries(some.sampled_from(EXPRESSIONS), some.floats(0, 1), max_size=6))
def test_weights_come_back(table):
    text = ",".join(f"{name} = {value!r}" for name, value in table.items())
    assert parse_weights(text, "--weights") == table
    row = weight_rows([table], "--weights")[0]
    wanted = [np.float32(table.get(name, 0.0)) for name in EXPRESSIONS]
    np.testing.assert_array_equal(row, wanted)


PIECES = some.lists(
    some.sampled_from([*EXPRESSIONS[:5], "laugh", "key:smile", "viseme:AA", "head", "gaze", "", "x"])
    .flatmap(lambda name: some.builds(
        "{}{}{}".format, some.just(name), some.sampled_from(["=", "", " = ", "=="]),
        some.sampled_from(["0.5", "1", "nan", "inf", "-1", "2", "1e-9", "", "a", "0x1", "1_0", "٣"]),
    )) | some.text(max_size=8),
    max_size=3,
).map(",".join)  # fmt: skip


@given(PIECES)
def test_any_text_of_weights_is_weights_or_an_error(text):
    for read in (
        lambda: expression_weights(text),
        lambda: weight_rows([parse_weights(text, "--weights")], "--weights"),
        lambda: np.array(list(parse_gain([text]).values()) or [0.0]) / 10,
    ):
        try:
            values = np.asarray(read(), float)
        except BakeryError as error:
            assert len(str(error)) < 2000  # some list all names that there are
        else:
            assert np.isfinite(values).all() and values.min() >= 0 and values.max() <= 1
