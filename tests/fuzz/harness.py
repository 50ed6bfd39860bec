"""Runs cases in worker processes; a crash, a hang and a memory bomb are noticed from outside.

A worker is a fork of a process that has everything imported, so that the next one starts at once. It
says in shared memory which case it is at; what it finds goes into a pipe.
"""

import mmap
import os
import pickle
import re
import resource
import select
import signal
import struct
import sys
import tempfile
import time
import traceback
import warnings
from collections import Counter
from pathlib import Path

import bakery
from bakery.errors import BakeryError

HANG = 20.0  # seconds of wall time; the slowest good case takes 0.5 s on an idle machine
MEMORY = 1 << 30  # bytes that a case may take
BATCH = 250  # cases of a worker before it is made anew
LONGEST = 1000  # characters of a message
BROKEN = 86  # exit code of a worker in which not the reader failed but what is around it
PACKAGE = str(Path(bakery.__file__).parent)
STATE = struct.Struct("qd")  # number of the case, when it began


class Report:
    """What came of the cases of a kind."""

    def __init__(self, kind):
        self.kind, self.counts, self.failures = kind, Counter(), {}
        self.seconds, self.slowest = 0.0, (0.0, 0)  # of processor time in all; of a case, and which
        self.prints = Counter()  # what libraries say on stderr by themselves

    def add(self, what, number, seconds, said="", name=None, data=None, detail=""):
        """Count an outcome; of a failure the first case is kept."""
        self.counts[what] += 1
        if said:
            self.prints[re.sub(r"\d+", "0", said.splitlines()[0])[:80]] += 1
        self.slowest = max(self.slowest, (seconds, number))
        if what not in ("accepted", "refused"):
            kept = self.failures.setdefault(what, {"count": 0, "number": number})
            kept["count"] += 1
            if number <= kept["number"]:
                kept |= {"number": number, "name": name, "data": data, "detail": detail}

    def table(self):
        """For people and tests: without the bytes."""
        failures = {
            what: {key: value for key, value in kept.items() if key != "data"}
            for what, kept in sorted(self.failures.items())
        }
        return {
            "counts": dict(self.counts),
            "seconds": round(self.seconds, 1),
            "slowest": self.slowest,
            "prints": dict(self.prints),
            "failures": failures,
        }


def signature(error):
    """What went wrong and where in the project: the same for the same mistake."""
    frames = traceback.extract_tb(error.__traceback__)
    own = [f for f in frames if f.filename.startswith(PACKAGE)] or frames
    where = f"{Path(own[-1].filename).name}:{own[-1].name}"
    return f"{type(error).__name__} in {where}"


def outcome(kind, path, memory):
    """Read one file; returns what came of it, and details of a failure."""
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    result, detail = "accepted", ""
    try:
        found = kind.read(path)
        if isinstance(found, list) and found:  # of what is wrong with it
            result = "refused"
    except BakeryError as error:
        result, text = "refused", str(error)
        if "\n" in text.replace(str(path), "") or not 0 < len(text) <= LONGEST:
            result, detail = "an error that is no short line", text[:LONGEST]
    except BaseException as error:
        if isinstance(error, (KeyboardInterrupt, SystemExit)):
            raise
        result, detail = signature(error), traceback.format_exc()
    grown = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) * 1024
    if grown > memory:
        return "memory", f"{grown >> 20} MiB"
    return result, detail


def work(kind, numbers, state, send, memory):
    """The life of a worker: the outcome of each case into `send`."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    for category in (RuntimeWarning, UserWarning):
        warnings.simplefilter("always", category)
    folder = Path(tempfile.mkdtemp(prefix="worker-", dir=os.environ["FUZZ_FOLDER"]))
    noise = os.open(folder / "noise", os.O_RDWR | os.O_CREAT | os.O_APPEND)
    os.dup2(noise, 1)
    os.dup2(noise, 2)
    size = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (size + 2 * memory, resource.RLIM_INFINITY))
    for number in numbers:
        state[: STATE.size] = STATE.pack(number, time.monotonic())
        name, data = kind.case(number)
        path = folder / name
        path.write_bytes(data)
        began = time.monotonic()
        result, detail = outcome(kind, path, memory)
        taken, said = time.monotonic() - began, ""
        if os.fstat(noise).st_size:
            said = os.pread(noise, LONGEST, 0).decode("utf-8", "replace")
            os.ftruncate(noise, 0)
        good = result in ("accepted", "refused")
        case = (None, None) if good else (name, data)
        message = pickle.dumps((result, number, taken, said, *case, detail))
        os.write(send, struct.pack("I", len(message)))
        while message:
            message = message[os.write(send, message) :]
        path.unlink(missing_ok=True)


class Worker:
    """A forked process, as its parent sees it."""

    def __init__(self, kind, numbers, memory):
        self.kind, self.numbers = kind, numbers
        self.state = mmap.mmap(-1, STATE.size)
        self.state[: STATE.size] = STATE.pack(numbers[0], time.monotonic())
        self.receive, send = os.pipe()
        self.buffer = b""
        sys.stdout.flush()
        self.pid = os.fork()
        if self.pid == 0:
            code, stderr = BROKEN, os.dup(2)
            try:
                os.close(self.receive)
                work(kind, numbers, self.state, send, memory)
                code = 0
            except BaseException:
                os.write(stderr, traceback.format_exc().encode())
            finally:
                os._exit(code)
        os.close(send)

    def messages(self):
        """Outcomes that came; None at the end is for a worker that is gone."""
        data = os.read(self.receive, 1 << 16)
        self.buffer += data
        while len(self.buffer) >= 4:
            size = struct.unpack("I", self.buffer[:4])[0]
            if len(self.buffer) < 4 + size:
                break
            yield pickle.loads(self.buffer[4 : 4 + size])
            self.buffer = self.buffer[4 + size :]
        if not data:
            yield None

    def at(self):
        """The case it is at, and for how many seconds."""
        number, since = STATE.unpack(self.state[: STATE.size])
        return number, time.monotonic() - since


def run(kinds, count, jobs, first=0, hang=HANG, memory=MEMORY):
    """Run cases `first` to `first + count` of each kind (fewer of slow ones).

    Returns:
        {name: Report}.
    """
    reports = {kind.name: Report(kind.name) for kind in kinds}
    waiting = [
        (kind, range(start, min(start + BATCH, first + end)))
        for kind in kinds
        for end in [max(int(count * kind.share), 1)]
        for start in range(first, first + end, BATCH)
    ]
    running = {}
    try:
        while waiting or running:
            while waiting and len(running) < jobs:
                worker = Worker(*waiting.pop(0), memory)
                running[worker.receive] = worker
            for ready in select.select(list(running), [], [], 0.2)[0]:
                worker = running[ready]
                for message in worker.messages():
                    if message is None:
                        waiting[:0] = _ended(worker, reports[worker.kind.name])
                        del running[ready]
                    else:
                        reports[worker.kind.name].add(*message)
            for worker in running.values():
                if worker.at()[1] > hang:
                    os.kill(worker.pid, signal.SIGKILL)
    finally:
        for worker in running.values():
            os.kill(worker.pid, signal.SIGKILL)
            os.waitpid(worker.pid, 0)
    return reports


def _ended(worker, report):
    """Take leave of a worker; what is left of its cases, if it did not come to their end."""
    _, status, used = os.wait4(worker.pid, 0)
    os.close(worker.receive)
    report.seconds += used.ru_utime + used.ru_stime
    if status == 0:
        return []
    if os.waitstatus_to_exitcode(status) == BROKEN:
        raise RuntimeError(f"the harness itself failed at case {worker.at()[0]} of {report.kind}")
    number, seconds = worker.at()
    name, data = worker.kind.case(number)
    killed = os.WIFSIGNALED(status) and os.WTERMSIG(status) == signal.SIGKILL
    what = "hang" if killed and seconds > 1 else "crash"
    report.add(what, number, seconds, "", name, data, f"wait status {status} after {seconds:.1f} s")
    left = range(number + 1, worker.numbers.stop)
    return [(worker.kind, left)] if left else []
