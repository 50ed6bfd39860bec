"""A short run of the fuzzer over every kind; `make fuzz` is the long one.

It may fail where a run before did not only if a reader or a seed changed: cases depend on their
numbers alone.
"""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).resolve().parent
COUNT = 10  # of each kind, .ci/run reads 2,000; kinds with a slow reader take a share of it
KINDS = (
    "textures masks head fit landmarks exr take sound clip photo mesh manifest web glb others "
    "avatar scene placing"
).split()  # fmt: skip

pytestmark = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="needs /proc and fork")


def run(*arguments):
    """The report of `python tests/fuzz ...`."""
    done = subprocess.run(
        [sys.executable, HERE, *map(str, arguments), "--json"], capture_output=True, text=True
    )
    assert done.returncode in (0, 1) and done.stdout, done.stderr
    return json.loads(done.stdout)


@pytest.fixture(scope="module")
def reports():
    found = run(COUNT, "--jobs", max(2, min(os.cpu_count() or 1, 4)))
    assert list(found) == KINDS
    return found


@pytest.mark.parametrize("kind", KINDS)
def test_only_errors_of_ours_come_out(reports, kind):
    report = reports[kind]
    failures = [
        f"{entry['count']} x {what}, first case {entry['number']}: {entry['detail'][-800:]}"
        for what, entry in report["failures"].items()
    ]
    advice = f"\nagain: python tests/fuzz --replay NUMBER {kind}"
    assert not failures, "\n".join(failures) + advice
    cases = sum(report["counts"].values())
    if cases > 20:  # else the changes would not get past the first check, or would break nothing
        assert report["counts"].get("accepted", 0) > 0.05 * cases
        assert report["counts"].get("refused", 0) > 0.05 * cases


@pytest.fixture(scope="module")
def planted():
    return run(60, "--planted", "--hang", 5, "--memory", 200, "--jobs", 2)


@pytest.mark.parametrize(
    "kind, what",
    [
        ("traceback", "KeyError in planted.py:<lambda>"),
        ("system", "FileNotFoundError in planted.py:<lambda>"),
        ("lines", "an error that is no short line"),
        ("memory", "memory"),
        ("hang", "hang"),
        ("crash", "crash"),
    ],
)
def test_planted_mistakes_are_found(planted, kind, what):
    """Each at its case 7 (and 57), and the cases after a lost worker are run all the same."""
    report = planted[kind]
    assert list(report["failures"]) == [what]
    assert report["failures"][what]["number"] == 7
    assert sum(report["counts"].values()) == 60


def test_a_good_reader_passes_and_what_is_printed_is_told(planted):
    assert planted["good"]["failures"] == {} == planted["prints"]["failures"]
    assert planted["good"]["counts"] == {"accepted": 30, "refused": 30}
    assert planted["prints"]["prints"] == {"libpng warning 0": 2}


def test_cases_depend_on_their_numbers_alone(reports):
    again = run(COUNT, "take", "exr", "--jobs", 1)
    for kind in ("take", "exr"):
        assert again[kind]["counts"] == reports[kind]["counts"]
