"""Power cuts: a copy of the disk at a random moment of a bake, mounted, holds the whole old bundle or the new one.

The disk is an ext4 file system in a file on XFS, where a copy of a file that is being written to is made in one
step (`cp --reflink`). What the kernel had not yet brought onto the disk is lost in the copy, as at a power
cut; what the disk had taken is kept. Needs root, mkfs.xfs and mkfs.ext4.
"""

import contextlib
import os
import random
import shutil
import subprocess
import time
from pathlib import Path

import base

MUST = "200 cuts: the old or the new bundle whole"
OUTER, INNER = 600, 192  # MiB of the two file systems
MAKE_OUTER = "mkfs.xfs -q -f -m reflink=1"
# How ext4 may hold data back: by itself, without its care for renamed files, unordered, and longer.
WAYS = ("", "noauto_da_alloc", "data=writeback,noauto_da_alloc", "commit=30", "nodelalloc,commit=1")
GOES_ON = 10  # of so many cuts one is followed by the next run


def run(inputs: base.Inputs, place: Path, count: int) -> base.Row:
    """Copy the disk `count` times while bundles are baked on it."""
    row = base.Row("power cut", MUST)
    if lacks := _lacking(place):
        row.note = f"not run: needs {lacks}"
        return row
    command = inputs.commands()[0]
    whole = place / "whole"
    new, seconds = base.undisturbed(command, whole)
    good = {base.content(command.old): "old", new: "new"}
    rng, number = random.Random(0), 0
    with _disk(place, "outer", OUTER, MAKE_OUTER, "") as outer:
        while row.cases < count:
            way = WAYS[number % len(WAYS)]
            _bake(row, command, outer, way, good, seconds, rng, count)
            number += 1
    return row


def _lacking(place):
    """What of root, programs and the right to mount a file is not there; "" if all is."""
    lacking = [name for name in ("mkfs.xfs", "mkfs.ext4", "mount", "cp") if not shutil.which(name)]
    if lacking or os.getuid():
        return ", ".join(lacking or ["root"])
    place.mkdir(parents=True, exist_ok=True)
    try:
        with _disk(place, "trial", OUTER, MAKE_OUTER, ""):
            return ""
    except (subprocess.CalledProcessError, OSError):
        return "a kernel that mounts XFS from a file"


def _bake(row, command, outer, way, good, seconds, rng, count):
    """One bake on a fresh disk, which is copied at random moments until it ends."""
    image = outer / "disk"
    with _disk(outer, "disk", INNER, "mkfs.ext4 -q -F", way) as folder:
        base.copied(command.old, folder / command.out)
        subprocess.run(["sync", "-f", str(folder)], check=True)
        began, busy = time.monotonic(), True
        (outer / "log").unlink(missing_ok=True)
        pid = base.fork(base.command_line(command.line(folder)), outer / "log", folder)
        while busy and row.cases < count:
            # Most is written at the end, and it goes on being written after that.
            left = seconds - (time.monotonic() - began)
            time.sleep(rng.uniform(0, left / 4) if left > 1 else rng.uniform(0, 0.1))
            busy = not os.waitpid(pid, os.WNOHANG)[0]
            subprocess.run(["cp", "--reflink=always", image, outer / "cut"], check=True)
            row.cases += 1
            when = f"{way or 'defaults'}, {time.monotonic() - began:.2f} s of {seconds:.2f}"
            found = _look(row, command, outer, good, when, row.cases % GOES_ON == 0)
            if not busy and found == "old":
                row.fail(f"lost though the command had ended: {when}")
        if busy:
            base.end_group(pid)
            os.waitpid(pid, 0)


def _look(row, command, outer, good, when, goes_on):
    """Mount a copy: which bundle it holds; and run the command on it, if it is to go on."""
    with _mounted(outer / "cut", "") as folder:
        found = good.get(base.content(folder / command.out))
        if found is None:
            row.fail(f"torn: {when}")
        if not goes_on:
            return found
        end = base.run(command.line(folder), folder)
        if end.code or good.get(base.content(folder / command.out)) != "new":
            row.fail(f"the next run gives {end.code}: {when}: {end.said[-300:]}")
        if left := base.left_in(folder, command):
            row.fail(f"left behind: {', '.join(left)}: {when}")
        return found


@contextlib.contextmanager
def _disk(folder, name, mebibytes, make, options):
    """A new file system in a file of a folder, mounted."""
    image = folder / name
    with open(image, "wb") as file:
        file.truncate(mebibytes << 20)
    subprocess.run([*make.split(), str(image)], check=True, stdout=subprocess.DEVNULL)
    with _mounted(image, options) as mounted:
        yield mounted
    image.unlink()


@contextlib.contextmanager
def _mounted(image, options):
    """A file system in a file, mounted beside it."""
    mounted = image.with_name(f"{image.name}-mounted")
    mounted.mkdir(exist_ok=True)
    how = ",".join(filter(None, ("loop", options)))
    subprocess.run(["mount", "-o", how, str(image), str(mounted)], check=True)
    try:
        yield mounted
    finally:
        subprocess.run(["umount", str(mounted)], check=True)
