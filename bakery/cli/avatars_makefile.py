"""Write a makefile with one target for each portrait of a folder: `make avatars` runs it.

Only explicit rules can hold names with blanks, so they are written out, escaped. A bundle is made
again when its photo or the flags have changed since.

    python -m bakery.cli.avatars_makefile PHOTOS OUT BAKERY FLAGS

writes OUT/.avatars.mk, and OUT/.avatars.flags when the flags are others than last time.
"""

import re
import shlex
import sys
from collections import Counter
from pathlib import Path

ENDINGS = (".jpg", ".jpeg", ".png", ".tif", ".tiff", ".webp", ".bmp", ".jp2")


def for_make(path, target=False):
    """A path as a prerequisite or target; only a target takes `%` for a pattern."""
    text = str(path).replace("$", "$$")
    return re.sub(r"([ #:%\\])" if target else r"([ #:\\])", r"\\\1", text)


def for_shell(path):
    """A path as an argument in a recipe."""
    return shlex.quote(str(path)).replace("$", "$$")


def portraits(folder):
    """The photos of a folder; hidden files are left out."""
    found = sorted(
        path
        for path in folder.iterdir()
        if path.suffix.lower() in ENDINGS and not path.name.startswith(".") and path.is_file()
    )
    for path in found:
        if "\n" in str(path):
            print(
                f"{path!s:.60}: make cannot take a line break in a name; left out", file=sys.stderr
            )
    return [path for path in found if "\n" not in str(path)]


def rules(photos, out, bakery, flags, stamp):
    """The makefile's lines for photos, which bundles are newer than, as than the file `stamp`."""
    stems = Counter(photo.stem for photo in photos)
    targets, lines = [], []
    for photo in photos:
        name = photo.stem if stems[photo.stem] == 1 else photo.name
        bundle = out / f"{name}.avatar"
        targets.append(for_make(bundle / "avatar.json"))
        lines += [
            f"{for_make(bundle / 'avatar.json', target=True)}: {for_make(photo)} {for_make(stamp)}",
            f"\t@{bakery} build {flags} --overwrite -o {for_shell(bundle)} -- {for_shell(photo)}",
        ]
    # PRECIOUS: make must not delete the manifest of a bundle that was complete when it was stopped.
    every = " ".join(targets)
    return [f"all: {every}", ".PHONY: all", f".PRECIOUS: {every}", *lines]


def write(photos, out, bakery, flags):
    """Write the makefile and the stamp of the flags.

    Raises:
        SystemExit: there is nothing to bake.
    """
    if not photos.is_dir():
        sys.exit(f"PHOTOS={photos}: not a folder; give the folder of the portraits")
    found = portraits(photos)
    if not found:
        sys.exit(f"PHOTOS={photos}: holds no portrait ({', '.join(ENDINGS)}); give another folder")
    out.mkdir(parents=True, exist_ok=True)
    stamp = out / ".avatars.flags"
    if not stamp.is_file() or stamp.read_text(encoding="utf-8") != flags:
        stamp.write_text(flags, encoding="utf-8")
    lines = rules(found, out, bakery, flags, stamp)
    (out / ".avatars.mk").write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    photos, out, bakery, flags = sys.argv[1:]
    write(Path(photos), Path(out), bakery, flags.strip())
