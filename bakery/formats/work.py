"""The work folder of a bake: finished steps, each known by what it was made from.

An entry is a file and, beside it, the key it was made for and its hash. Another key means other
input or options, another hash means damage; both mean: make it again.
"""

import contextlib
import hashlib
import json
import logging
import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TypeVar

from bakery.errors import BakeryError, InputError
from bakery.formats.files import NEW, DiskError, digest, disk_error, write_bytes
from bakery.formats.place import WORK, locked_folder, prefix, remove_hidden, take_lock

Loaded = TypeVar("Loaded")
log = logging.getLogger(__name__)


def key_of(*parts: object) -> str:
    """A key from anything JSON can hold."""
    return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()


class Work:
    """Finished steps in a folder; without one, nothing is kept."""

    def __init__(self, folder: str | Path | None) -> None:
        self.folder = Path(folder) if folder else None

    def get(self, name: str, key: str) -> bytes | None:
        """The bytes of an entry, or None if there is none for this key or it is damaged."""
        if self.folder is None:
            return None
        try:
            about = json.loads((self.folder / f"{name}.key").read_bytes())
            if about["key"] != key:
                log.info("%s: made from something else, made again", name)
                return None
            data = (self.folder / name).read_bytes()
        except (OSError, ValueError, KeyError, TypeError):
            return None
        if digest(data) != about["sha256"]:
            log.warning("%s: damaged in the work folder, made again", name)
            return None
        log.info("%s: taken from the work folder", name)
        return data

    def step(
        self, name: str, key: str, make: Callable[[], bytes], load: Callable[[bytes], Loaded]
    ) -> Loaded:
        """An entry, made unless it is there.

        Args:
            make: returns its bytes.
            load: turns bytes into what they mean; called in both cases, so that a bake that goes on
                gives the same bytes as one that was never interrupted.
        """
        data = self.get(name, key)
        if data is None:
            data = make()
            self.put(name, key, data)
        return load(data)

    def put(self, name: str, key: str, data: bytes | memoryview) -> None:
        """Keep an entry."""
        if self.folder is None:
            return
        # Not waited for until they are on the disk: what a power cut damages is made again.
        write_bytes(self.folder / name, data, sync=False)
        about = {"key": key, "sha256": digest(data)}
        write_bytes(self.folder / f"{name}.key", json.dumps(about).encode(), sync=False)

    def drop(self, name: str) -> None:
        """Keep an entry no longer; there need not be any."""
        if self.folder is not None:
            for path in (self.folder / f"{name}.key", self.folder / name):
                path.unlink(missing_ok=True)


@contextlib.contextmanager
def work_folder(target: Path, folder: Path | None = None) -> Iterator[Work]:
    """The work folder of a bundle: beside it, hidden, gone when the bundle is complete.

    Two bakes of the same bundle at once do not share it: the second gets one of its own.

    Args:
        folder: a folder to use and to keep instead.
    """
    target = Path(os.path.abspath(target))
    kept = folder is not None
    place = target.parent / f"{prefix(target)}{WORK}" if folder is None else Path(folder)
    try:
        place.mkdir(parents=True, exist_ok=True)
        lock = take_lock(place)
    except FileExistsError:  # no folder, or one that another bake removed at this moment
        if place.is_file():
            raise InputError(f"{place}: is no folder; give another --work") from None
        lock = None
    except OSError as error:
        raise disk_error(place, error) from None
    if lock is None:
        with locked_folder(target) as own:
            yield Work(own)
        return
    if any(place.glob("*.key")):
        log.info("%s: goes on from the steps that an earlier run finished", place)
    for stale in place.glob(f"{NEW}*"):
        with contextlib.suppress(OSError):
            stale.unlink()
    keep = kept
    try:
        yield Work(place)
    except BaseException as error:
        # Interrupted, or the disk was full: the next run goes on. A refused photo leaves nothing.
        keep = kept or not isinstance(error, BakeryError) or isinstance(error, DiskError)
        raise
    finally:
        if keep:
            lock.release()
        else:
            remove_hidden(place, target, lock)
