"""One bar over the whole run, which never goes back, with the time that is left."""

import logging

import pytest

from bakery.bake.estimate import plan
from bakery.bake.options import BuildOptions
from bakery.cli import progress
from bakery.cli.progress import Progress, span


@pytest.fixture
def clock(monkeypatch):
    """A clock that is set by hand: a list of one number, seconds."""
    now = [0.0]
    monkeypatch.setattr(progress.time, "monotonic", lambda: now[0])
    return now


def bake(mouths=300):
    """The calls of a bake, as pipeline and steps make them."""
    yield from (("detect", 0, 4), ("segment", 1, 4), ("fit", 1, 4))
    total = 27 + mouths
    words = ["neutral", *["key"] * 6, *["gaze"] * 20, *["mouth"] * mouths]
    yield from ((word, done, total) for done, word in enumerate(words))
    yield from (("mask", 2, 4), ("bundle", 3, 4))


def test_a_bake_is_one_run(clock):
    running, shares = Progress("a", plan(BuildOptions()), None), []
    for step, done, total in bake():
        running.step, before = running.step, running.step
        running(step, done, total)
        shares.append(running.share(done, total))
        assert before is None or running.step
    assert shares == sorted(shares) and shares[0] == 0 and 0.85 < shares[-1] < 1
    # 300 mouths go from what was before them to what comes after, evenly.
    mouths = shares[30:330]
    steps = [later - sooner for sooner, later in zip(mouths, mouths[1:])]
    assert max(steps) - min(steps) < 1e-9 and mouths[-1] - mouths[0] > 0.3


def test_the_time_left_comes_from_what_is_done(clock):
    lines = []
    running = Progress("anna.avatar", {}, lines.append)
    for frame in range(0, 101, 10):
        clock[0] = 2.0 * frame
        running("animate", frame, 100)
    assert "left" not in lines[0] and lines[0].startswith("anna.avatar [....")
    assert lines[1].endswith(" 10%  animate, 3 min left")  # 180 s
    assert lines[6].endswith(" 60%  animate, 80 s left")
    assert lines[-1].endswith("100%  animate, 0 s left") and "." not in lines[-1].split("]")[0][12:]


def test_a_run_that_goes_on_counts_from_where_it_was(clock):
    lines = []
    running = Progress("", {}, lines.append)
    for clock[0], frame in ((0, 900), (10, 950)):
        running("animate", frame, 1000)
    assert lines[-1].endswith("95%  animate, 10 s left")


def test_two_counted_steps_share_the_bar(clock):
    running = Progress("", {"follow": (3, None), "fit": (1, None)}, None)
    shares = []
    for step, done in (("follow", 0), ("follow", 5), ("follow", 10), ("fit", 0), ("fit", 10)):
        running(step, done, 10)
        shares.append(running.share(done, 10))
    assert shares == [0, 0.375, 0.75, 0.75, 1]


def test_several_bakes_are_one_run(clock):
    lines, shares = [], []
    running = Progress("", plan(BuildOptions()), lines.append)
    for number in range(3):
        running.begin(f"{number}.avatar", number, 3)
        for step, done, total in bake():
            clock[0] += 0.2
            running(step, done, total)
            shares.append(running.share(done, total))
    assert shares == sorted(shares) and shares[0] == 0 and 0.95 < shares[-1] < 1
    assert lines[0].startswith("[1/3] 0.avatar [") and lines[-1].startswith("[3/3] 2.avatar [")


def test_not_drawn_too_often(clock):
    lines = []
    running = Progress("", {}, lines.append)
    for k in range(1000):
        clock[0] = k * 1e-3
        running("x", k, 1000)
    assert 5 <= len(lines) <= 11


def test_each_step_is_logged_with_its_time(clock, caplog):
    caplog.set_level(logging.INFO)
    running = Progress("a", {}, None)
    for clock[0], step in ((0, "detect"), (1, "key smile"), (2, "key anger"), (4.5, "masks")):
        running(step, 0, 4)
    clock[0] = 5.0
    running.end()
    assert [record.message for record in caplog.records] == [
        "detect: 1.0 s", "key: 3.5 s, 2 times", "masks: 0.5 s",
    ]  # fmt: skip


def test_spans():
    assert [span(s) for s in (0, 12.4, 89, 90, 3599, 5400, 7500)] == [
        "0 s", "12 s", "89 s", "2 min", "60 min", "1 h 30 min", "2 h 05 min",
    ]  # fmt: skip


def test_no_bar_where_others_draw(monkeypatch):
    monkeypatch.setattr(progress.sys.stderr, "isatty", lambda: True, raising=False)
    monkeypatch.setenv("MAKEFLAGS", "kw")
    assert progress.bar_wanted(0) and not progress.bar_wanted(-1) and not progress.bar_wanted(1)
    monkeypatch.setenv("MAKEFLAGS", "kw -j2 --jobserver-auth=3,4")
    assert not progress.bar_wanted(0)


def test_a_drawn_bar_is_taken_away(monkeypatch, capsys):
    monkeypatch.setattr(progress, "bar_wanted", lambda verbosity: True)
    with progress.progress(0, "a\nb\x1b[2J.avatar") as running:
        running("fit", 1, 2)
    said = capsys.readouterr().err
    assert said.startswith("\r\x1b[Kab[2J.avatar [############............]  50%  fit")
    assert said.endswith("\r\x1b[K") and "\n" not in said
