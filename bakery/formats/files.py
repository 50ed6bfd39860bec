"""Bytes on disk: written aside and renamed, so that a reader never sees half a file."""

import contextlib
import errno
import hashlib
import os
import secrets
import shutil
import stat
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

from bakery.errors import InputError

LARGEST = 512 * 2**20  # bytes; the largest picture that is accepted, uncompressed, has less
NEW = ".new-"  # how files begin that are not complete; short, whatever the name of the target
OPEN_FILES = "/proc/self/fd/{}"  # of Linux: a file of this process, by its descriptor
TRIES = 100  # to give a file its place while others do so too
CANNOT_SYNC = (errno.EINVAL, errno.ENOSYS, errno.ENOTSUP)  # what some network file systems say


class DiskError(InputError):
    """A write failed: the input is good, the place is not."""


def digest(data: bytes | memoryview) -> str:
    """SHA-256 of bytes, as hexadecimal text."""
    return hashlib.sha256(data).hexdigest()


def digest_file(path: str | Path) -> str:
    """SHA-256 of a file, as hexadecimal text."""
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def read_bytes(path: str | Path, largest: int = LARGEST, first: int = -1) -> bytes:
    """The bytes of an ordinary file.

    Args:
        path: the file.
        largest: bytes that it may have.
        first: read no more than so many; -1 for all.

    Raises:
        InputError: missing, a folder or a device, empty, unreadable, or above `largest` bytes.
    """
    path = Path(path)
    try:
        # O_NONBLOCK: opening a pipe nobody writes to must not hang.
        with open(os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0)), "rb") as file:
            about = os.fstat(file.fileno())
            if not stat.S_ISREG(about.st_mode):
                raise InputError(f"{path}: not a file; give the path of a file")
            if about.st_size > largest:
                raise InputError(
                    f"{path}: {about.st_size / 2**20:.0f} MiB; at most {largest / 2**20:.0f} MiB are read"
                )
            data = file.read(first)
    except FileNotFoundError:
        raise InputError(f"{path}: no such file; check the path") from None
    except IsADirectoryError:
        raise InputError(f"{path}: a folder; give the path of a file") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}); check the file") from None
    if not data:
        raise InputError(f"{path}: an empty file (0 bytes); copy or download it again")
    return data


def write_bytes(path: str | os.PathLike, data: bytes | memoryview, sync: bool = True) -> None:
    """Write a file at once: the old one stays until the new one is complete.

    Args:
        path: where to; the folder is made.
        data: bytes.
        sync: see `replacing`.

    Raises:
        DiskError: the disk is full or read-only, the folder cannot be written, or the name is too
            long or belongs to something that is no file.
    """
    with replacing(path, sync) as file:
        file.write(data)


@contextlib.contextmanager
def replacing(path: str | os.PathLike, sync: bool = True) -> Iterator[BinaryIO]:
    """A file to write, seek and read in, which takes the path's place when the block ends well.

    The mode is what the umask leaves of 0666, applied by the system: asking for the umask changes
    it for a moment, and other threads write meanwhile. Where the system can, the file has no name until
    it is complete: a process that is killed leaves nothing behind.

    Args:
        path: where to; the folder is made.
        sync: whether the bytes are on the disk before the name is theirs, so that a power cut leaves
            the old file or the new one. Not needed where damage is found and mended.

    Raises:
        DiskError: see `write_bytes`.
    """
    path = Path(path)
    temporary = path.parent / f"{NEW}{secrets.token_hex(8)}"
    try:
        if path.exists() and not path.is_file():  # renaming would put a file in a device's place
            raise DiskError(f"{path}: is there and is no file; give another name")
        path.parent.mkdir(parents=True, exist_ok=True)
        handle = _nameless(path.parent)
        with open(
            temporary if handle is None else handle, "x+b" if handle is None else "w+b"
        ) as file:
            yield file
            file.flush()
            if sync:
                _sync(file.fileno())
            if handle is not None and _placed(file, path):
                return
            if handle is not None:
                _copy(file, temporary, sync)
        os.replace(temporary, path)
    except OSError as error:
        raise disk_error(path, error) from None
    finally:
        with contextlib.suppress(OSError):
            os.unlink(temporary)  # gone if all went well


def _nameless(folder):
    """A descriptor of a new file in a folder that has no name there; None where the system has no such files."""
    if not hasattr(os, "O_TMPFILE") or not os.path.exists(OPEN_FILES.format("")):
        return None
    try:
        return os.open(folder, os.O_TMPFILE | os.O_RDWR, 0o666)
    except OSError as error:
        if error.errno in (*CANNOT_SYNC, errno.EISDIR, errno.ENOENT):
            return None
        raise


def _placed(file, path):
    """Give a file without a name the place of `path`; whether the system allows that.

    For a moment it has another name, always the same: what a process left that was killed then, the next
    one removes. If that one lives, it comes again with its own file, which is as complete.
    """
    named = path.parent / f"{NEW}{digest(os.fsencode(path.name))[:16]}"
    for _ in range(TRIES):
        try:
            # An absolute path needs no folder; with one, Python follows the link to the file.
            os.link(OPEN_FILES.format(file.fileno()), named, src_dir_fd=file.fileno())
        except FileExistsError:
            with contextlib.suppress(FileNotFoundError):
                os.unlink(named)
            continue
        except OSError:
            return False
        try:
            os.replace(named, path)
        except FileNotFoundError:
            continue
        except BaseException:
            with contextlib.suppress(OSError):
                os.unlink(named)
            raise
        # Renaming one name of a file to another of its own does nothing: another run gave it that place.
        with contextlib.suppress(FileNotFoundError):
            if os.path.samefile(named, path):
                os.unlink(named)
        return True
    return False


def _copy(file, path, sync):
    """Write what is in an open file to a new one."""
    file.seek(0)
    with open(path, "xb") as copy:
        shutil.copyfileobj(file, copy)
        if sync:
            copy.flush()
            _sync(copy.fileno())


def sync_folder(folder: str | os.PathLike) -> None:
    """Bring what a folder holds onto the disk: its files, its folders, and their names.

    Raises:
        OSError: the disk is full or broken.
    """
    for here, _, names in os.walk(folder, topdown=False):
        for path in (*(os.path.join(here, name) for name in names), here):
            sync_path(path)


def sync_path(path: str | os.PathLike) -> None:
    """Bring a file, or the names in a folder, onto the disk.

    Raises:
        OSError: the disk is full or broken.
    """
    windows = os.name == "nt"
    if windows and os.path.isdir(path):
        return  # Windows opens no folders, and keeps their names by itself
    handle = os.open(path, os.O_RDWR if windows else os.O_RDONLY)
    try:
        _sync(handle)
    finally:
        os.close(handle)


def _sync(handle):
    try:
        os.fsync(handle)
    except OSError as error:
        if error.errno not in CANNOT_SYNC:
            raise


def disk_error(path, error, trouble="cannot be written"):
    """The OSError of a write, or of another use, as a DiskError that says what to do."""
    advice = {
        errno.ENOSPC: "free some space, or write to another disk",
        errno.EDQUOT: "free some space, or write to another disk",
        errno.EROFS: "write to another disk",
        errno.EACCES: "check who may write there, or write elsewhere",
        errno.ENAMETOOLONG: "give a shorter name",
    }.get(error.errno, "check the path")
    reason = error.strerror or type(error).__name__
    return DiskError(f"{path}: {trouble} ({reason}); {advice}")
