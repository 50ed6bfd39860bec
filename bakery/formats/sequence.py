"""Films as numbered PNG files, frame.00000.png and so on, as compositing programs read them."""

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bakery.errors import InputError
from bakery.formats.image import encode_image
from bakery.formats.mark import PNG_XMP, with_texts
from bakery.formats.video import ALPHA, KINDS, Note

NAME = "frame.%05d.png"  # in a folder that is given without a pattern
NUMBER = re.compile(r"%0?(\d?)d|(#+)")


@dataclass(frozen=True)
class Sequence:
    """Where the frames of a film go."""

    folder: Path
    before: str  # of a file's name, in front of the number
    digits: int  # at least, with zeros in front
    after: str  # behind the number

    def path(self, number: int) -> Path:
        """The file of one frame."""
        return self.folder / f"{self.before}{number:0{self.digits}d}{self.after}"

    def found(self) -> list[Path]:
        """The frames that are there already."""
        name = re.compile(rf"{re.escape(self.before)}\d{{{self.digits},}}{re.escape(self.after)}")
        if not self.folder.is_dir():
            return []
        return sorted(path for path in self.folder.iterdir() if name.fullmatch(path.name))

    def __str__(self):
        return str(self.folder / f"{self.before}{'#' * self.digits}{self.after}")


def sequence_of(output: str) -> Sequence | None:
    """The sequence that an output names; None if it names a video.

    Args:
        output: a folder ("out/", "out"), or files by number ("out/frame.%05d.png", "out/f.####.png").

    Raises:
        InputError: a PNG without a number, or a folder that is a file.
    """
    path = Path(output)
    ending = path.suffix.lower()
    folder = output.endswith(("/", "\\")) or path.is_dir() or not ending
    if not folder and ending != ".png":
        return None
    pattern = path / NAME if folder else path
    numbers = list(NUMBER.finditer(pattern.name))
    if len(numbers) != 1 or "%" in NUMBER.sub("", pattern.name):
        raise InputError(f"{output}: give a folder, or one number as in {NAME} or frame.#####.png")
    if pattern.parent.exists() and not pattern.parent.is_dir():
        raise InputError(f"{pattern.parent}: is a file; give a folder for the frames")
    number = numbers[0]
    digits = len(number[2]) if number[2] else int(number[1] or 1)
    before, after = pattern.name[: number.start()], pattern.name[number.end() :]
    return Sequence(pattern.parent, before, digits, after)


def check_output(output: str) -> Sequence | None:
    """`sequence_of`, for commands that write videos too.

    Raises:
        InputError: neither a sequence nor a video.
    """
    found = sequence_of(output)
    if found is None and Path(output).suffix.lower() not in (*KINDS, ALPHA):
        raise InputError(
            f"{output}: give .webm (plays in browsers), .mp4 (players, editors), or a folder or "
            f"{NAME} for frames"
        )
    return found


def png(picture: np.ndarray, note: Note) -> bytes:
    """A PNG that says what it shows, in XMP and as a comment.

    Args:
        picture: [H, W, 3] or [H, W, 4] uint8 sRGB, colour not multiplied by alpha.
    """
    data = encode_image(picture, ".png")
    return with_texts(data, {"Comment": note.text, PNG_XMP: note.xmp()})
