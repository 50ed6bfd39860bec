"""kill -9 at random moments: what a command writes is the old one, the new one or nothing, and never torn.

A series is a folder in which a command is begun and killed up to `SERIES` times, and then run to its end:
that must give the bytes of an undisturbed run, and leave nothing else behind.
"""

import random
import shutil
from pathlib import Path

import base

SERIES = 4
SLOWER = 1.2  # times an undisturbed run: side by side commands take longer
MUST = "2,000 kills: 0 torn, 0 left behind after the next run"


def run(inputs: base.Inputs, place: Path, count: int, lanes: int, part: int = 0) -> base.Row:
    """Kill commands `count` times.

    Args:
        place: a folder to work in.
        lanes: how many are run side by side.
        part: another one has other moments.
    """
    whole = {}
    for command in inputs.commands():
        folder = place / f"whole-{command.name}"
        whole[command.name] = base.undisturbed(command, folder)
        shutil.rmtree(folder)

    def lane(number: int) -> base.Row:
        return _lane(
            inputs, place / f"kills-{number}", count // lanes, whole, seed=part * lanes + number
        )

    return base.in_lanes(lane, lanes)


def _lane(inputs, place, count, whole, seed):
    row = base.Row("kill -9", MUST)
    by_command = {command.name: 0 for command in inputs.commands()}
    rng = random.Random(seed)
    while row.cases < count:
        command = min(inputs.commands(), key=lambda each: by_command[each.name])
        killed = _series(row, command, place, *whole[command.name], rng)
        by_command[command.name] += killed
        row.cases += killed
    return row


def _series(row, command, place, new, seconds, rng):
    """Kill a command in a fresh folder a few times, then let it end; how often it was killed."""
    shutil.rmtree(place, ignore_errors=True)
    place.mkdir(parents=True)
    target, log, killed = place / command.out, place / "log", 0
    old = ""
    if rng.random() < 0.5:
        base.copied(command.old, target)
        old = base.content(target)
    for _ in range(SERIES):
        pid = base.fork(base.command_line(command.line(place)), log, place)
        end = base.wait(pid, log, kill_after=rng.uniform(0, SLOWER * seconds))
        found = base.content(target)
        if end.code is None:
            killed += 1
        elif end.code:
            row.fail(f"{command.name}: after a kill it ends with {end.code}: {end.said[-300:]}")
        if found not in (old, new):
            row.fail(f"{command.name}: torn after {end.seconds:.2f} s")
        if end.code is not None:
            break
        old = found if found == new else old
    end = base.run(command.line(place), place)
    if end.code != 0 or base.content(target) != new:
        row.fail(
            f"{command.name}: the next run gives {end.code}, or other bytes: {end.said[-300:]}"
        )
    if left := base.left_in(place, command):
        row.fail(f"{command.name}: left behind: {', '.join(left)}")
    return killed
