"""Folders that appear complete or not at all.

A bundle is written into a hidden folder beside its place and changes places with what was there in
one step. Hidden folders are locked while their process lives, so that the next run can tell what a
killed one left behind and clear it away.
"""

import contextlib
import ctypes
import errno
import fcntl
import hashlib
import os
import shutil
import sys
import tempfile
import time
from pathlib import Path

from bakery.errors import InputError
from bakery.formats.files import disk_error

MANIFEST = "avatar.json"
EXCHANGE = 2  # RENAME_EXCHANGE of renameat2(2)


def check_place(target, overwrite):
    """Refuse a place that must not be written to.

    Raises:
        InputError: something is there and `overwrite` is false, or it is no bundle.
    """
    target = Path(target)
    if not target.name or target.name in (".", ".."):
        raise InputError(f"{target}: give the bundle a name, such as portrait.avatar")
    if not (target.exists() or target.is_symlink()):
        return
    if target.is_symlink() or not target.is_dir():
        raise InputError(f"{target}: is already there and is no folder; give another name")
    if (target / MANIFEST).is_file():
        if not overwrite:
            raise InputError(f"{target}: is already there; --overwrite replaces it")
    elif any(target.iterdir()):
        raise InputError(f"{target}: a folder of other files; give another name")


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
        clean(target)
        with locked_folder(target) as hidden:
            folder = hidden / "bundle"
            folder.mkdir()
            yield folder
            os.chmod(folder, 0o777 & ~_umask())
            check_place(target, overwrite)
            _swap(folder, target, hidden)
    except OSError as error:
        if error.errno in (errno.ENOTEMPTY, errno.EEXIST):
            raise InputError(
                f"{target}: appeared while this was made; --overwrite replaces it"
            ) from None
        raise disk_error(target, error) from None


def _swap(folder, target, hidden):
    """Put the folder in its place; an older one goes into the hidden folder in the same step."""
    if not target.exists() or not any(target.iterdir()):
        os.rename(folder, target)  # refuses a place that is not empty
    elif not _exchange(folder, target):
        os.rename(target, hidden / "old")  # `clean` brings it back if this is the last thing done
        os.rename(folder, target)


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


def _umask():
    mask = os.umask(0o022)
    os.umask(mask)
    return mask


def prefix(target):
    """How hidden folders of this target start; short, whatever the target's name."""
    name = hashlib.sha256(os.fsencode(Path(target).name)).hexdigest()[:10]
    return f".bakery-{name}-"


@contextlib.contextmanager
def locked_folder(target):
    """A hidden folder beside the target, locked, gone when the block ends."""
    hidden = Path(tempfile.mkdtemp(prefix=prefix(target), dir=target.parent))
    with open(hidden / "lock", "wb") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        try:
            yield hidden
        finally:
            shutil.rmtree(hidden, ignore_errors=True)


def clean(target):
    """Clear away what killed runs left beside the target; bring back a bundle they had moved."""
    target = Path(os.path.abspath(target))
    for hidden in sorted(target.parent.glob(f"{prefix(target)}*")):
        if hidden.name.endswith("-work"):
            continue
        try:
            lock = open(hidden / "lock", "rb")
        except FileNotFoundError:
            with contextlib.suppress(OSError):
                if time.time() - hidden.stat().st_mtime > 60:  # not one that is just being made
                    shutil.rmtree(hidden, ignore_errors=True)
            continue
        except OSError:
            continue
        with lock:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError:
                continue  # its process lives
            old = hidden / "old"
            if old.is_dir() and not target.exists():
                with contextlib.suppress(OSError):
                    os.rename(old, target)
            shutil.rmtree(hidden, ignore_errors=True)
