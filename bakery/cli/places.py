"""Where a command may write: no file that another made is ever replaced without being told to.

Each command asks before its slow work begins.
"""

import os
import stat
import tempfile
from pathlib import Path

import click

from bakery.errors import InputError, UsageProblem

PICTURES = (".png", ".jpg", ".webp")  # what `formats.image.write_image` writes


def may_write(path, overwrite, inputs=(), endings=()):
    """Refuse a file that a command must not write.

    Args:
        path: the file; None is stdout.
        overwrite: whether a file that is there may be replaced.
        inputs: what the command reads or writes besides what its options and arguments name.
        endings: the name must have one of these, such as (".png",); any without them.

    Raises:
        UsageProblem: another ending, or the place of an input, of another output or of a bundle.
        InputError: something is there.
        DiskError: nothing can be written there.
    """
    if path is None:
        return
    if endings and path.suffix.lower() not in endings:
        raise UsageProblem(
            f"{path}: names no file that ends in {' or '.join(endings)}, as what is written does; "
            "give such a name"
        )
    there = _there(path)
    _apart(path, inputs)
    _outside_bundles(path)
    if there is not None:
        if stat.S_ISDIR(there.st_mode):
            raise InputError(f"{path}: is a folder; give the name of a file")
        if not (stat.S_ISREG(there.st_mode) or stat.S_ISLNK(there.st_mode)):
            raise InputError(f"{path}: is no ordinary file; give another name")
        if not overwrite:
            raise InputError(f"{path}: is already there; --overwrite replaces it")
    _writable(path)


def may_bake(folder, overwrite):
    """Refuse a folder that a bundle must not take, as `may_write`."""
    from bakery.formats.place import check_place

    _there(folder)
    check_place(folder, overwrite)
    _apart(folder)
    _outside_bundles(folder)
    _writable(folder)


def may_fill(folder, overwrite):
    """Refuse a folder that a command must not write its files to, as `may_write`.

    Args:
        folder: need not exist; None is none.
        overwrite: whether files that are there may be replaced.
    """
    if folder is None:
        return
    _folder(folder)
    if not overwrite and _entries(folder):
        raise InputError(
            f"{folder}: holds files already; give another folder, or --overwrite to replace those "
            "of the same names"
        )


def may_go_on(folder, marks=()):
    """Refuse a folder that is not one of runs that go on where they stopped.

    Args:
        folder: need not exist; None is none.
        marks: patterns of files of which such a folder always holds one; none takes any folder, for
            commands that leave alone what is there.
    """
    if folder is None:
        return
    _folder(folder)
    if marks and _entries(folder) and not any(any(folder.glob(mark)) for mark in marks):
        raise InputError(f"{folder}: a folder of other files; give a new one, or one of such a run")


def _folder(folder):
    there = _there(folder)
    _outside_bundles(folder)
    if there is not None and not os.path.isdir(folder):
        raise InputError(f"{folder}: is no folder; give the name of a folder")
    _writable(folder / "x")


def _entries(folder):
    """Whether a folder holds anything; hidden files of the system do not count."""
    return folder.is_dir() and any(not path.name.startswith(".") for path in folder.iterdir())


def _apart(path, inputs=()):
    """Refuse the place of something else that the command was given."""
    for name, other in (*_given(path), *(("the input", other) for other in inputs)):
        if _same(path, other):
            raise UsageProblem(f"{path}: is also {name}; give another name to write to")


def _there(path):
    """What is at a path, links not followed; None if there is nothing."""
    try:
        return os.lstat(path)
    except (FileNotFoundError, NotADirectoryError):
        return None
    except OSError as error:
        raise _disk_error(path, error) from None


def _given(path):
    """(name, path) of each other path among the options and arguments of this command."""
    context = click.get_current_context(silent=True)
    if context is None:
        return
    given = [
        (parameter, value)
        for parameter in context.command.params
        for value in _values(context.params.get(parameter.name))
    ]
    same = [each for each in given if each[1] is path]
    same = same or [each for each in given if str(each[1]) == str(path)]
    for parameter, value in given:
        if not any(own[0] is parameter for own in same[:1]):
            yield _name_of(parameter), value


def _values(value):
    """The paths that a parameter was given; one that takes a name or a file, as --head, has text."""
    for one in value if isinstance(value, tuple) else (value,):
        if isinstance(one, Path) or (isinstance(one, str) and os.path.isfile(one)):
            yield one


def _name_of(parameter):
    if isinstance(parameter, click.Argument):
        return parameter.human_readable_name
    return f"what {max(parameter.opts, key=len)} names"


def _same(one, other):
    """Whether two paths lead to one file, whether it is there or not."""
    try:
        return os.path.samefile(one, other)
    except (OSError, ValueError):
        return os.path.realpath(one) == os.path.realpath(other)


def _outside_bundles(path):
    """The files of a bundle fit together: only what makes a whole one writes them."""
    from bakery.formats.place import MANIFEST

    for folder in Path(os.path.realpath(path)).parents:
        if (folder / MANIFEST).is_file():
            raise UsageProblem(f"{path}: lies in the bundle {folder}; write it elsewhere")


def _writable(path):
    """See that a file can be made in the nearest folder that exists."""
    folder = next(p for p in Path(os.path.abspath(path)).parents if os.path.lexists(p))
    if not folder.is_dir():
        raise InputError(f"{path}: {folder} is no folder; give another name")
    try:
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise _disk_error(path, error) from None


def _disk_error(path, error):
    from bakery.formats.files import disk_error  # not for a key press of completion

    return disk_error(path, error)
