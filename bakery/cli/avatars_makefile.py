"""Write a makefile with one target for each portrait of a folder: `make avatars` runs it.

Only explicit rules can hold names with blanks, so they are written out, escaped.

    python -m bakery.cli.avatars_makefile PHOTOS OUT BAKERY FLAGS > avatars.mk
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


def rules(photos, out, bakery, flags):
    """The makefile's lines."""
    found = sorted(p for p in photos.iterdir() if p.suffix.lower() in ENDINGS and p.is_file())
    stems = Counter(photo.stem for photo in found)
    targets, lines = [], []
    for photo in found:
        if "\n" in str(photo):
            print(
                f"{photo!s:.60}: make cannot take a line break in a name; left out", file=sys.stderr
            )
            continue
        name = photo.stem if stems[photo.stem] == 1 else photo.name
        bundle = out / f"{name}.avatar"
        targets.append(for_make(bundle / "avatar.json"))
        lines += [
            f"{for_make(bundle / 'avatar.json', target=True)}: {for_make(photo)}",
            f"\t@{bakery} build {flags} --overwrite -o {for_shell(bundle)} -- {for_shell(photo)}",
        ]
    # PRECIOUS: make must not delete the manifest of a bundle that was complete when it was stopped.
    every = " ".join(targets)
    return [f"all: {every}", ".PHONY: all", f".PRECIOUS: {every}", *lines]


if __name__ == "__main__":
    photos, out, bakery, flags = sys.argv[1:]
    if not Path(photos).is_dir():
        sys.exit(f"PHOTOS={photos}: not a folder; give the folder of the portraits")
    print("\n".join(rules(Path(photos), Path(out), bakery, flags)))
