"""What all rows of the campaign share: the commands under test, their inputs, and how one of them is run."""

import hashlib
import importlib
import os
import pickle
import pkgutil
import shutil
import signal
import sys
import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeVar

Made = TypeVar("Made")
ROOT = Path(__file__).resolve().parents[2]
HANG = 300.0  # seconds after which a command is said to hang; the slowest takes 20
QUICK = [
    "--preset", "small", "--set", "texture.mouths=2", "--set", "texture.views=[0.0]",
    "--expressions", str(ROOT / "tests" / "few.toml"), "--generator", "rendered",
]  # fmt: skip
OTHER = ["--set", "texture.complete=none"]  # another bundle of the same photo
FRAMES = 4  # of the clip
SMALLER = 0.4  # times the sample that the photo is


@dataclass
class Row:
    """What came of one row of the table in docs/reliability.md."""

    name: str
    must: str
    cases: int = 0
    failures: list[str] = field(default_factory=list)
    seconds: float = 0.0
    note: str = ""  # with {names} of counts
    counts: dict[str, int] = field(default_factory=dict)
    measured: list[str] = field(default_factory=list)  # when and at which commit, each once

    def said(self) -> str:
        """The note with its counts."""
        return self.note.format(**self.counts) if self.counts else self.note

    def add(self, other: "Row") -> None:
        """Another part of the row."""
        self.cases += other.cases
        self.failures += other.failures
        self.seconds += other.seconds
        self.note = other.note
        self.counts = {name: self.counts.get(name, 0) + n for name, n in other.counts.items()}
        self.measured += [text for text in other.measured if text not in self.measured]

    def fail(self, text: str) -> None:
        """Note what broke; said at once, since a row may take hours."""
        self.failures.append(text)
        print(f"{self.name}: {text}", flush=True)


@dataclass(frozen=True)
class Command:
    """A command that writes one thing.

    Attributes:
        name: for the report.
        arguments: with "{out}" for what it writes.
        out: name of that in its folder.
        old: a file or folder that may lie there before, and is replaced.
    """

    name: str
    arguments: tuple[str, ...]
    out: str
    old: Path

    def line(self, folder: Path) -> list[str]:
        out = str(folder / self.out)
        return [part.replace("{out}", out) for part in self.arguments]


@dataclass(frozen=True)
class Ended:
    """How a process ended."""

    code: int | None  # None: it was killed
    said: str
    seconds: float


def load() -> None:
    """Import the whole package, so that a fork begins at once: nothing is written while importing."""
    import torch

    torch.set_num_threads(1)
    import bakery

    skipped = ("bakery.train", "bakery.evaluate", "bakery.__main__")
    for module in pkgutil.walk_packages(bakery.__path__, "bakery."):
        if not module.name.startswith(skipped):
            try:
                importlib.import_module(module.name)
            except ImportError:
                pass  # of an extra


def fork(
    work: Callable[[], None], log: Path, folder: Path, env: dict[str, str] | None = None
) -> int:
    """Call `work` in a process group of its own; its exit code is that of `SystemExit`, or 1.

    Args:
        log: takes what it prints.
        folder: its current one; its temporary files go to folder/tmp, which is made.
        env: set in its environment.
    """
    (folder / "tmp").mkdir(parents=True, exist_ok=True)
    sys.stdout.flush()
    pid = os.fork()
    if pid:
        return pid
    code = 70
    try:
        os.setsid()
        target = os.open(log, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
        os.dup2(target, 1)
        os.dup2(target, 2)
        os.chdir(folder)
        import tempfile

        tempfile.tempdir = None
        os.environ |= {"TMPDIR": str(folder / "tmp")} | (env or {})
        time.tzset()
        try:
            work()
            code = 0
        except SystemExit as end:
            code = end.code if isinstance(end.code, int) else int(end.code is not None)
        except BaseException:
            traceback.print_exc()
            code = 1
        sys.stdout.flush()
        sys.stderr.flush()
    finally:
        os._exit(code)


def command_line(arguments: list[str]) -> Callable[[], None]:
    """What `bakery ARGUMENTS` does once everything is imported."""

    def work() -> None:
        from bakery.cli.main import main

        main(arguments)

    return work


def wait(pid: int, log: Path, most: float = HANG, kill_after: float | None = None) -> Ended:
    """Wait for a process; its whole group is killed after `kill_after` seconds, or as a hang."""
    began = time.monotonic()
    end = began + (most if kill_after is None else kill_after)
    while True:
        done, status = os.waitpid(pid, os.WNOHANG)
        now = time.monotonic()
        if done:
            code = os.waitstatus_to_exitcode(status)
            end_group(pid)
            return Ended(code, said(log), now - began)
        if now >= end:
            end_group(pid)
            os.waitpid(pid, 0)
            text = said(log) if kill_after is not None else f"hangs\n{said(log)}"
            return Ended(None, text, now - began)
        time.sleep(0.002)


def end_group(pid: int) -> None:
    """kill -9 of a process and all that it started."""
    try:
        os.killpg(pid, signal.SIGKILL)
    except ProcessLookupError:
        pass


def said(log: Path) -> str:
    return log.read_text("utf-8", "replace") if log.exists() else ""


def run(arguments: list[str], folder: Path, env: dict[str, str] | None = None) -> Ended:
    """Run a command to its end."""
    folder.mkdir(parents=True, exist_ok=True)
    log = folder / "log"
    return wait(fork(command_line(arguments), log, folder, env), log)


def content(path: Path) -> str:
    """SHA-256 of a file, or of the names and bytes in a folder; "" if nothing is there."""
    if not path.exists():
        return ""
    found = hashlib.sha256()
    for each in sorted(path.rglob("*")) if path.is_dir() else [path]:
        if each.is_file():
            name = each.relative_to(path).as_posix() if path.is_dir() else ""
            found.update(f"{name}\0{each.stat().st_size}\0".encode() + each.read_bytes())
    return found.hexdigest()


def undisturbed(command: Command, folder: Path) -> tuple[str, float]:
    """What a command writes into a folder when nothing disturbs it, as `content`, and its seconds."""
    end = run(command.line(folder), folder)
    if end.code:
        raise SystemExit(f"{command.name} does not run: {end.said}")
    return content(folder / command.out), end.seconds


def left_in(folder: Path, command: Command) -> list[str]:
    """What lies in a command's folder, and among its temporary files, besides what it writes."""
    left = {path.name for path in folder.iterdir()} - {command.out, "log", "tmp", "lost+found"}
    left |= {f"tmp/{path.name}" for path in (folder / "tmp").iterdir()}
    return sorted(left)


def copied(source: Path, target: Path) -> None:
    (shutil.copytree if source.is_dir() else shutil.copy)(source, target)


@dataclass(frozen=True)
class Inputs:
    """What the commands read, made once in `folder`."""

    folder: Path

    @property
    def photo(self) -> Path:
        return self.folder / "anna.jpg"

    @property
    def bundle(self) -> Path:
        return self.folder / "other.avatar"

    @property
    def take(self) -> Path:
        return self.folder / "take.csv"

    @property
    def clip(self) -> Path:
        return self.folder / "clip"

    def make(self) -> "Inputs":
        """Make them by bakery itself; what is there stays."""
        from bakery.formats.image import read_photo, write_image

        self.folder.mkdir(parents=True, exist_ok=True)
        if not self.clip.exists():
            import cv2

            sample = read_photo(ROOT / "samples" / "anna.jpg").encoded
            area = cv2.INTER_AREA
            small = cv2.resize(sample, None, fx=SMALLER, fy=SMALLER, interpolation=area)
            write_image(self.photo, small)
            half = self.folder / "half"
            half.mkdir(exist_ok=True)
            for number in range(FRAMES):
                moved = cv2.warpAffine(small, _moved(number), small.shape[1::-1])
                write_image(half / f"{number:04d}.png", moved)
            half.rename(self.clip)
        for out, line in (
            (self.bundle, ["build", str(self.photo), *QUICK, *OTHER, "-o"]),
            (self.take, ["track", str(self.clip), "--rate", "25", "-o"]),
        ):
            if not out.exists():
                end = run([*line, str(out)], self.folder / "made")
                if end.code:
                    raise SystemExit(f"{out.name} cannot be made: {end.said}")
        return self

    def commands(self) -> list[Command]:
        """Those that the rows put under stress."""
        photo, bundle, take, clip = map(str, (self.photo, self.bundle, self.take, self.clip))
        to = ("--overwrite", "-o", "{out}")
        film = ("--size", "64", *to)
        farm = (
            "-o",
            str(self.folder / "avatars"),
            "--format",
            "make",
            "--overwrite",
            "--to",
            "{out}",
        )
        # What lies in a film's place may be any file: it is replaced as one.
        return [
            Command("build", ("build", photo, *QUICK, *to), "a.avatar", self.bundle),
            Command("track", ("track", clip, "--rate", "25", *to), "t.csv", self.take),
            Command("animate", ("animate", bundle, "--curves", take, *film), "f.webm", self.take),
            Command(
                "perform", ("perform", bundle, clip, "--rate", "25", *film), "p.webm", self.take
            ),
            Command("farm", ("farm", photo, *farm), "jobs.mk", self.take),
        ]


def _moved(number):
    import numpy as np

    return np.float32([[1, 0, number], [0, 1, 0]])


def in_lanes(work: Callable[[int], Row], lanes: int) -> Row:
    """Rows of `work(lane)`, each in a process of its own, as one."""
    out, *rows = side_by_side(work, lanes)
    for row in rows:
        out.cases += row.cases
        out.failures += row.failures
        out.seconds = max(out.seconds, row.seconds)
        out.note = out.note or row.note
    return out


def side_by_side(work: Callable[[int], Made], lanes: int) -> list[Made]:
    """What `work(lane)` gives, each in a process of its own."""
    pipes = []
    for lane in range(lanes):
        receive, send = os.pipe()
        sys.stdout.flush()
        if not (pid := os.fork()):
            code = 1
            try:
                os.close(receive)
                with os.fdopen(send, "wb") as pipe:
                    pickle.dump(work(lane), pipe)
                code = 0
            except BaseException:
                traceback.print_exc()
            finally:
                os._exit(code)
        os.close(send)
        pipes.append((pid, receive))
    made = []
    for pid, receive in pipes:
        with os.fdopen(receive, "rb") as pipe:
            data = pipe.read()
        if os.waitpid(pid, 0)[1]:
            raise RuntimeError("a lane of the campaign itself failed")
        made.append(pickle.loads(data))
    return made
