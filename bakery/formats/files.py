"""Bytes on disk: written aside and renamed, so that a reader never sees half a file."""

import contextlib
import errno
import hashlib
import os
import stat
import tempfile
from pathlib import Path

from bakery.errors import InputError

LARGEST = 512 * 2**20  # bytes; the largest picture that is accepted, uncompressed, has less


class DiskError(InputError):
    """A write failed: the input is good, the place is not."""


def digest(data):
    """SHA-256 of bytes, as hexadecimal text."""
    return hashlib.sha256(data).hexdigest()


def digest_file(path):
    """SHA-256 of a file, as hexadecimal text."""
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def read_bytes(path, largest=LARGEST, first=-1):
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


def write_bytes(path, data):
    """Write a file at once: the old one stays until the new one is complete.

    Raises:
        DiskError: the disk is full or read-only, or the folder cannot be written.
    """
    path = Path(path)
    temporary = None
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, temporary = tempfile.mkstemp(prefix=".new-", dir=path.parent)
        with open(handle, "wb") as file:
            file.write(data)
        os.chmod(temporary, 0o666 & ~_umask())
        os.replace(temporary, path)
        temporary = None
    except OSError as error:
        raise disk_error(path, error) from None
    finally:
        if temporary:
            with contextlib.suppress(OSError):
                os.unlink(temporary)


def disk_error(path, error):
    """The OSError of a write as a DiskError that says what to do."""
    advice = {
        errno.ENOSPC: "free some space, or write to another disk",
        errno.EDQUOT: "free some space, or write to another disk",
        errno.EROFS: "write to another disk",
        errno.EACCES: "check who may write there, or write elsewhere",
        errno.ENAMETOOLONG: "give a shorter name",
    }.get(error.errno, "check the path")
    reason = error.strerror or type(error).__name__
    return DiskError(f"{path}: cannot be written ({reason}); {advice}")


def _umask():
    mask = os.umask(0o022)
    os.umask(mask)
    return mask
