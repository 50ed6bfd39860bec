"""One photo baked again and again, each time by another user, elsewhere, at another time: the same bytes.

Every other bake is a process of its own, since the order of sets, threads and locales are settled while
Python begins; the others are forks, and so can be another user. One in five bakes copies side by side.
"""

import contextlib
import encodings
import importlib
import os
import pkgutil
import random
import shutil
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import base

MUST = "50 bakes of one photo under other circumstances: 1 hash"
NOBODY = 65534
ZONES = ("UTC", "Asia/Kathmandu", "America/St_Johns", "Pacific/Kiritimati", "XYZ-14:37", "")
LOCALES = ("C", "C.UTF-8", "POSIX")  # always there
COPIES = 2  # of the photo in a batch


@dataclass(frozen=True)
class Case:
    """Circumstances of one bake."""

    process: bool  # of its own, else a fork
    user: int  # numeric id; 0 is the one of the campaign
    jobs: int  # side by side, of COPIES photos; 0: one photo
    folder: str  # the current one
    photo: str  # its name
    out: str  # the name of the bundle
    relative: bool  # whether paths are
    umask: int
    cores: int  # that it may use
    taken: float  # times of the photo's file
    env: dict[str, str]

    def __str__(self) -> str:
        how = "process" if self.process else "fork"
        how += f", user {self.user}, jobs {self.jobs}, {self.cores} cores"
        env = " ".join(f"{name}={value}" for name, value in self.env.items())
        return f"{how}, umask {self.umask:o}, {self.folder[:20]}/{self.photo[:20]} -> {self.out[:20]}, {env}"


def run(inputs: base.Inputs, place: Path, count: int, seed: int = 3) -> base.Row:
    """Bake a photo `count` times.

    Args:
        place: a folder to work in.
    """
    row, rng = base.Row("rebuilds", MUST), random.Random(seed)
    place.chmod(place.stat().st_mode | 0o011)  # another user has to get to what lies in it
    place = place / "rebuilds"
    place.mkdir()
    locales, other = _locales(), _may_be_another(inputs.photo, place)
    hashes: dict[str, list[str]] = {}
    users = bundles = 0
    for number in range(count):
        case = _case(rng, number, locales, other)
        folder = place / f"{number:02d}" / case.folder
        end, outs = _bake(case, inputs.photo, folder)
        row.cases += 1
        users += case.user > 0
        if end.code:
            row.fail(f"bake {number} ({case}): exit code {end.code}: {end.said[-300:]}")
        else:
            for out in outs:
                hashes.setdefault(base.content(out), []).append(f"bake {number} ({case})")
                bundles += 1
        if len(hashes) < 2:  # else there is something to look at
            shutil.rmtree(place / f"{number:02d}")
    for found, cases in sorted(hashes.items(), key=lambda each: -len(each[1]))[1:]:
        row.fail(f"{len(cases)} bundles have another hash {found[:12]}, as {cases[0]}")
    row.note = f"{bundles} bundles, {users} bakes by another user" + (
        "" if other else ": not possible here"
    )
    return row


def _case(rng: random.Random, number: int, locales: list[str], other: bool) -> Case:
    process = number % 2 == 0
    jobs = rng.choice((1, 2)) if number % 5 == 3 else 0
    name, odd = rng.choice(locales), rng.choice(("a", "photo of Ada", "фото é", "x" * 120))
    env = {
        "TZ": rng.choice(ZONES), "LANG": name, "LC_ALL": rng.choice((name, rng.choice(locales))),
        "OMP_NUM_THREADS": str(rng.randint(1, 4)), "NUMBA_NUM_THREADS": str(rng.randint(1, 4)),
        "COLUMNS": str(rng.choice((20, 80, 300))), "HOME": "/nowhere",
        "OPENBLAS_NUM_THREADS": str(rng.randint(1, 4)),
    }  # fmt: skip
    if not process:  # as `bakery.__main__` does first of all; a fork has begun already
        env["OPENBLAS_NUM_THREADS"] = "1"
    else:
        env["PYTHONHASHSEED"] = rng.choice(("0", "random", str(rng.randrange(2**32))))
    return Case(
        process=process,
        # Two at once are processes of their own, and Python may lie where root alone reads it.
        user=NOBODY if other and not process and jobs < 2 and rng.random() < 0.5 else 0,
        jobs=jobs,
        folder=rng.choice(("b", "some folder", "ü", "deep/" * 30 + "e")),
        photo=odd,
        out="o" * rng.choice((1, 17, 100, 200)),
        relative=rng.random() < 0.5,
        umask=rng.choice((0o000, 0o022, 0o027, 0o077)),
        cores=rng.randint(1, os.cpu_count() or 1),
        taken=rng.choice((0.0, 1e9, time.time(), 4e9)),
        env=env,
    )


def _bake(case: Case, source: Path, folder: Path) -> tuple[base.Ended, list[Path]]:
    """How the bake of a case ended, and the bundles that it wrote."""
    folder.mkdir(parents=True)
    photos = [folder / f"{case.photo}{k}.jpg" for k in range(COPIES if case.jobs else 1)]
    for photo in photos:
        shutil.copyfile(source, photo)
        os.utime(photo, (case.taken, case.taken))
    out = folder / "made" / case.out
    words = [
        "build",
        *map(str, photos),
        *base.QUICK,
        "-o",
        f"{out}/" if case.jobs else f"{out}.avatar",
    ]
    if case.jobs:
        words += ["--jobs", str(case.jobs)]
    if case.relative:
        words = [word.replace(f"{folder}/", "") for word in words]
    if case.user:
        for path in (folder, *photos):
            os.chown(path, case.user, case.user)

    def work() -> None:
        os.umask(case.umask)
        os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[: case.cores])
        if case.user:
            os.setgroups([])
            os.setgid(case.user)
            os.setuid(case.user)
        if case.process:
            sys.stdout.flush()
            os.execv(sys.executable, [sys.executable, "-m", "bakery", *words])
        base.command_line(words)()

    if case.user:
        (folder / "tmp").mkdir()
        os.chown(folder / "tmp", case.user, case.user)
    log = folder / "log"
    end = base.wait(base.fork(work, log, folder, case.env), log)
    outs = (
        [out / f"{photo.stem}.avatar" for photo in photos] if case.jobs else [Path(f"{out}.avatar")]
    )
    return end, outs


def _locales() -> list[str]:
    """Those that this system has."""
    try:
        said = subprocess.run(["locale", "-a"], capture_output=True, text=True).stdout.split()
    except OSError:
        said = []
    return list(dict.fromkeys([*LOCALES, *said]))


def _may_be_another(photo: Path, place: Path) -> bool:
    """Whether we are root, and another user reaches what a bake reads."""
    if os.getuid():
        return False
    for module in pkgutil.iter_modules(
        encodings.__path__
    ):  # read late, and Python may lie where root alone is
        with contextlib.suppress(ImportError):
            importlib.import_module(f"encodings.{module.name}")
    assets = [path for path in (base.ROOT / "bakery" / "assets").rglob("*") if path.is_file()]

    def work() -> None:
        os.setgid(NOBODY)
        os.setuid(NOBODY)
        for path in (photo, base.ROOT / "tests" / "few.toml", *assets):
            with path.open("rb") as file:
                file.read(1)
        os.listdir(place)

    log = place / "probe.log"
    return base.wait(base.fork(work, log, place / "probe"), log).code == 0
