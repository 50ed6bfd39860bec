"""Folders that appear complete or not at all.

A bundle is written into a hidden folder beside its place and changes places with what was there in
one step. Where the system cannot exchange two folders, the old bundle waits in the hidden folder for
the moment between two renames; whoever finds the place empty afterwards brings it back. Hidden
folders are locked while their process lives, so that the next run can tell what a killed one left
behind and clear it away.
"""

import contextlib
import ctypes
import errno
import hashlib
import json
import logging
import os
import shutil
import sys
import tempfile
from collections.abc import Iterator
from fnmatch import fnmatchcase
from pathlib import Path

from filelock import BaseFileLock, FileLock, Timeout

from bakery.errors import InputError
from bakery.formats.files import DiskError, disk_error, sync_folder, sync_path

log = logging.getLogger(__name__)
MANIFEST, SIGNATURE = "avatar.json", "avatar.c2pa"  # what is about all other files, and signs it
LITTER = (".DS_Store", "._*", "Thumbs.db", "desktop.ini")  # that file managers leave in any folder
EXCHANGE = 2  # RENAME_EXCHANGE of renameat2(2)
LOCK, OLD = "lock", "old"  # in hidden folders
WORK = "work"  # how the hidden folder of a bake's finished steps ends


def check_place(target: Path, overwrite: bool) -> None:
    """Refuse a place that must not be written to, after clearing away what killed runs left there.

    Raises:
        InputError: something is there and `overwrite` is false, it is no bundle, it holds files that
            are none of the bundle's, or nothing can be written there.
    """
    target = Path(target)
    if not target.name or target.name in (".", ".."):
        raise InputError(f"{target}: give the bundle a name, such as portrait.avatar")
    try:
        clean(target)
        os.lstat(target)
    except FileNotFoundError:
        _check_parent(target)
        return
    except OSError as error:  # too long, or below a file
        raise disk_error(target, error) from None
    if target.is_symlink() or not target.is_dir():
        raise InputError(f"{target}: is already there and is no folder; give another name")
    if (target / MANIFEST).is_file():
        if not overwrite:
            raise InputError(f"{target}: is already there; --overwrite replaces it")
        _refuse_foreign(target)
    elif any(target.iterdir()):
        raise InputError(f"{target}: a folder of other files; give another name")


def _check_parent(target):
    """Refuse a new place whose nearest folder cannot be written to."""
    near = next(folder for folder in Path(os.path.abspath(target)).parents if folder.exists())
    if not near.is_dir() or not os.access(near, os.W_OK | os.X_OK):
        raise DiskError(
            f"{target}: cannot be written ({near} is no folder that you may write to); write elsewhere"
        )


def _refuse_foreign(bundle):
    """A bundle is replaced as a whole: a file that somebody put into it would be lost."""
    try:
        manifest = json.loads(_read(bundle / MANIFEST))
        own = {MANIFEST, SIGNATURE, *(entry["path"] for entry in manifest["files"])}
    except (ValueError, KeyError, TypeError, RecursionError):
        raise InputError(
            f"{bundle / MANIFEST}: does not say which files are the bundle's; move the folder away"
        ) from None
    for path in sorted(bundle.rglob("*")):
        name = path.relative_to(bundle).as_posix()
        folder = path.is_dir() and not path.is_symlink()
        if not (folder or name in own or is_litter(path.name)):
            raise InputError(f"{path}: is none of the bundle's files; move it away")


def _read(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise disk_error(path, error, "cannot be read") from None


def is_litter(name: str) -> bool:
    """Whether a file was left by a file manager that looked into its folder."""
    return any(fnmatchcase(name, litter) for litter in LITTER)


@contextlib.contextmanager
def staged(target, overwrite):
    """A new folder that takes the target's place when the block ends well.

    Yields:
        Path of the folder to fill.

    Raises:
        InputError: the place is taken, or the disk is full or read-only.
    """
    target = Path(os.path.abspath(target))
    check_place(target, overwrite)
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with locked_folder(target) as hidden:
            folder = hidden / "bundle"
            folder.mkdir()
            yield folder
            sync_folder(folder)
            check_place(target, overwrite)
            try:
                _swap(folder, target, hidden)
            except OSError as error:
                if not overwrite or error.errno not in (errno.ENOTEMPTY, errno.EEXIST):
                    raise
                check_place(target, overwrite)  # another run took the empty place in between
                _swap(folder, target, hidden)
            with contextlib.suppress(OSError):  # a folder that may be written to, but not be read
                sync_path(target.parent)  # the new one is there for good before the old one goes
    except OSError as error:
        if error.errno in (errno.ENOTEMPTY, errno.EEXIST):
            raise InputError(
                f"{target}: appeared while this was made; --overwrite replaces it"
            ) from None
        raise disk_error(target, error) from None


def _swap(folder, target, hidden):
    """Put the folder in its place; an older one goes into the hidden folder."""
    if (target / MANIFEST).exists():
        if _exchange(folder, target):
            return
        os.rename(target, hidden / OLD)
    else:
        with contextlib.suppress(OSError):
            os.rmdir(target)  # Windows renames onto no folder, not even onto an empty one
    os.rename(folder, target)  # refuses a place that is not empty


def _exchange(one, other):
    """Two folders change names at once; false where the system cannot."""
    if not sys.platform.startswith("linux"):
        return False
    try:
        call = ctypes.CDLL(None, use_errno=True).renameat2
    except (OSError, AttributeError):
        return False
    here = -100  # AT_FDCWD
    return call(here, os.fsencode(one), here, os.fsencode(other), EXCHANGE) == 0


def prefix(target):
    """How hidden folders of this target start; short, whatever the target's name."""
    name = hashlib.sha256(os.fsencode(Path(target).name)).hexdigest()[:10]
    return f".bakery-{name}-"


@contextlib.contextmanager
def locked_folder(target: Path) -> Iterator[Path]:
    """A hidden folder beside the target, locked, gone when the block ends; see `remove_hidden`."""
    lock = None
    while lock is None:  # another run may clear a folder away before its lock is taken: then anew
        hidden = Path(tempfile.mkdtemp(prefix=prefix(target), dir=target.parent))
        try:
            lock = take_lock(hidden)
        except OSError:  # a full disk has room for a folder, but not for a file in it
            shutil.rmtree(hidden, ignore_errors=True)
            raise
    try:
        yield hidden
    finally:
        remove_hidden(hidden, target, lock)


@contextlib.contextmanager
def scratch() -> Iterator[Path]:
    """A folder for what a library reads or writes by its path alone, gone when the block ends.

    What a killed run left of its own is cleared away, as beside a bundle.
    """
    target = Path(tempfile.gettempdir()) / "bakery"
    clean(target)
    with locked_folder(target) as folder:
        yield folder


def take_lock(folder: Path) -> BaseFileLock | None:
    """The lock of a folder; None if another one holds it, or removed the folder meanwhile."""
    lock = FileLock(folder / LOCK)
    try:
        lock.acquire(blocking=False)
    except (Timeout, FileNotFoundError, FileExistsError):  # the latter of two at once, by pathlib
        return None
    if not (folder / LOCK).exists():
        lock.release()  # it locks a file that nobody else will see
        return None
    return lock


def remove_hidden(hidden: Path, target: Path, lock: BaseFileLock) -> None:
    """Remove a hidden folder and release its lock; a bundle that waits in it gets its place back.

    If it cannot have it back, the folder stays for the next run.
    """
    settled = False
    try:
        settled = _settle(hidden, target)
        if settled:
            shutil.rmtree(hidden, ignore_errors=True)
    finally:
        lock.release()
    with contextlib.suppress(OSError):
        os.rmdir(hidden)  # Windows removes no open file, so the lock was still in it
    if settled and hidden.exists():
        log.warning("%s: cannot be removed; remove it", hidden)


def _settle(hidden, target):
    """Whether nothing in a hidden folder is needed any more: the old bundle has its place again."""
    old = hidden / OLD
    try:
        if old.is_dir() and os.path.lexists(target):
            # What is left of it, if its removal is interrupted, must not pass for a bundle.
            os.rename(old, hidden / "rest")
        elif old.is_dir():
            os.rename(old, target)
            log.info("%s: the old bundle is back in its place", target)
    except OSError as error:
        log.warning("%s: the old bundle waits in %s (%s)", target, hidden, error.strerror)
        return False
    return True


def clean(target):
    """Clear away what killed runs left beside the target; bring back a bundle they had moved."""
    target = Path(os.path.abspath(target))
    for hidden in sorted(target.parent.glob(f"{prefix(target)}*")):
        if hidden.name == f"{prefix(target)}{WORK}":
            continue
        try:
            lock = take_lock(hidden)
        except OSError:
            continue  # somebody else's
        if lock is not None:  # else its process lives
            remove_hidden(hidden, target, lock)
            log.info("%s: cleared away %s, which a killed run left", target, hidden.name)
