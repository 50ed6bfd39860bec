"""Whether an installed package has entry points of a group, without `importlib.metadata`.

That module takes 30 ms to import, half of `bakery --help`, and mostly there is nothing to find.
"""

import os
import sys


def may_have(group):
    """Whether `importlib.metadata.entry_points(group=group)` may find anything.

    False is certain. True may be wrong: a package that a nearer one hides, or a zip on the path,
    which is not opened here.
    """
    header = f"[{group}]".encode()
    return any(_names(folder or os.curdir, header) for folder in sys.path)


def _names(folder, header):
    """Whether metadata in a folder of the path, also of an editable install, holds the header."""
    try:
        names = os.listdir(folder)
    except NotADirectoryError:
        return True  # a zipped egg or wheel
    except OSError:
        return False
    return any(
        header in _read(os.path.join(folder, name, "entry_points.txt"))
        for name in names
        if name.lower().endswith((".dist-info", ".egg-info", "egg-info"))
    )


def _read(path):
    try:
        with open(path, "rb") as file:
            return file.read()
    except OSError:
        return b""
