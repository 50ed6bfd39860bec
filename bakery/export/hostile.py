"""What a bundle from a stranger may try, refused before a pixel is opened.

Hashes do not help here: whoever made the bundle wrote them. So names are text without marks that turn
or hide text, numbers are finite, files are plain files inside the folder, and headers promise no
more than fits into memory.
"""

import math
import os
import stat
import unicodedata
from pathlib import Path

from bakery.errors import BakeryError, BundleError
from bakery.export.layout import is_opened
from bakery.formats import exr, npz
from bakery.formats.files import digest_file, read_bytes
from bakery.formats.image_header import read_header

DEEPEST = 32  # tables within tables
LARGEST_FILE = 4 * 2**30  # bytes
PICTURES = (".png", ".webp", ".jpg", ".jpeg")
# Marks that change the direction of text or hide in it, and those that would be markup on a page.
TURNING = {0x061C, 0x200B, 0x200E, 0x200F, 0x2028, 0x2029, 0x2060, 0xFEFF}
TURNING |= set(range(0x202A, 0x202F)) | set(range(0x2066, 0x206A))


def text_problem(text):
    """What is wrong with a text of a manifest, or None."""
    for letter in text:
        if ord(letter) in TURNING or unicodedata.category(letter) in ("Cc", "Cs", "Co", "Cn"):
            return f"holds the hidden character U+{ord(letter):04X}"
        if letter in "<>":
            return "holds '<' or '>', which is markup"
    return None


def table_problems(value, where="", depth=0):
    """Yield findings about the texts and numbers of a manifest: "keys/0/name: ..."."""
    here = where or "the manifest"
    if depth > DEEPEST:
        yield f"{here}: tables more than {DEEPEST} deep"
    elif isinstance(value, str):
        if trouble := text_problem(value):
            yield f"{here}: {trouble}"
    elif isinstance(value, float) and not math.isfinite(value):
        yield f"{here}: a number that is not finite"
    elif isinstance(value, int) and abs(value) > 2**53:
        yield f"{here}: a number beyond 2^53"
    elif isinstance(value, dict):
        for number, (key, entry) in enumerate(value.items()):
            if trouble := text_problem(key):
                yield f"{here}: the name of its entry {number} {trouble}"
            else:
                yield from table_problems(entry, f"{where}/{key}".lstrip("/"), depth + 1)
    elif isinstance(value, list):
        for number, entry in enumerate(value):
            yield from table_problems(entry, f"{where}/{number}".lstrip("/"), depth + 1)


def file_problem(folder, entry):
    """What is wrong with a file that a manifest lists, or None; hashes included."""
    name = entry["path"]
    steps = name.split("/")
    if ".." in steps or "" in steps or name.startswith("/") or "\\" in name or ":" in name:
        return "a path that leads out of the bundle"
    path = Path(folder)
    for step in steps:
        path = path / step
        if path.is_symlink():
            return "a link; bundles hold plain files only"
    try:
        about = os.lstat(path)
    except OSError:
        return "missing"
    if not stat.S_ISREG(about.st_mode):
        return "not a plain file"
    if about.st_size != entry["bytes"]:
        return f"{about.st_size} bytes, the manifest says {entry['bytes']}"
    if about.st_size > LARGEST_FILE:
        return f"{about.st_size} bytes, more than any file of a bundle"
    if digest_file(path) != entry["sha256"]:
        return "its SHA-256 is not the manifest's"
    return None


def header_problem(folder, name):
    """What the header of a file promises that is too much, or None; no pixel is opened."""
    path = Path(folder) / name
    if not is_opened(name):
        return None
    try:
        if name.endswith(".exr"):
            exr.read_header(path)
        elif name.endswith(PICTURES):
            read_header(name, read_bytes(path), smallest=1)
        elif name.endswith(".npz"):
            npz.check_arrays(read_bytes(path))
    except npz.NpzError as error:
        return str(error)
    except BakeryError as error:
        return str(error).replace(str(path), name).removeprefix(f"{name}: ")
    except (OSError, ValueError):
        return "damaged"
    return None


def refuse(folder, manifest):
    """Raise BundleError for the first file of a bundle that a player must not touch.

    Args:
        folder: the bundle.
        manifest: its table, as `bundle.read_manifest` gives it.
    """
    for entry in manifest["files"]:
        trouble = file_problem(folder, entry)
        if trouble is None:
            trouble = header_problem(folder, entry["path"])
        if trouble:
            raise BundleError(f"{folder}: {entry['path']}: {trouble}; make the bundle again")
