"""Puts bakery under stress, row by row, and counts what breaks: docs/reliability.md has the figures.

    python tests/campaign                          every row, more than an hour on two cores
    python tests/campaign --share 0.01             a hundredth of the cases: minutes
    python tests/campaign "kill -9" "power cut"    some rows
    python tests/campaign --part 2/4 --keep kept.json "kill -9"    the second quarter of a row
    python tests/campaign --keep kept.json --write                 put the table into docs/reliability.md

Mutated files are `make fuzz`, which the campaign runs as a row of its own.
"""

import os

# As `bakery` sets them itself; OpenBLAS and OpenMP read them once, when they are loaded.
os.environ |= {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}

import argparse  # noqa: E402
import datetime  # noqa: E402
import json  # noqa: E402
import platform  # noqa: E402
import shutil  # noqa: E402
import subprocess  # noqa: E402
import sys  # noqa: E402
import tempfile  # noqa: E402
import time  # noqa: E402
from pathlib import Path  # noqa: E402

ROOT = Path(__file__).resolve().parents[2]
REPORT = ROOT / "docs" / "reliability.md"
# Seconds that all of the failing calls, and allocations, take; of a share a fair sample is run.
EVERY_CALL, EVERY_PLACE = 3600, 2 * 3600
BEGIN, END = "<!-- campaign -->", "<!-- end -->"
sys.path.insert(0, str(ROOT))

import base  # noqa: E402
import faults  # noqa: E402
import fuzzed  # noqa: E402
import kills  # noqa: E402
import offline  # noqa: E402
import power  # noqa: E402
import rebuilds  # noqa: E402
import server  # noqa: E402
import traces  # noqa: E402

PARTED = (
    "kill -9",
    faults.CALLS,
    faults.MEMORY,
)  # rows whose cases have nothing to do with each other


def rows(inputs, place, lanes, share, part, parts):
    """{name: function that runs a row}; `share` is how many of the cases are run, of so many parts."""

    def count(whole, least=1):
        return max(round(whole * share / parts), least)

    def seconds(whole):
        return None if share == 1 else share * whole / parts

    return {
        "kill -9": lambda: kills.run(inputs, place, count(2000, 10), lanes, part),
        faults.CALLS: lambda: faults.run(
            faults.CALLS, inputs, place, lanes, seconds(EVERY_CALL), (part, parts)
        ),
        faults.MEMORY: lambda: faults.run(
            faults.MEMORY, inputs, place, lanes, seconds(EVERY_PLACE), (part, parts)
        ),
        "damaged files": lambda: fuzzed.run(count(100_000), count(20_000), lanes),
        "power cut": lambda: power.run(inputs, place, count(200, 4)),
        "network": lambda: offline.run(inputs, place),
        "traces of a photo": lambda: traces.run(inputs, place),
        "rebuilds": lambda: rebuilds.run(inputs, place, count(50, 2)),
        "page and --serve": lambda: server.run(inputs, place, count(10_000, 100)),
    }


def say(row):
    print(
        f"{row.name:19} {row.cases:7} cases  {len(row.failures):4} failures  {row.seconds:7.0f} s  {row.said()}"
    )
    sys.stdout.flush()


def now():
    """The date and the commit."""
    line = ["git", "-C", str(ROOT), "rev-parse", "--short", "HEAD"]
    commit = subprocess.run(line, capture_output=True, text=True).stdout.strip()
    return f"{datetime.date.today().isoformat()} at {commit}"


def table(found):
    """Lines of Markdown for rows, with where and when they were measured."""
    where = (
        f"{platform.machine()}, {os.cpu_count()} cores, {platform.system()} {platform.release()}"
    )
    lines = [
        f"Measured on {where}.", "",
        "| row | must | cases | failures | minutes | measured |", "|---|---|---|---|---|---|",
    ]  # fmt: skip
    for row in found:
        note = f" ({row.said()})" if row.note else ""
        cells = (
            row.name, row.must, f"{row.cases:,}{note}", len(row.failures),
            f"{row.seconds / 60:.1f}", "; ".join(row.measured),
        )  # fmt: skip
        lines.append(f"| {' | '.join(map(str, cells))} |")
    return "\n".join(lines)


def write(found):
    """Put the table into the report, between its two marks."""
    text = REPORT.read_text("utf-8")
    before, rest = text.split(BEGIN)
    after = rest.split(END)[1]
    REPORT.write_text(f"{before}{BEGIN}\n{table(found)}\n{END}{after}", "utf-8")


def _part(text):
    """(K - 1, N) of K/N."""
    part, parts = (int(word) for word in text.split("/"))
    if not 1 <= part <= parts:
        raise ValueError(text)
    return part - 1, parts


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("rows", nargs="*", help="names of rows; all without any")
    parser.add_argument("--share", type=float, default=1.0, help="part of the cases")
    parser.add_argument("--lanes", type=int, default=os.cpu_count() or 1, help="side by side")
    parser.add_argument(
        "--part", type=_part, default=(0, 1), metavar="K/N", help=f"of the rows {', '.join(PARTED)}"
    )
    parser.add_argument("--keep", type=Path, help="JSON of rows; parts in it are not run again")
    parser.add_argument(
        "--write", action="store_true", help="put the table into docs/reliability.md"
    )
    asked = parser.parse_args()
    base.load()
    place = Path(tempfile.mkdtemp(prefix="campaign-"))
    kept = json.loads(asked.keep.read_text()) if asked.keep and asked.keep.exists() else {}
    try:
        inputs = base.Inputs(place / "inputs").make()
        known = rows(inputs, place, asked.lanes, asked.share, *asked.part)
        if unknown := set(asked.rows) - set(known):
            parser.error(f"no row {', '.join(sorted(unknown))}; known: {', '.join(known)}")
        if asked.part[1] > 1 and (whole := set(asked.rows or known) - set(PARTED)):
            parser.error(f"no part of {', '.join(sorted(whole))}; they are run as a whole")
        found, part = [], f"{asked.part[0] + 1}/{asked.part[1]}"
        for name in asked.rows or known:
            before = kept.get(name, {"parts": [], "row": None})
            row, done = base.Row(**before["row"]) if before["row"] else None, before["parts"]
            if row is None or (asked.part[1] > 1 and part not in done):
                if any(other.split("/")[1] != str(asked.part[1]) for other in done):
                    parser.error(
                        f"{asked.keep}: {name} has parts {', '.join(done)}; give such a one"
                    )
                began = time.monotonic()
                new = known[name]()
                new.seconds = time.monotonic() - began  # with what the row prepares
                new.measured = [now()]
                say(new)
                if row is None:
                    row = new
                else:
                    row.add(new)
                kept[name] = {"parts": [*done, part], "row": vars(row)}
                if asked.keep:
                    asked.keep.write_text(json.dumps(kept, indent=1))
            found.append(row)
        if asked.write:
            # All that is kept, or a few rows would take the place of the others.
            write([base.Row(**kept[name]["row"]) for name in known if name in kept])
        return int(any(row.failures for row in found))
    finally:
        shutil.rmtree(place, ignore_errors=True)


if __name__ == "__main__":
    sys.exit(main())
