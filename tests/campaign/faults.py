"""A failing call: each read, write, rename, fsync, mkdir, unlink, mmap, large malloc of a bake fails once.

An LD_PRELOAD library of our own, faults.c, counts calls and lets one of them fail. It must be there when
a process begins, so an interpreter of its own runs the row; it imports everything, and the library is
armed in each fork of it, before the command begins: importing is not under test. Calls about files and
allocations are two rows.

File calls count if they are about the case's folder, which holds copies of photo and old bundle, the
output and the temporary files. Allocations count from 256 KiB on: smaller ones are hundreds of thousands,
Linux refuses hardly any, and Python, which makes most of them, has nothing left then to say so with. The
large ones are still 18,000 in 1,800 places of the code: the first of each place fails. A bake that goes on
from another's finished steps comes to most of them sooner: the shortest of STARTS that reaches it is taken.

A bake of one photo is one process. Its threads share the counters, which are atomic; with them the order
of calls, and their number by a few, differs from run to run, so a call may not be reached: no case then.
A process that a bake forked would count on in the same memory.

    python tests/campaign/faults.py [--count] [--of N] [--only KIND ... [NUMBER ...] [--start START]]
                                    [--place FOLDER]

prints how many calls there are; tries N of each kind, spread; tries some kinds, or some calls of one, and
says where each was made and what bakery said.
"""

import argparse
import ctypes
import errno
import faulthandler
import mmap
import os
import pickle
import random
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import zlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import base

CALLS, MEMORY = "failing calls", "failing allocations"
MUST = {
    CALLS: "every file call of a small bake: 0 torn, 0 tracebacks",
    MEMORY: "a large allocation of each place of a small bake: 0 torn, 0 tracebacks",
}
KINDS = {  # in the order of faults.c, and what each fails with; "create" is opening for writing
    "read": errno.EIO, "open": errno.EIO, "write": errno.ENOSPC, "create": errno.ENOSPC,
    "rename": errno.EIO, "fsync": errno.EIO, "mkdir": errno.ENOSPC, "unlink": errno.EIO,
    "truncate": errno.ENOSPC, "mmap": errno.EIO, "malloc": errno.ENOMEM,
}  # fmt: skip
PHOTO, OUT = "photo.jpg", "a.avatar"
NEW = ".new-"  # how files begin that are not complete
WORK = re.compile(r"\.bakery-[0-9a-f]{10}-work")  # finished steps, from which the next bake goes on
OWN = f"{base.ROOT}/bakery/"
LINE = re.compile(r'File "(.*)", line (\d+) in')  # of faulthandler
TRACE = re.compile(r"Traceback|^\s*[\w.]*(Error|Exception)\b:|Exception ignored", re.M)

# Which finished steps lie there when a bake begins, by how their files are called; the shortest bake first.
STARTS = {"textures": ("",), "fit": ("detect.", "fit."), "fresh": ()}
FRESH = "fresh"
LONG = ctypes.c_longlong


class Call(NamedTuple):
    """A call of a bake, counted from 1."""

    kind: str
    number: int
    start: str = FRESH

    def __str__(self) -> str:
        start = "" if self.start == FRESH else f" --start {self.start}"
        return f"{self.kind} {self.number}{start}"


NONE = Call("", 0)  # no call fails


class _Told(ctypes.Structure):
    """struct told of faults.c."""

    _fields_ = [("counts", LONG * len(KINDS)), ("struck", LONG), ("path", ctypes.c_char * 4096)]


@dataclass(frozen=True)
class Result:
    """What a bake came to."""

    end: base.Ended
    struck: bool  # whether the call was reached
    counts: dict[str, int]
    where: str  # the failed call's path, and the lines of Python in which it was made
    bundle: str  # what `base.content` says of the output
    left: list[str]  # what lies in the folder and was not there, but for the output


def run(
    name: str,
    inputs: base.Inputs,
    place: Path,
    lanes: int,
    seconds: float | None = None,
    part: tuple[int, int] = (0, 1),
) -> base.Row:
    """Let every call of the row fail once.

    Args:
        name: CALLS or MEMORY.
        place: a folder to work in.
        lanes: how many bakes run side by side.
        seconds: begin no case after so many. Cases are shuffled: those that were run are a fair sample.
        part: which of how many parts of the cases.
    """
    place = place.resolve()
    try:
        library = build(place)
    except FileNotFoundError:
        return base.Row(name, MUST[name], note="skipped: there is no cc")
    asked = place / "asked.pickle"
    asked.write_bytes(pickle.dumps((name, inputs, place, lanes, seconds, part)))
    again(library, ["--row", asked])
    return pickle.loads(asked.read_bytes())


def build(place: Path) -> Path:
    """Compile faults.c."""
    place.mkdir(parents=True, exist_ok=True)
    library, source = place / "faults.so", Path(__file__).with_name("faults.c")
    line = ["cc", "-shared", "-fPIC", "-O2", "-o", library, source, "-ldl"]
    subprocess.run(line, check=True, timeout=120)
    return library


def again(library: Path, arguments: Sequence[object]) -> None:
    """Run this file in an interpreter with the library."""
    line = [sys.executable, __file__, *map(str, arguments)]
    # The latter as bakery/__main__.py sets it: more threads would give other bytes.
    env = os.environ | {"LD_PRELOAD": str(library), "OPENBLAS_NUM_THREADS": "1"}
    subprocess.run(line, check=True, env=env)


class Bench:
    """A folder in which the bake is run again and again, with one call failing."""

    def __init__(self, inputs: base.Inputs, place: Path) -> None:
        self.inputs = inputs
        self.arm = ctypes.CDLL(None).faults_arm
        text, address = ctypes.c_char_p, ctypes.c_void_p
        self.arm.argtypes = [ctypes.c_int, LONG, ctypes.c_int, text, address, ctypes.c_int]
        self.folder = (place / "case").resolve()
        self.finished = place.parent / "finished"  # see `Trial.finish`
        self.log, self.lines = place / "log", place / "lines"  # out of the scope of faults
        self.memory = mmap.mmap(-1, ctypes.sizeof(_Told))
        self.told = _Told.from_buffer(self.memory)
        place.mkdir(parents=True, exist_ok=True)

    def bake(self, call: Call = NONE, list_calls: bool = False) -> Result:
        """Bake in a fresh folder, with a call that fails; or note in `lines` where each call is made."""
        shutil.rmtree(self.folder, ignore_errors=True)
        self.folder.mkdir()
        shutil.copy(self.inputs.photo, self.folder / PHOTO)
        base.copied(self.inputs.bundle, self.folder / OUT)
        if steps := STARTS[call.start]:
            shutil.copytree(self.finished, self.folder, dirs_exist_ok=True)
            for path in self.folder.glob(".bakery-*-work/*"):
                if not path.name.startswith((*steps, "lock")):
                    path.unlink()
        ctypes.memset(ctypes.addressof(self.told), 0, ctypes.sizeof(_Told))
        self.lines.write_bytes(b"")
        end = base.wait(base.fork(self._work(call, list_calls), self.log, self.folder), self.log)
        counts, bundle = dict(zip(KINDS, self.told.counts)), base.content(self.folder / OUT)
        return Result(end, bool(self.told.struck), counts, self._where(), bundle, self._left())

    def _work(self, call: Call, list_calls: bool) -> Callable[[], None]:
        photo, out = str(self.folder / PHOTO), str(self.folder / OUT)
        bake = base.command_line(["build", photo, *base.QUICK, "--overwrite", "-o", out])
        kind = call.kind
        failing = (list(KINDS).index(kind), call.number, KINDS[kind]) if kind else (-1, 0, 0)

        def work() -> None:
            faulthandler.enable()  # says in the log where a signal struck
            lines = self.lines.open("a")
            faulthandler.register(signal.SIGUSR1, file=lines, all_threads=False)
            scope, told = os.fsencode(self.folder), ctypes.addressof(self.told)
            self.arm(*failing, scope, told, lines.fileno() if list_calls else -1)
            bake()

        return work

    def _where(self) -> str:
        path = os.fsdecode(self.told.path).removeprefix(f"{self.folder}/")
        lines = LINE.findall(self.lines.read_text())
        deepest = [f"{Path(file).name}:{number}" for file, number in lines[:1]]
        own = [f"{file[len(OWN) - 7 :]}:{number}" for file, number in lines if file.startswith(OWN)]
        return ", ".join([path] * bool(path) + deepest + own[:3])

    def _left(self) -> list[str]:
        found = {path for path in self.folder.rglob("*") if self.folder / OUT not in path.parents}
        found -= {self.folder / name for name in (PHOTO, OUT, "tmp")}
        return sorted(path.relative_to(self.folder).as_posix() for path in found)


def wrong(result: Result, call: Call, old: str, new: str) -> list[str]:
    """What must not have come of a bake with a failing call."""
    end, found = result.end, []
    if end.code not in (0, 1) and not died(result, call):
        found.append("hangs" if end.said.startswith("hangs\n") else f"ends with {end.code}")
    if TRACE.search(end.said):
        found.append("a traceback")
    if end.code == 1 and not (end.said.splitlines() or [""])[-1].startswith("bakery: "):
        found.append("its last line is no error of bakery's")
    state = {old: "old", new: "new", "": "gone"}.get(result.bundle, "torn")
    if state not in ("old", "new") or (end.code == 0 and state == "old"):
        found.append(f"the bundle is {state}, exit code {end.code}")
    left = [name for name in result.left if end.code == 0 or NEW in name or not WORK.match(name)]
    # What cannot be removed stays; shutil.rmtree opens folders too. A signal leaves what kill -9 leaves.
    if (
        left
        and call.kind != "unlink"
        and "shutil.py" not in result.where
        and not died(result, call)
    ):
        found.append(f"left behind: {', '.join(left[:5])}")
    return found


def died(result: Result, call: Call) -> bool:
    """Whether a library gave up for lack of memory, by SIGSEGV or SIGABRT; nobody can catch that."""
    return call.kind == "malloc" and result.end.code in (-signal.SIGSEGV, -signal.SIGABRT)


def first_of_places(listed: str) -> dict[str, int]:
    """The first large allocation at each place in the code, from what `list_calls` noted.

    A place is a line of a library's Python and the line in bakery that led to it.
    """
    found: dict[str, int] = {}
    for part in re.split(r"^call ", listed, flags=re.MULTILINE):
        if about := re.match(rf"{list(KINDS).index('malloc')} (\d+)\n", part):
            lines = LINE.findall(part)
            own = [line for line in lines if line[0].startswith(OWN)]
            key = repr((*lines[:1], *own[:1]))
            found[key] = min(found.get(key, sys.maxsize), int(about[1]))
    return found


class Trial:
    """All calls of a bake, and what comes of failing them."""

    def __init__(self, inputs: base.Inputs, place: Path) -> None:
        self.inputs, self.place = inputs, place
        self.old = base.content(inputs.bundle)
        whole = Bench(inputs, self.place / "whole").bake()
        if whole.end.code or whole.left:
            raise SystemExit(f"the bake does not run: {whole.end.said} {whole.left}")
        self.new, self.counts, self.seconds = whole.bundle, whole.counts, whole.end.seconds
        self.finished = False

    def finish(self) -> None:
        """Keep the steps that a bake had finished which failed at its end, once for all benches."""
        if self.finished:
            return
        bench = Bench(self.inputs, self.place / "whole")
        shutil.rmtree(bench.finished, ignore_errors=True)
        # For some of the last renames a bake has another way.
        for number in range(self.counts["rename"], 0, -1):
            if bench.bake(Call("rename", number)).end.code == 1:
                for path in bench.folder.glob(".bakery-*-work"):
                    shutil.copytree(path, bench.finished / path.name)
                self.finished = True
                return

    def calls(self, kinds: Sequence[str], part: int = 0, parts: int = 1) -> list[Call]:
        """What is to fail: every file call, and a large allocation of each place in the code.

        Args:
            part: of so many parts. A case has its part by its name: their number differs from run to run.
        """
        named = {
            f"{kind} {n}": Call(kind, n)
            for kind in kinds
            if kind != "malloc"
            for n in range(1, self.counts[kind] + 1)
        }
        if "malloc" in kinds:
            self.finish()
            for start, places in zip(STARTS, base.side_by_side(self._places, len(STARTS))):
                named = {place: Call("malloc", n, start) for place, n in places.items()} | named
        calls = [call for name, call in named.items() if zlib.crc32(name.encode()) % parts == part]
        return sorted(calls, key=lambda call: (list(KINDS).index(call.kind), call[1:]))

    def _places(self, number: int) -> dict[str, int]:
        """The first large allocation at each place, from one of STARTS on."""
        bench = Bench(self.inputs, self.place / f"listed-{number}")
        bench.bake(NONE._replace(start=list(STARTS)[number]), list_calls=True)
        return first_of_places(bench.lines.read_text("utf-8", "replace"))

    def row(
        self,
        name: str,
        calls: Sequence[Call],
        lanes: int,
        seconds: float | None = None,
        tell: bool = False,
    ) -> base.Row:
        """Try calls, side by side."""
        began = time.monotonic()
        if any(STARTS[call.start] for call in calls):
            self.finish()
        shared = mmap.mmap(-1, 8 * lanes)  # by the lanes
        tried = (LONG * lanes).from_buffer(shared)
        deaths = (LONG * lanes).from_buffer(mmap.mmap(-1, 8 * lanes))

        def lane(number: int) -> base.Row:
            row = base.Row(name, MUST[name])
            bench = Bench(self.inputs, self.place / f"lane-{number}")
            for call in calls[number::lanes]:
                if seconds is not None and time.monotonic() - began > seconds:
                    break
                tried[number] += 1
                result = bench.bake(call)
                if not result.struck:
                    continue
                row.cases += 1
                deaths[number] += died(result, call)
                found = wrong(result, call, self.old, self.new)
                text = f"{call}: {'; '.join(found)} ({result.where})"
                if found:
                    row.fail(text)
                if tell:
                    last = (result.end.said.splitlines() or [""])[-1]
                    print(
                        f"{result.end.seconds:.1f} s, {result.end.code}: {text} {last}", flush=True
                    )
            row.seconds = time.monotonic() - began
            return row

        row = base.in_lanes(lane, lanes)
        missed = sum(tried) - row.cases
        row.counts = {
            "tried": sum(tried),
            "calls": len(calls),
            "missed": missed,
            "died": sum(deaths),
        }
        row.note = "{tried} of {calls} tried, {missed} of them not reached"
        if name == MEMORY:
            row.note += "; {died} ended by a signal in a library that got no memory"
        return row


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--count", action="store_true", help="say how many calls there are")
    parser.add_argument("--of", type=int, metavar="N", help="try N of each kind, spread")
    parser.add_argument("--only", nargs="+", metavar="KIND", help="try kinds, or KIND NUMBER ...")
    parser.add_argument("--start", choices=STARTS, default=FRESH, help="what NUMBER is counted in")
    parser.add_argument("--place", type=Path, help="a folder to work in, kept")
    parser.add_argument("--row", type=Path, help=argparse.SUPPRESS)  # what `run` asks for
    asked = parser.parse_args()
    if "LD_PRELOAD" not in os.environ:
        with tempfile.TemporaryDirectory() as folder:
            place = (asked.place or Path(folder)).resolve()
            again(build(place), [*sys.argv[1:], "--place", place])
        return
    base.load()
    if asked.row:
        name, inputs, place, lanes, seconds, part = pickle.loads(asked.row.read_bytes())
        trial = Trial(inputs, place)
        kinds = [kind for kind in KINDS if (kind == "malloc") == (name == MEMORY)]
        calls = trial.calls(kinds, *part)
        random.Random(0).shuffle(calls)
        asked.row.write_bytes(pickle.dumps(trial.row(name, calls, lanes, seconds)))
        return
    trial = Trial(base.Inputs(asked.place / "inputs").make(), asked.place)
    words = asked.only or list(KINDS)
    kinds = [word for word in words if word in KINDS]
    calls = [Call(kinds[0], int(word), asked.start) for word in words if word not in KINDS]
    calls = calls or trial.calls(kinds)
    if asked.count:
        places = sum(call.kind == "malloc" for call in calls)
        print(f"one bake, {trial.seconds:.1f} s: {trial.counts}; malloc in {places} places")
        return
    if asked.of:
        some = [[call for call in calls if call.kind == kind] for kind in kinds]
        calls = [call for each in some for call in each[:: max(1, -(-len(each) // asked.of))]]
    row = trial.row(CALLS, calls, 1, tell=True)
    print(f"{row.cases} cases in {row.seconds:.0f} s, {len(row.failures)} failures; {row.said()}")


if __name__ == "__main__":
    main()
