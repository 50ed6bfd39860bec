"""What a bake will take: the estimate is the sum of the plan, and both grow with what is asked."""

from dataclasses import replace

import pytest

from bakery.bake import estimate as estimates
from bakery.bake.estimate import estimate, plan
from bakery.bake.options import BuildOptions
from bakery.bake.targets import read_targets
from bakery.bake.textures import STEPS
from bakery.preset import load, options_from

DEFAULT = BuildOptions()


@pytest.fixture(autouse=True)
def host(monkeypatch):
    """A host of two cores whose reference load takes 0.1 s."""
    monkeypatch.setattr(estimates.os, "cpu_count", lambda: 2)
    monkeypatch.setattr(estimates, "reference_seconds", lambda: 0.1)


def preset(name):
    return options_from(BuildOptions, load("builds", name), name)


def with_texture(**changes):
    return replace(DEFAULT, texture=replace(DEFAULT.texture, **changes))


def long(options, **arguments):
    """How long each step is."""
    return {step: runs for step, (runs, _) in plan(options, **arguments).items()}


def test_synthesis_takes_time_but_no_more_in_denser_atlases():
    def more(resolution):
        quick, slow = (
            long(with_texture(complete=name, resolution=resolution))["neutral"]
            for name in ("quick", "synthesize")
        )
        return slow - quick

    assert 0 < more(512) < more(1024) == pytest.approx(more(4096))


def test_an_estimate_is_the_sum_of_the_plan():
    for options in (DEFAULT, preset("small"), preset("mobile")):
        assert estimate(options).seconds == pytest.approx(0.1 * sum(long(options).values()))


@pytest.mark.parametrize(
    "side, views, mouths, generator, seconds, gibibytes",
    [  # the bakes of docs/log.md, "What a bake takes"
        (512, 3, 60, "pagan", 46.6, 1.21),
        (1024, 3, 300, "pagan", 96.5, 1.72),
        (1024, 1, 60, "pagan", 48.5, 1.48),
        (2048, 1, 60, "pagan", 86.9, 2.40),
        (512, 3, 60, "rendered", 30.1, 0.93),
        (1024, 1, 60, "rendered", 33.4, 1.34),
    ],
)
def test_the_bakes_that_were_measured(
    side, views, mouths, generator, seconds, gibibytes, monkeypatch
):
    """On one core, of which the reference load took 0.08 s: all of a bake's processor time."""
    monkeypatch.setattr(estimates.os, "cpu_count", lambda: 1)
    monkeypatch.setattr(estimates, "reference_seconds", lambda: 0.08)
    asked = with_texture(resolution=side, views=(0.0, 40.0, -40.0)[:views], mouths=mouths)
    found = estimate(asked, generator=generator)
    assert found.seconds == pytest.approx(seconds, rel=1 / 5)
    assert found.gibibytes == pytest.approx(gibibytes, rel=1 / 3)


def test_steps_are_called_as_often_as_they_are_planned():
    targets = read_targets()
    assert len(targets.key_names) == 6 and len(targets.gaze) == 20
    calls = {step: count for step, (_, count) in plan(DEFAULT).items()}
    assert calls == {
        "detect": 1, "segment": 1, "fit": 1, "neutral": 1, "key": 6, "gaze": 20, "mouth": 300,
        "mask": 1, "bundle": 1,
    }  # fmt: skip
    assert set(STEPS) < set(calls)
    few = replace(targets, mouths=targets.mouths[:7], gaze=targets.gaze[:3])
    calls = plan(DEFAULT, few)
    assert calls["mouth"][1] == 7 and calls["gaze"][1] == 3


@pytest.mark.parametrize(
    "more, grow",
    [
        ({"resolution": 2048}, {"neutral", "key", "gaze", "mouth", "bundle"}),
        ({"views": (0.0, 20.0, -20.0, 40.0, -40.0)}, {"key"}),
        ({"mouths": 150}, {"mouth", "bundle"}),
    ],
)
def test_what_is_asked_for_makes_its_own_steps_longer(more, grow):
    less, more = long(with_texture(mouths=100)), long(with_texture(**{"mouths": 100} | more))
    assert {step for step in less if more[step] > less[step]} == grow
    assert all(more[step] >= less[step] for step in less)


def test_pictures_cost_in_proportion_to_their_number():
    few, many = long(with_texture(mouths=60)), long(with_texture(mouths=240))
    assert many["mouth"] == pytest.approx(4 * few["mouth"])
    one, three = long(with_texture(views=(0.0,))), long(with_texture(views=(0.0, 40.0, -40.0)))
    two = long(with_texture(views=(0.0, 40.0)))
    assert three["key"] - two["key"] == pytest.approx(two["key"] - one["key"])


def test_only_pictures_are_made_side_by_side(monkeypatch):
    two = long(DEFAULT)
    monkeypatch.setattr(estimates.os, "cpu_count", lambda: 4)
    four = long(DEFAULT)
    assert {step: two[step] / four[step] for step in two} == pytest.approx(
        {step: 2.0 if step in ("key", "gaze", "mouth") else 1.0 for step in two}
    )


def test_presets_and_generators_stand_in_order():
    small, default = estimate(preset("small")), estimate(DEFAULT)
    assert small.seconds < default.seconds and small.gibibytes < default.gibibytes
    large = estimate(with_texture(resolution=4096))
    assert default.seconds < large.seconds and default.gibibytes < large.gibibytes
    assert estimate(DEFAULT, generator="rendered").seconds != default.seconds
    assert estimate(DEFAULT, generator="mine") == default  # another package's
