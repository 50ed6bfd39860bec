"""Folders of painted portraits with their truth: shards that several processes paint."""

import multiprocessing
import os
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from bakery.errors import InputError
from bakery.synth.portraits import PortraitOptions, random_portraits

NAME = "portraits-{:05d}.npz"
PEOPLE = 8  # of a shard
ARRAYS = ("image", "alpha", "label", "shadow", "points")


def write(
    head: str, folder: Path, count: int, seed: int = 0, workers: int = 1, options=None
) -> Iterator[Path]:
    """Paint portraits into a folder; one that was interrupted goes on.

    Args:
        head: name or file of the head model.
        folder: made if missing.
        count: pictures the folder shall hold at least; whole shards are painted.
        seed: person k depends on (seed, k) alone.
        workers: processes.
        options: PortraitOptions; None for the usual ones.

    Yields:
        Path of each shard once it is written, in any order.

    Raises:
        InputError: `count` or `workers` is below 1.
    """
    if min(count, workers) < 1:
        raise InputError(
            f"asked for {count} pictures by {workers} processes; needs at least 1 each"
        )
    options = options or PortraitOptions()
    folder.mkdir(parents=True, exist_ok=True)
    shards = -(-count // (PEOPLE * options.scenes))
    paths = [folder / NAME.format(number) for number in range(shards)]
    todo = [(head, path, n, seed, options) for n, path in enumerate(paths) if not path.exists()]
    if workers == 1:
        yield from map(_shard, todo)
        return
    with multiprocessing.get_context("spawn").Pool(workers, _quiet) as pool:
        yield from pool.imap_unordered(_shard, todo)


def _quiet():
    """One thread a process."""
    import cv2

    cv2.setNumThreads(1)


def _shard(task):
    from bakery.heads.file import load_head

    head, path, number, seed, options = task
    model = load_head(head)
    pictures = [
        picture
        for k in range(number * PEOPLE, (number + 1) * PEOPLE)
        for picture in random_portraits(model, (seed, k), options)
    ]
    table = {name: np.stack([getattr(one, name) for one in pictures]) for name in ARRAYS}
    aside = path.with_suffix(".tmp.npz")
    np.savez(aside, **table)
    os.replace(aside, path)
    return path


def read(
    folder: Path, limit: int | None = None, seen: set[Path] | None = None
) -> dict[str, np.ndarray]:
    """All pictures of a folder as arrays {name: [N, ...]}, see `portraits.Labelled`.

    Args:
        limit: how many pictures to read at most.
        seen: shards to leave out; those that are read are added.

    Raises:
        InputError: the folder holds none (or no new ones).
    """
    parts, total = [], 0
    seen = set() if seen is None else seen
    for path in sorted(set(Path(folder).glob(NAME.replace("{:05d}", "?????"))) - seen):
        seen.add(path)
        with np.load(path) as table:
            parts.append({name: table[name] for name in ARRAYS})
        total += len(parts[-1]["image"])
        if limit is not None and total >= limit:
            break
    if not parts:
        raise InputError(f"{folder}: holds no painted portraits; paint some by `synth portraits`")
    return {name: np.concatenate([part[name] for part in parts])[:limit] for name in ARRAYS}
