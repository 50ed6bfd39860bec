"""Damaged files of every kind that bakery reads, by tests/fuzz: only a short error may come of them."""

import json
import os
import subprocess
import sys

import base

MUST = "100,000 photos, 20,000 of each other kind: 0 crashes, hangs, over 1 GiB"


def run(photos: int, others: int, lanes: int) -> base.Row:
    """Read `photos` damaged photos and `others` damaged files of each other kind (tests/fuzz has shares)."""
    row = base.Row("damaged files", MUST)
    reports = _reports(photos, ["photo"], lanes)
    every = _reports(others, [], lanes)
    del every["photo"]
    for name, report in (reports | every).items():
        row.cases += sum(report["counts"].values())
        for what, failure in report["failures"].items():
            row.fail(f"{name}: {failure['count']} times {what}, first case {failure['number']}")
    row.note = f"{sum(reports['photo']['counts'].values()):,} of them photos"
    return row


def _reports(count, kinds, lanes):
    """What tests/fuzz says of each kind."""
    line = [sys.executable, str(base.ROOT / "tests" / "fuzz"), str(count), *kinds, "--json"]
    env = {name: value for name, value in os.environ.items() if name != "TMPDIR"}
    done = subprocess.run([*line, "--jobs", str(lanes)], capture_output=True, text=True, env=env)
    if not done.stdout:
        raise RuntimeError(f"tests/fuzz itself failed: {done.stderr[-500:]}")
    return json.loads(done.stdout)
