"""Changes valid files at random and reads them: only BakeryError may come out, in a few milliseconds.

    python tests/fuzz 50000                  every kind
    python tests/fuzz 50000 exr take         some
    python tests/fuzz --replay exr 1234      one case again, here, with its traceback

Case k of a kind is the same at every run. Failing files are kept in .work/fuzz/KIND-K-NAME.
"""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # a fork must not lose threads
os.environ.setdefault("OMP_NUM_THREADS", "1")

import argparse  # noqa: E402
import json  # noqa: E402
import shutil  # noqa: E402
import sys  # noqa: E402
import tempfile  # noqa: E402
from pathlib import Path  # noqa: E402

ROOT = Path(__file__).resolve().parents[2]
KEPT = ROOT / ".work" / "fuzz"
sys.path.insert(0, str(ROOT))

import harness  # noqa: E402
import planted  # noqa: E402


def in_a_child(make):
    """Call `make()` in a process of its own: threads that it starts would not outlive a fork."""
    sys.stdout.flush()
    child = os.fork()
    if child == 0:
        code = 1
        try:
            make()
            code = 0
        finally:
            os._exit(code)
    if os.waitpid(child, 0)[1]:
        sys.exit("the seeds could not be made")


def keep(report):
    """Write the first input of each failure; its place goes into the report."""
    for failure in report.failures.values():
        KEPT.mkdir(parents=True, exist_ok=True)
        path = KEPT / f"{report.kind}-{failure['number']}-{failure['name']}"
        path.write_bytes(failure["data"])
        failure["input"] = str(path.relative_to(ROOT))


def say(report):
    """A line for a kind and one for each of its failures."""
    counts = report.counts
    print(
        f"{report.kind:10} {sum(counts.values()):7} cases  {counts['accepted']:6} accepted "
        f"{counts['refused']:6} refused  {report.seconds:6.1f} s  slowest {report.slowest[0]:.2f} s "
        f"(case {report.slowest[1]})"
    )
    for line, times in report.prints.most_common(5):
        print(f"    prints {times} x {line}")
    for what, failure in report.failures.items():
        print(
            f"    {failure['count']:5} x {what}; first: case {failure['number']}, {failure['input']}"
        )


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("count", nargs="?", type=int, default=2000, help="cases of each kind")
    parser.add_argument("kinds", nargs="*", help="names of kinds; all without any")
    parser.add_argument("--first", type=int, default=0, help="number of the first case")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--hang", type=float, default=harness.HANG, help="seconds a case may take")
    parser.add_argument("--memory", type=int, default=harness.MEMORY >> 20, help="MiB it may take")
    parser.add_argument("--json", action="store_true", help="the report as JSON")
    parser.add_argument("--planted", action="store_true", help="the harness's own test, no reader")
    parser.add_argument("--replay", action="store_true", help="read case COUNT of one kind, here")
    asked = parser.parse_intermixed_args()
    folder = Path(tempfile.mkdtemp(prefix="fuzz-"))
    try:
        if asked.planted:
            every = planted.kinds()
        else:
            import kinds
            import seeds

            in_a_child(lambda: seeds.write(folder))
            every = kinds.files(folder) + kinds.in_bundles(folder) + kinds.in_stages(folder)
        known = {kind.name: kind for kind in every}
        if unknown := set(asked.kinds) - set(known):
            parser.error(f"no kind {', '.join(sorted(unknown))}; known: {', '.join(known)}")
        chosen = [known[name] for name in asked.kinds] or every
        if asked.replay:
            name, data = chosen[0].case(asked.count)
            (folder / name).write_bytes(data)
            return chosen[0].read(folder / name)
        os.environ["FUZZ_FOLDER"] = str(folder)
        limits = asked.hang, asked.memory << 20
        reports = harness.run(chosen, asked.count, asked.jobs, asked.first, *limits)
        for report in reports.values():
            keep(report)
            if not asked.json:
                say(report)
        if asked.json:
            print(json.dumps({name: report.table() for name, report in reports.items()}, indent=1))
        return int(any(report.failures for report in reports.values()))
    finally:
        shutil.rmtree(folder, ignore_errors=True)


if __name__ == "__main__":
    sys.exit(main())
